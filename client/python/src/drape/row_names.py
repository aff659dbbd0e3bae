"""What the server says about the cloths of a request, by the indices that the program knows them by."""

from __future__ import annotations

import re

from google.protobuf.message import Message

_PLACE = re.compile(r"\bcloth (\d+) of the request\b")
_ID = re.compile(r"(?:\bcloth )?\b(\d{10,20})\b")  # in the protocol: numbers of the whole range of 64 bits
_ELEMENT = re.compile(r"(?:(\w+)\.)?(\w+)\[(\d+)\]")


def told_by_row(error, request, name_of):
    """Changes `error`, which came for `request`: cloths are called what `name_of` says of their names in the protocol
    (None: nothing), and so are those whose element of a list is wrong. The paths of fields stay those of the protocol."""
    if not isinstance(request, Message):
        return
    before = _joined(error.fields)
    error.fields = tuple(field._replace(description=_described(field, request, name_of)) for field in error.fields)
    message = error.message.replace(before, _joined(error.fields)) if before else error.message
    error.message = _reworded(message, request, name_of)


def _joined(fields):
    return "; ".join(f"{field}: {description}" for field, description in fields)


def _reworded(text, request, name_of):
    ids = _ids_of(request)

    def of_place(match):
        at = int(match[1])
        return (name_of(ids[at]) if at < len(ids) else None) or match[0]

    return _ID.sub(lambda match: name_of(int(match[1])) or match[0], _PLACE.sub(of_place, text))


def _described(field, request, name_of):
    text = _reworded(field.description, request, name_of)
    cloth = _cloth_of(field.field, request)
    name = None if cloth is None else name_of(cloth)
    return text if name is None or name in text else f"{text} ({name})"


def _cloth_of(path, request):
    """The cloth that has the element `path` of a list with equally many elements for each cloth; None if it is no such."""
    element = _ELEMENT.match(path)
    if element is None:
        return None
    table = getattr(request, element[1], None) if element[1] else request
    column = getattr(table, element[2], None) if isinstance(table, Message) else None
    if column is None:
        return None
    ids = _ids_of(table)
    length = column.shape[0] if isinstance(column, Message) else len(column)  # of packed arrays rows are counted
    if not ids or length % len(ids):
        return None
    at = int(element[3]) * len(ids) // length if length else len(ids)
    return ids[at] if at < len(ids) else None


def _ids_of(table):
    """The cloths that the rows of a message are about: of those to be created their numbers."""
    if not hasattr(table, "cloth_ids"):
        return range(getattr(table, "count", 0))
    return table.cloth_ids
