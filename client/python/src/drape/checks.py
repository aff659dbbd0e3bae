"""Arguments that cannot be sent: an InvalidArgument with the field, its value and what is legal, in place of what
protobuf, numpy or gRPC would raise. What can be sent, the server checks."""

from __future__ import annotations

import difflib
import functools
import math
import operator
import os
import reprlib

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from . import errors

_WHOLE = {FieldDescriptor.CPPTYPE_INT32: (-2**31, 2**31 - 1), FieldDescriptor.CPPTYPE_INT64: (-2**63, 2**63 - 1),
          FieldDescriptor.CPPTYPE_UINT32: (0, 2**32 - 1), FieldDescriptor.CPPTYPE_UINT64: (0, 2**64 - 1)}
_MOST_PORT = 2**16 - 1
_OTHER_ADDRESSES = ("unix:", "unix-abstract:", "vsock:", "dns:", "ipv4:", "ipv6:", "xds:")
_MADE_BY = {"PackedArray": ", as drape.pack makes of an array", "Mesh": ", as drape.mesh.load and drape.mesh.from_arrays make"}
_REPEATED = 3  # FieldDescriptor.LABEL_REPEATED; younger versions of protobuf have is_repeated instead


def message(kind, **fields):
    """A message of these fields, which are those of a request: an error names them alone. Fields that are None are unset."""
    try:
        return kind(**fields)
    except (TypeError, ValueError) as error:
        raise unfit(kind, (), fields, "") or error from None


def unfit(kind, arguments, fields, place):
    """Why there is no message of this kind with these arguments and fields, an InvalidArgument that names the first of
    those as `place` + its name; None if it cannot be told."""
    known = kind.DESCRIPTOR.fields_by_name
    if arguments:
        return errors.InvalidArgument(f"{kind.DESCRIPTOR.name} takes its fields by name: {', '.join(known) or 'it has none'}",
                                      reason="BAD_FIELD")
    twice = doubled(kind.DESCRIPTOR, fields, place)
    if twice is not None:
        return twice
    initialise = getattr(kind.__init__, "__wrapped__", kind.__init__)  # protobuf's own (drape.v1)
    for name, value in fields.items():
        if name not in known:
            return errors.bad_field(place + name, _no_such_field(kind.DESCRIPTOR, name))
        try:
            initialise(kind.__new__(kind), **{name: value})
        except (TypeError, ValueError):
            return _not_legal(known[name], value, place + name)
    return None


def doubled(descriptor, fields, place):
    """An InvalidArgument if these fields of a message, or those of a dict among them, have two members of one choice, of which
    protobuf would keep the last; else None."""
    chosen, looked_at = {}, _in_choices(descriptor)
    for name, value in fields.items():
        if value is None or name not in looked_at:
            continue
        choice, kind, is_many = looked_at[name]
        other = name if choice is None else chosen.setdefault(choice, name)
        if other != name:
            return errors.bad_field(place + name, f"only one of {other} and {name} may be given")
        if kind is None or isinstance(value, Message):
            continue
        for at, part in enumerate(value if isinstance(value, (list, tuple)) else [value]):
            if isinstance(part, dict):
                error = doubled(kind, part, f"{place}{name}[{at}]." if is_many else f"{place}{name}.")
                if error is not None:
                    return error
    return None


@functools.cache
def _in_choices(descriptor):
    """Of the fields that are members of a choice, or may be dicts with some: name -> choice, message, whether it is a list."""
    found = {name: (choice_of(field), field.message_type, is_list(field)) for name, field in descriptor.fields_by_name.items()}
    return {name: (choice and choice.name, kind, is_many) for name, (choice, kind, is_many) in found.items() if choice or kind}


def of_kind(name, value, kind):
    """`value`, a message of this kind, or None."""
    if value is not None and not isinstance(value, kind):
        raise errors.bad_field(name, f"{_told(value)} is not a {kind.DESCRIPTOR.name}")
    return value


def whole(name, value, low, high, told=None):
    """`value` as an int in [low, high]. told: the highest legal value, where the server refuses those above."""
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or not low <= number <= high:
        raise errors.bad_field(name, f"{reprlib.repr(value)} is not a whole number in [{low}, {told or high}]")
    return number


def seconds(name, value):
    """None, or `value` as a float > 0."""
    try:
        if value is None or float(value) > 0:
            return None if value is None else float(value)
    except (TypeError, ValueError):
        pass
    raise errors.bad_field(name, f"{reprlib.repr(value)} is not a number of seconds > 0, nor None")


def positive(name, value):
    """`value` as a finite float > 0."""
    number = _float(value)
    if not 0 < number < math.inf:
        raise errors.bad_field(name, f"{reprlib.repr(value)} is not a finite number > 0")
    return number


def not_negative(name, value):
    """`value` as a finite float >= 0."""
    number = _float(value)
    if not 0 <= number < math.inf:
        raise errors.bad_field(name, f"{reprlib.repr(value)} is not a finite number >= 0")
    return number


def _float(value):
    """`value` as a float; NaN if it is none."""
    try:
        return math.nan if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def path(name, value):
    """`value`, the path of a file."""
    if not isinstance(value, (str, os.PathLike)):
        raise errors.bad_field(name, f"{reprlib.repr(value)} is not the path of a file")
    return value


def text(name, value, *, is_secret=False):
    """`value`, a str that can be a header. is_secret: no error shows it."""
    if not isinstance(value, str) or not value.isascii() or not value.isprintable():
        what = f"the {type(value).__name__} given" if is_secret else reprlib.repr(value)
        raise errors.bad_field(name, f"{what} is not a text of printable ASCII")
    return value


def address(name, value):
    """`value`, HOST:PORT, or what gRPC calls an address of another kind (unix:, dns:///)."""
    host, colon, port = text(name, value).rpartition(":")
    if value.startswith(_OTHER_ADDRESSES):
        return value
    if not (host and colon and port.isdecimal() and 1 <= int(port) <= _MOST_PORT) or "/" in host:
        raise errors.bad_field(name, f"{reprlib.repr(value)} is not HOST:PORT with a port in [1, {_MOST_PORT}]")
    return value


def is_list(field):
    """Whether this field of a message is a list."""
    return field.is_repeated if hasattr(field, "is_repeated") else field.label == _REPEATED


def choice_of(field):
    """The oneof of which this field is a member; None of a field that may be unset, for which protobuf makes one, too."""
    choice = field.containing_oneof
    return None if choice is None or choice.name == f"_{field.name}" else choice


def _no_such_field(descriptor, name):
    known = list(descriptor.fields_by_name)
    near = difflib.get_close_matches(name, known, 3)
    hint = f"; did you mean {' or '.join(near)}?" if near else f"; it has {', '.join(known)}" if known else ""
    return f"{descriptor.name} has no such field{hint}"


def _not_legal(field, value, place):
    is_many = is_list(field)
    if field.message_type is not None:  # messages may be given as dicts of their fields
        for at, part in enumerate(value if isinstance(value, (list, tuple)) else [value]):
            if isinstance(part, dict) and all(isinstance(name, str) for name in part):
                error = unfit(field.message_type._concrete_class, (), part, f"{place}[{at}]." if is_many else f"{place}.")
                if error is not None:
                    return error
    hint = "; it is flat, as an array's ravel() is" if is_many and field.message_type is None and _is_nested(value) else ""
    return errors.bad_field(place, f"{_told(value)} is not {_what(field, is_many)}{hint}")


def _is_nested(value):
    """Whether it is an array with rows, or a list of lists."""
    parts = value if isinstance(value, (list, tuple)) else ()
    return getattr(value, "ndim", 0) > 1 or any(getattr(part, "ndim", 0) or isinstance(part, (list, tuple)) for part in parts)


def _told(value):
    """`value` in an error. The text of a message is long, or empty, and does not tell its kind."""
    return f"one {value.DESCRIPTOR.name}" if isinstance(value, Message) else reprlib.repr(value)


def _what(field, is_many):
    if field.enum_type is not None:
        names = ", ".join(value.name for value in field.enum_type.values if not value.name.endswith("UNSPECIFIED"))
        return f"a list of some of {names}" if is_many else f"one of {names}"
    if field.cpp_type in _WHOLE:
        low, high = _WHOLE[field.cpp_type]
        one, many = f"a whole number in [{low}, {high}]", f"whole numbers in [{low}, {high}]"
    elif field.message_type is not None:
        name = field.message_type.name
        one, many = f"a {name}{_MADE_BY.get(name, '')}", f"{name} messages"
    else:
        one, many = {FieldDescriptor.CPPTYPE_BOOL: ("True or False", "bools"),
                     FieldDescriptor.CPPTYPE_STRING: ("a text", "texts")}.get(field.cpp_type, ("a number", "numbers"))
        if field.type == FieldDescriptor.TYPE_BYTES:
            one, many = "bytes", "bytes"
    return f"a list of {many}" if is_many else one
