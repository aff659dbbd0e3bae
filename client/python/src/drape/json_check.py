"""Errors of a JSON text by path, before protobuf's parser, whose messages name neither the whole path nor the legal
values. The same checks and words as those of `drape run` (client/src/scenes/json_check.cpp)."""

from __future__ import annotations

import json
import math
import numbers
import sys

from google.protobuf.descriptor import FieldDescriptor

from . import checks, errors

_MOST_SHOWN = 40
_MOST = {FieldDescriptor.CPPTYPE_UINT32: 2**32 - 1, FieldDescriptor.CPPTYPE_UINT64: 2**64 - 1}
_NO_NUMBERS = ("NaN", "Infinity", "-Infinity")  # which JSON has as texts alone


def parse(text):
    """What a strict JSON text holds: without repeated names and numbers that JSON has not."""
    try:
        return json.loads(text, object_pairs_hook=_unique, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise errors.InvalidArgument(str(error), reason="BAD_JSON") from error
    except RecursionError as error:
        raise errors.InvalidArgument("the values are nested too deep", reason="BAD_JSON") from error


def check(value, descriptor, path="", more=None):
    """Raises for what a message of this kind cannot be: unknown fields, kinds of values, lists inside lists, ranges of whole
    numbers, names of enum values, more than one member of a choice. more: name of a message -> the descriptor of fields that
    it may have besides its own. None stands for "not set"."""
    if value is None:
        return
    if not isinstance(value, dict):
        raise errors.bad_field(path or descriptor.name, f"must be an object{_got(value)}")
    of_more = (more or {}).get(descriptor.name)
    fields = {**descriptor.fields_by_name, **({} if of_more is None else of_more.fields_by_name)}
    by_any_name = {**descriptor.fields_by_camelcase_name, **fields}
    chosen = {}
    for name, part in value.items():
        at = f"{path}.{name}" if path else name
        if name not in by_any_name:
            raise errors.bad_field(at, _unknown(fields, name))
        if part is None:
            continue
        field = by_any_name[name]
        _check_field(part, field, at, more)
        choice = checks.choice_of(field)
        if choice is None:
            continue
        other = chosen.setdefault(choice.name, name)
        if other != name:
            raise errors.bad_field(at, f"only one of {other} and {name} may be given")


def without_nulls(value):
    """`value` without the names that stand for nothing."""
    if isinstance(value, dict):
        return {name: without_nulls(part) for name, part in value.items() if part is not None}
    return [without_nulls(part) for part in value] if isinstance(value, list) else value


def _unique(pairs):
    found = {}
    for name, value in pairs:
        if name in found:
            raise errors.bad_field(name, "is given twice in one object")
        found[name] = value
    return found


def _no_constant(name):
    raise errors.InvalidArgument(f'{name} is no number of JSON; as a text it is one: "{name}"', reason="BAD_JSON")


def _check_field(value, field, path, more):
    if not checks.is_list(field):
        _check_value(value, field, path, more)
        return
    if not isinstance(value, list):
        raise errors.bad_field(path, f"must be a list{_got(value)}")
    for k, part in enumerate(value):
        _check_value(part, field, f"{path}[{k}]", more)


def _check_value(value, field, path, more):
    if isinstance(value, list):
        raise errors.bad_field(path, ("a list inside a list; lists of vectors are flat" if checks.is_list(field)
                                      else "must be a single value") + _got(value))
    if value is None and checks.is_list(field):
        raise errors.bad_field(path, "null stands for nothing, and a list has no empty places")
    kind = field.cpp_type
    if kind == FieldDescriptor.CPPTYPE_MESSAGE:
        check(value, field.message_type, path, more)
    elif kind == FieldDescriptor.CPPTYPE_ENUM:
        if not isinstance(value, str) or value not in field.enum_type.values_by_name:
            legal = ", ".join(known.name for known in field.enum_type.values if known.number)
            raise errors.bad_field(path, f"must be one of {legal}{_got(value)}")
    elif kind in _MOST:
        most = _MOST[kind]
        if not _is_number(value) or not 0 <= value <= most or value != math.floor(value):
            top = str(most) if most < 2**53 else "2^64-1"
            raise errors.bad_field(path, f"must be a whole number from 0 to {top}{_got(value)}")
    elif kind in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT):
        if not _is_number(value) and not (isinstance(value, str) and value in _NO_NUMBERS):
            raise errors.bad_field(path, f"must be a number{_got(value)}")
    elif kind == FieldDescriptor.CPPTYPE_BOOL:
        if not isinstance(value, bool):
            raise errors.bad_field(path, f"must be true or false{_got(value)}")
    elif not isinstance(value, str):
        raise errors.bad_field(path, f"must be a string{_got(value)}")


def _is_number(value):
    """Whether it is one that a double can hold, about."""
    return (isinstance(value, numbers.Real) and not isinstance(value, bool)
            and (isinstance(value, float) or abs(value) <= sys.float_info.max))


def _got(value):
    try:
        text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    except (TypeError, ValueError):  # of the settings of a program, which are no JSON
        text = repr(value)
    return f", got {text if len(text) <= _MOST_SHOWN else text[:_MOST_SHOWN] + '...'}"


def _unknown(fields, name):
    for known in fields:
        if _folded(known) == _folded(name):
            return f"unknown field; did you mean {known}?"
    return f"unknown field; known here: {', '.join(fields)}"


def _folded(name):
    """Without case and underscores."""
    return name.replace("_", "").lower()
