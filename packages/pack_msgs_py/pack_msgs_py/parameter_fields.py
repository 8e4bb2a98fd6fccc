"""Parameters as data: one frozen dataclass per node, a description with each field.

A field is declared once, with its range or choices, and from that follow the declaration on the
node (:mod:`pack_msgs_py.ros.declare_parameters`), the validation and the table in the package's
README.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, Field, field, fields
from typing import Any

Value = bool | int | float | str


def parameter(
    default: Value,
    description: str,
    *,
    unit: str = '',
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
    read_only: bool = False,
) -> Any:  # noqa: ANN401 - stands where a dataclass default stands
    """A dataclass field that is a parameter of a node.

    Parameters
    ----------
    default : its value when nobody sets it; its type is the type of the parameter.
    description : what it does, a sentence for the node's description and the README.
    unit : of the value, as it is written behind a number; empty for none.
    low, high : least and largest value, both allowed; ``None`` for no limit.
    choices : the only values that a text may have; empty for any.
    read_only : it is read at the start, and ROS refuses to set it later.
    """
    metadata = {
        'description': description,
        'unit': unit,
        'low': low,
        'high': high,
        'choices': choices,
        'read_only': read_only,
    }
    return field(default=default, metadata=metadata)


def check_value(spec: Field[Any], value: Value) -> Value:
    """``value`` if it has the type, range and choice of ``spec``; else ``ValueError``."""
    name = spec.name
    kind: type[Any] = type(spec.default)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not kind:
        msg = f'parameter {name} is {value!r}; it must be of type {kind.__name__}'
        raise ValueError(msg)
    if isinstance(value, float) and not math.isfinite(value):
        msg = f'parameter {name} is {value}; it must be finite'
        raise ValueError(msg)
    low, high, unit = spec.metadata['low'], spec.metadata['high'], spec.metadata['unit']
    suffix = f' {unit}' if unit else ''
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        if low is not None and value < low:
            msg = f'parameter {name} is {value}; it must be at least {low:g}{suffix}'
            raise ValueError(msg)
        if high is not None and value > high:
            msg = f'parameter {name} is {value}; it must be at most {high:g}{suffix}'
            raise ValueError(msg)
    choices = spec.metadata['choices']
    if choices and value not in choices:
        msg = f'parameter {name} is {value!r}; it must be one of {", ".join(choices)}'
        raise ValueError(msg)
    return value


def parameter_fields(parameters: type) -> tuple[Field[Any], ...]:
    """The fields of a parameter dataclass, each checked to have a default."""
    declared = fields(parameters)
    for spec in declared:
        if spec.default is MISSING or 'description' not in spec.metadata:
            msg = f'{parameters.__name__}.{spec.name} must be declared with parameter()'
            raise TypeError(msg)
    return declared


def parameter_table(parameters: type) -> str:
    """Markdown table of a parameter dataclass for a README."""
    lines = ['| parameter | default | range | what it does |', '|---|---|---|---|']
    for spec in parameter_fields(parameters):
        meta = spec.metadata
        if meta['choices']:
            span = ', '.join(f'`{choice}`' if choice else '(empty)' for choice in meta['choices'])
        elif meta['low'] is None and meta['high'] is None:
            span = ''
        else:
            low = '' if meta['low'] is None else f'{meta["low"]:g}'
            high = '' if meta['high'] is None else f'{meta["high"]:g}'
            span = f'{low} to {high}' if high else f'from {low}'
        if meta['unit']:
            span = f'{span} {meta["unit"]}'.strip()
        default = str(spec.default).lower() if isinstance(spec.default, bool) else str(spec.default)
        default = f'`{default}`' if default else '(empty)'
        lines.append(f'| `{spec.name}` | {default} | {span} | {meta["description"]} |')
    return '\n'.join(lines) + '\n'
