"""Numpy arrays in and out of requests: which cloths are meant, and the columns of controls."""

from __future__ import annotations

import numpy as np

from . import errors

_DOUBLE, _FIXED64 = 1, 6  # numbers of google.protobuf.FieldDescriptor.Type
_DTYPES = {_DOUBLE: np.dtype("<f8"), _FIXED64: np.dtype("<u8")}


def rows_of(ids, count):
    """The rows that `ids` means in a batch of `count` cloths: None (every one) as None; indices, which may count from
    the end, as they are; a mask as the indices of its True. Nothing selected is an empty array, never everything."""
    if ids is None:
        return None
    asked = np.asarray(ids)
    if asked.dtype == bool:
        if asked.shape != (count,):
            raise errors.bad_field("ids", f"a mask has the shape ({count},), got {asked.shape}")
        return np.flatnonzero(asked)
    asked = np.atleast_1d(asked)
    if asked.size == 0:
        return np.empty(0, dtype=np.intp)
    if asked.ndim != 1 or not np.issubdtype(asked.dtype, np.integer):
        raise errors.bad_field("ids", f"None, a list of indices, or a mask; got {asked.dtype} of shape {asked.shape}")
    rows = np.where(asked < 0, asked + count, asked).astype(np.intp)
    if rows.min() < 0 or rows.max() >= count:
        bad = asked[(rows < 0) | (rows >= count)][0]
        raise errors.bad_field("ids", f"index {bad} is not one of the {count} cloths")
    if len(np.unique(rows)) != len(rows):
        raise errors.bad_field("ids", "an index is given twice")
    return rows


def shaped(name, value, shape):
    """`value` as finite float64, spread to `shape`. Raises InvalidArgument with both shapes."""
    try:
        array = np.asarray(value, dtype=np.float64)
        return np.broadcast_to(array, shape)
    except (ValueError, TypeError) as error:
        got = getattr(value, "shape", None) or np.shape(value)
        raise errors.bad_field(name, f"has the shape {got}, which does not fit {tuple(shape)}") from error


def spread(name, array, shape):
    """`array`, of its own type, spread to `shape`."""
    try:
        return np.broadcast_to(array, shape)
    except ValueError as error:
        raise errors.bad_field(name, f"has the shape {array.shape}, which does not fit {tuple(shape)}") from error


def whole(name, value, shape):
    """`value` as indices >= 0, spread to `shape`."""
    array = np.asarray(value)
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise errors.bad_field(name, f"whole numbers are needed, got {array.dtype}")
    if array.size and array.min() < 0:
        raise errors.bad_field(name, f"{array.min()} is not >= 0")
    try:
        return np.broadcast_to(array.astype(np.int64), shape)
    except ValueError as error:
        raise errors.bad_field(name, f"has the shape {array.shape}, which does not fit {tuple(shape)}") from error


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
    """Controls that wait for the next step of their cloths: per table of StepRequest, rows with equal columns."""

    def __init__(self):
        self._tables = {}

    def add(self, table, rows, columns):
        """`rows`: [r] indices of cloths; `columns`: name -> [r, ...]."""
        self._tables.setdefault(table, []).append((rows, columns))

    def take(self, request, ids, rows, count):
        """Moves the controls of `rows` (None: all) into `request`; those of other cloths go on waiting."""
        for table, of, columns in self._split(rows, count):
            fill(getattr(request, table), {"cloth_ids": ids[of], **columns})

    def drop(self, rows, count):
        """Forgets the controls of `rows` (None: all)."""
        self._split(rows, count)

    def _split(self, rows, count):
        """The blocks (table, rows, columns) of `rows`; the others stay here."""
        if not self._tables:
            return []
        chosen = np.full(count, rows is None)
        if rows is not None:
            chosen[rows] = True
        now, waiting = [], {}
        for table, blocks in self._tables.items():
            for of, columns in blocks:
                mask = chosen[of]
                if mask.all():
                    now.append((table, of, columns))
                    continue
                waiting.setdefault(table, []).append((of[~mask], {name: c[~mask] for name, c in columns.items()}))
                if mask.any():
                    now.append((table, of[mask], {name: c[mask] for name, c in columns.items()}))
        self._tables = waiting
        return now
