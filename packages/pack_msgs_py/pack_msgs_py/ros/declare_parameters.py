"""Declare a parameter dataclass on a node, and refuse what it does not know."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import Field
from typing import Any, TypeVar, cast

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from pack_msgs_py.parameter_fields import Value, check_value, parameter_fields

T = TypeVar('T')

#: Parameters that rclpy itself puts on every node.
_BUILT_IN = ('use_sim_time', 'start_type_description_service')


def declare_parameters(
    node: Node, parameters: type[T], *, prefix: str = '', others: Iterable[str] = ()
) -> T:
    """Declare every field of ``parameters`` on ``node`` and return the checked values.

    Parameters
    ----------
    node, parameters : which node, and the dataclass of its parameters.
    prefix : stands before every name.
    others : how names begin that are declared elsewhere.

    Raises
    ------
    ValueError
        A value has the wrong type, range or choice, or an override names no parameter (a misspelt
        override would otherwise be silently ignored by rclpy).
    """
    specs = parameter_fields(parameters)
    known = {f'{prefix}{spec.name}' for spec in specs}
    elsewhere = (*_BUILT_IN, *others)
    overrides = _overrides(node)
    for name in overrides:
        if name.startswith('qos_overrides.'):
            msg = (
                f'parameter {name!r} is not taken: nodes of the cell agree on the quality of '
                'service of every topic, which docs/interfaces.md lists'
            )
            raise ValueError(msg)
        asked = name.startswith(prefix) and not name.startswith(elsewhere)
        if asked and name not in known and not node.has_parameter(name):
            names = ', '.join(sorted(known))
            msg = f'unknown parameter {name!r}: node {node.get_name()} has {names}'
            raise ValueError(msg)
    return parameters(**{spec.name: declare_field(node, spec, prefix) for spec in specs})


def declare_field(node: Node, spec: Field[Any], prefix: str = '') -> Value:
    """Declare one field of a dataclass of parameters on ``node``; returns its checked value."""
    name = f'{prefix}{spec.name}'
    given = _overrides(node).get(name)
    value = check_value(spec, cast(Value, spec.default) if given is None else given.value)
    node.declare_parameter(name, value, _descriptor(spec, name), ignore_override=True)
    return value


def given_value(node: Node, name: str, default: Value) -> Value:
    """What ``node`` was given for a parameter that is not declared yet; else ``default``."""
    given = _overrides(node).get(name)
    return default if given is None else given.value


def _overrides(node: Node) -> dict[str, Parameter]:
    overrides: dict[str, Parameter] = node._parameter_overrides  # noqa: SLF001 - no public reader
    return overrides


def _descriptor(spec: Field[Any], name: str) -> ParameterDescriptor:
    """The field's description and range as ROS keeps them."""
    meta = spec.metadata
    text = meta['description'] + (f' [{meta["unit"]}]' if meta['unit'] else '')
    descriptor = ParameterDescriptor(
        name=name,
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
