"""Numpy arrays in and out of requests: which cloths are meant, and the columns of controls."""

from __future__ import annotations

import reprlib

import numpy as np

from . import checks, errors

_DOUBLE, _FIXED64 = 1, 6  # numbers of google.protobuf.FieldDescriptor.Type
_DTYPES = {_DOUBLE: np.dtype("<f8"), _FIXED64: np.dtype("<u8")}
_MOST_INDEX = 2**32 - 1  # of elements of a cloth, in the protocol
_RESTARTS = ("resets", "loads")  # tables after which earlier controls of a cloth do not count


def numbers(name, value, dtype=None):
    """`value` as an array, of its own type or of `dtype`."""
    try:
        array = np.asarray(value)
        if array.dtype.kind in "biuf":
            return array if dtype is None else array.astype(dtype, copy=False)
    except (ValueError, TypeError, OverflowError):
        pass
    raise errors.bad_field(name, f"numbers are needed, in lists of equal lengths, got {reprlib.repr(value)}")


def last_length(name, value):
    """Of its last dimension; of a number 1."""
    shape = numbers(name, value).shape
    return shape[-1] if shape else 1


def rows_of(ids, count):
    """The rows that `ids` means in a batch of `count` cloths: None (every one) as None; indices, which may count from
    the end, and slices as indices; a mask as the indices of its True. Nothing selected is an empty array, never
    everything."""
    if ids is None:
        return None
    if isinstance(ids, slice):
        try:
            return np.arange(count)[ids]
        except (TypeError, ValueError) as error:
            raise errors.bad_field("ids", f"{reprlib.repr(ids)}: {error}") from None
    asked = numbers("ids", ids)
    if asked.dtype == bool:
        if asked.shape != (count,):
            raise errors.bad_field("ids", f"a mask has the shape ({count},), got {asked.shape}")
        return np.flatnonzero(asked)
    asked = np.atleast_1d(asked)
    if asked.size == 0:
        return np.empty(0, dtype=np.intp)
    if asked.ndim != 1 or not np.issubdtype(asked.dtype, np.integer):
        raise errors.bad_field("ids", f"None, a list of indices, a slice, or a mask; got {asked.dtype} of shape {asked.shape}")
    rows = np.where(asked < 0, asked + count, asked).astype(np.intp)
    if rows.min() < 0 or rows.max() >= count:
        bad = asked[(rows < 0) | (rows >= count)][0]
        raise errors.bad_field("ids", f"index {bad} is not one of the {count} cloths")
    named, times = np.unique(rows, return_counts=True)
    if len(named) != len(rows):
        raise errors.bad_field("ids", f"an index is given twice: {named[times > 1][0]}")
    return rows


def row_of(row, count):
    """The one row that `row` means, which may count from the end."""
    at = checks.whole("row", row, -count, count - 1)
    return at + count if at < 0 else at


def shaped(name, value, shape):
    """`value` as float64, spread to `shape`. Raises InvalidArgument with both shapes."""
    return spread(name, numbers(name, value, np.float64), shape)


def spread(name, array, shape):
    """`array`, of its own type, spread to `shape`."""
    try:
        return np.broadcast_to(array, shape)
    except ValueError as error:
        raise errors.bad_field(name, f"has the shape {array.shape}, which does not fit {tuple(shape)}") from error


def integers(name, value):
    """`value` as an array of whole numbers, of its own type."""
    array = numbers(name, value)
    if array.size and array.dtype.kind not in "iu":
        raise errors.bad_field(name, f"whole numbers are needed, got {array.dtype}")
    return array


def _naturals(name, value):
    array = integers(name, value)
    if array.size and array.min() < 0:
        raise errors.bad_field(name, f"{array.min()} is not >= 0")
    return array


def whole(name, value, shape):
    """`value` as indices of elements of a cloth, spread to `shape`."""
    array = _naturals(name, value)
    if array.size and array.max() > _MOST_INDEX:
        raise errors.bad_field(name, f"{array.max()} is not a whole number in [0, {_MOST_INDEX}]")
    return spread(name, array.astype(np.int64), shape)


def distinct(name, elements, least=0):
    """`elements`, of which none comes twice in a row (the last dimension); those below `least` are none."""
    if elements.ndim and elements.shape[-1] > 1:
        of_all = elements[0] if elements.ndim == 2 and elements.strides[0] == 0 else elements
        in_order = np.sort(of_all, -1)
        twice = in_order[..., 1:][(in_order[..., 1:] == in_order[..., :-1]) & (in_order[..., 1:] >= least)]
        if twice.size:
            raise errors.bad_field(name, f"{twice[0]} is given twice" + (" for one cloth" if elements.ndim > 1 else ""))
    return elements


def cloth_ids(name, value):
    """`value` as uint64[k], names in the protocol."""
    if isinstance(value, (list, tuple)):  # numpy makes float64 of some ids that are above 2^63 and some below
        value = np.array([checks.whole(name, cloth, 0, 2**64 - 1) for cloth in value], np.uint64)
    array = np.atleast_1d(_naturals(name, value)).astype(np.uint64)
    return spread(name, array, (array.size,))


def indices(name, value, count):
    """`value` as indices in a batch of `count` cloths, which may come more than once, and count from the end."""
    array = integers(name, value).astype(np.intp)
    is_bad = (array < -count) | (array >= count)
    if is_bad.any():
        raise errors.bad_field(name, f"index {array[is_bad].flat[0]} is not one of the {count} cloths")
    return array


def _varint(value):
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def fill(message, columns):
    """Appends arrays to the lists of `message` of those names. Lists of doubles and ids are copied as a block: in the
    wire format they are the array's own bytes."""
    parts = []
    fields = message.DESCRIPTOR.fields_by_name
    for name, array in columns.items():
        field = fields[name]
        dtype = _DTYPES.get(field.type)
        if dtype is None:
            getattr(message, name).extend(np.asarray(array).ravel().tolist())
            continue
        data = np.ascontiguousarray(array, dtype=dtype).tobytes()
        parts += [_varint(field.number << 3 | 2), _varint(len(data)), data]
    message.MergeFromString(b"".join(parts))


class Pending:
    """Controls that wait for the next step of their cloths: per table of StepRequest, rows with equal columns. Of
    `loads` a kind is the name that they go on from, of `resets` the columns: a request has one of each."""

    def __init__(self):
        self._tables = {}  # (table, kind) -> blocks

    def add(self, table, rows, columns, kind=None):
        """`rows`: [r] indices of cloths; `columns`: name -> [r, ...]."""
        self._tables.setdefault((table, kind), []).append((rows, columns))

    def add_load(self, name, rows, columns):
        """One name for all that wait."""
        for other in _kinds_of("loads", self._tables):
            if other != name:
                raise errors.bad_field("to", f"{name!r}, but cloths that wait for their next step go on from {other!r}: "
                                             "step them first")
        self.add("loads", rows, columns, name)

    def add_reset(self, rows, columns):
        """The same columns for all that wait."""
        kind = frozenset(columns)
        if _kinds_of("resets", self._tables) - {kind}:
            raise errors.bad_field("transforms", "cloths that wait for their next step start with others of transforms and "
                                                 "overrides: step them first")
        self.add("resets", rows, columns, kind)

    def take(self, request, ids, rows, count):
        """Moves the controls of `rows` (None: all) into `request`; those of other cloths go on waiting. What it moved, for
        `check_alike` and `put_back`."""
        taken = self._split(rows, count)
        for (table, kind), of, columns in taken:
            fill(getattr(request, table), {"cloth_ids": ids[of], **columns})
            if table == "loads":
                request.loads.name = kind
        return taken

    def put_back(self, taken):
        """What was taken waits again, before what has come since; not of cloths that are to start again since."""
        since, self._tables = self._tables, {}
        again = [of for (table, _), blocks in since.items() if table in _RESTARTS for of, _ in blocks]
        again = np.concatenate(again) if again else np.empty(0, np.intp)
        for (table, kind), of, columns in taken:
            kept = ~np.isin(of, again)
            if kept.any():
                self.add(table, of[kept], {name: column[kept] for name, column in columns.items()}, kind)
        for key, blocks in since.items():
            self._tables.setdefault(key, []).extend(blocks)

    def drop(self, rows, count):
        """Forgets the controls of `rows` (None: all)."""
        self._split(rows, count)

    def renumber(self, kept, count):
        """Of `count` cloths only `kept` (ascending) are left, as rows 0, 1, ...; none of the others has controls here."""
        place = np.zeros(count, np.intp)
        place[kept] = np.arange(len(kept))
        self._tables = {key: [(place[of], columns) for of, columns in blocks] for key, blocks in self._tables.items()}

    def _split(self, rows, count):
        """The blocks (key, rows, columns) of `rows`; the others stay here."""
        if not self._tables:
            return []
        chosen = np.full(count, rows is None)
        if rows is not None:
            chosen[rows] = True
        now, waiting = [], {}
        for key, blocks in self._tables.items():
            for of, columns in blocks:
                mask = chosen[of]
                if mask.all():
                    now.append((key, of, columns))
                    continue
                waiting.setdefault(key, []).append((of[~mask], {name: c[~mask] for name, c in columns.items()}))
                if mask.any():
                    now.append((key, of[mask], {name: c[mask] for name, c in columns.items()}))
        self._tables = waiting
        return now


def check_alike(taken):
    """Raises if these blocks of one request do not go together."""
    keys = [key for key, _, _ in taken]
    if len(names := _kinds_of("loads", keys)) > 1:
        raise errors.bad_field("to", f"cloths of one step go on from one name, got {sorted(names)}")
    if len(_kinds_of("resets", keys)) > 1:
        raise errors.bad_field("transforms", "cloths of one step start again all of them with transforms, or overrides, or "
                                             "none: step them one after the other, or give each the same of them")


def _kinds_of(table, keys):
    return {kind for of, kind in keys if of == table}
