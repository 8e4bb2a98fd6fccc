"""Declare a parameter dataclass on a node, and refuse what it does not know."""

from __future__ import annotations

from dataclasses import Field
from typing import Any, TypeVar, cast

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from pack_msgs_py.parameter_fields import Value, check_value, parameter_fields

T = TypeVar('T')

#: Parameters that rclpy itself puts on every node.
_BUILT_IN = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


def declare_parameters(node: Node, parameters: type[T]) -> T:
    """Declare every field of ``parameters`` on ``node`` and return the checked values.

    Raises
    ------
    ValueError
        A value has the wrong type, range or choice, or an override names no parameter (a misspelt
        override would otherwise be silently ignored by rclpy).
    """
    specs = parameter_fields(parameters)
    known = {spec.name for spec in specs}
    overrides: dict[str, Parameter] = node._parameter_overrides  # noqa: SLF001 - no public reader
    for name in overrides:
        if name not in known and not name.startswith(_BUILT_IN):
            names = ', '.join(sorted(known))
            msg = f'unknown parameter {name!r}: node {node.get_name()} has {names}'
            raise ValueError(msg)
    values = {}
    for spec in specs:
        given = overrides.get(spec.name)
        default = cast(Value, spec.default)
        value = check_value(spec, default if given is None else given.value)
        node.declare_parameter(spec.name, value, _descriptor(spec), ignore_override=True)
        values[spec.name] = value
    return parameters(**values)


def _descriptor(spec: Field[Any]) -> ParameterDescriptor:
    """The field's description and range as ROS keeps them."""
    meta = spec.metadata
    text = meta['description'] + (f' [{meta["unit"]}]' if meta['unit'] else '')
    descriptor = ParameterDescriptor(
        name=spec.name,
        description=text,
        read_only=meta['read_only'],
        additional_constraints=', '.join(meta['choices']),
    )
    low, high = meta['low'], meta['high']
    if low is None and high is None:
        return descriptor
    if isinstance(spec.default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(
                from_value=-1e308 if low is None else float(low),
                to_value=1e308 if high is None else float(high),
            )
        ]
    else:
        descriptor.integer_range = [
            IntegerRange(
                from_value=-(2**62) if low is None else int(low),
                to_value=2**62 if high is None else int(high),
            )
        ]
    return descriptor
