"""Messages as YAML and CSV, and YAML values into messages, as ros2cli does it."""

from __future__ import annotations

import array
import sys
from dataclasses import dataclass
from typing import Any

import numpy
import yaml
from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractString,
    AbstractWString,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

from ros2cli_standin.interfaces import load_interface

_SEQUENCES = (list, tuple, array.array, numpy.ndarray)


@dataclass(frozen=True)
class Style:
    """What of a message is shown.

    ``truncate`` is the number of elements and characters after which a value ends in ``...``;
    ``None`` shows everything.
    """

    truncate: int | None = None
    no_arr: bool = False
    no_str: bool = False


def to_yaml(message: object, style: Style, *, flow_style: bool = False) -> str:
    """The message as a YAML document."""
    return yaml.dump(
        to_plain(message, style),
        allow_unicode=True,
        default_flow_style=flow_style,
        sort_keys=False,
        width=sys.maxsize,
    )


def to_plain(message: Any, style: Style) -> dict[str, object]:  # noqa: ANN401 - any message type
    """The message as dictionaries, lists and numbers, in the order of its fields."""
    return {
        name: _plain(getattr(message, name), style, field_type)
        for name, field_type in _fields(message)
    }


def _fields(message: Any) -> list[tuple[str, object]]:  # noqa: ANN401 - any message type
    return list(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))


def _plain(value: object, style: Style, field_type: object = None) -> object:
    if isinstance(value, bytes):
        return _shortened(value.decode('latin-1'), style)
    if isinstance(value, str):
        return f'<string length: <{len(value)}>>' if style.no_str else _shortened(value, style)
    if isinstance(value, _SEQUENCES):
        if style.no_arr and field_type is not None:
            return _array_summary(value, field_type)
        shown = [_plain(item, style) for item in value[: style.truncate]]
        return shown if len(shown) == len(value) else [*shown, '...']
    if isinstance(value, numpy.generic):
        return value.item()
    if isinstance(value, (bool, int, float)):
        return value
    return to_plain(value, style)


def _shortened(text: str, style: Style) -> str:
    if style.truncate is None or len(text) <= style.truncate:
        return text
    return text[: style.truncate] + '...'


def _array_summary(value: Any, field_type: Any) -> str:  # noqa: ANN401 - any field
    name = _type_name(field_type.value_type)
    if isinstance(field_type, Array):
        return f'<array type: {name}[{field_type.size}]>'
    if isinstance(field_type, BoundedSequence):
        return f'<sequence type: {name}[{field_type.maximum_size}], length: {len(value)}>'
    return f'<sequence type: {name}, length: {len(value)}>'


def _type_name(value_type: object) -> str:
    if isinstance(value_type, BasicType):
        return str(value_type.typename)
    if isinstance(value_type, AbstractString):
        return 'string'
    if isinstance(value_type, AbstractWString):
        return 'wstring'
    if isinstance(value_type, NamespacedType):
        return '/'.join(value_type.namespaced_name())
    return 'unknown'


def to_csv(message: object, style: Style) -> str:
    """All values of the message, nested ones too, separated by commas."""

    def flat(value: object) -> str:
        if isinstance(value, dict):
            return ','.join(flat(field) for field in value.values())
        if isinstance(value, list):
            return ','.join(flat(element) for element in value)
        return str(value)

    return flat(to_plain(message, style))


def set_fields(message: Any, values: object) -> None:  # noqa: ANN401 - any message type
    """Fill a message from plain values.

    Raises
    ------
    AttributeError
        A name is not a field of the message.
    TypeError
        A value does not fit its field.
    """
    if not isinstance(values, dict):
        msg = f"Value '{values}' is expected to be a dictionary but is a {type(values).__name__}"
        raise TypeError(msg)
    types = dict(_fields(message))
    for name, given in values.items():
        current = getattr(message, name)
        if isinstance(types[name], NamespacedType):
            set_fields(current, given)
            continue
        setattr(message, name, _fitting(current, types[name], given))


def _fitting(current: object, field_type: Any, given: Any) -> object:  # noqa: ANN401 - any field
    """`given` as a value for a field that now holds `current`."""
    if isinstance(current, numpy.ndarray):
        return numpy.array(given, dtype=current.dtype)
    if isinstance(field_type, AbstractNestedType):
        item_type = field_type.value_type
        if isinstance(item_type, NamespacedType):
            items = []
            for values in given:
                item = load_interface('/'.join(item_type.namespaced_name()))()
                set_fields(item, values)
                items.append(item)
            return items
        return list(given)
    if isinstance(current, (bool, int, float, str)) and not isinstance(given, type(current)):
        return type(current)(given)
    return given
