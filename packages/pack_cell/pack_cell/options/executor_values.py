"""Parameters of the executor and its arm on the command line of ``cell run``."""

from __future__ import annotations

from dataclasses import Field
from typing import Any

from arm_executor.arms.registry import ARMS
from arm_executor.parameters import ExecutorParameters
from pack_cell.options.parsers import BadValue, typed_value
from pack_msgs_py.parameter_fields import Value, check_value, parameter_fields

#: Parameters that follow from other options of ``cell run``.
OWN_OPTION = (
    'arm', 'robot', 'layout', 'bin_type', 'destinations', 'open_bins', 'profile', 'orientations',
    'size_sigmas', 'clearance_mm', 'resolution_mm', 'speed', 'tilt_time', 'state_dir',
)  # fmt: skip


def executor_specs() -> dict[str, Field[Any]]:
    """Parameters of the node `arm_executor` by name, those of the arms behind the arm's name."""
    specs = {
        spec.name: spec
        for spec in parameter_fields(ExecutorParameters)
        if spec.name not in OWN_OPTION
    }
    for kind in ARMS:
        if kind.parameters is not None:
            specs |= {
                f'{kind.name}.{spec.name}': spec for spec in parameter_fields(kind.parameters)
            }
    return specs


def executor_value(text: str) -> tuple[str, Value]:
    """Read ``NAME=VALUE``, a checked parameter of the node `arm_executor` or of its arm."""
    name, equals, written = text.partition('=')
    specs = executor_specs()
    if not equals or name not in specs:
        msg = f'{text!r} is not NAME=VALUE with one of {", ".join(specs)}'
        raise BadValue(msg)
    try:
        return name, check_value(specs[name], typed_value(type(specs[name].default), written))
    except ValueError as error:
        raise BadValue(str(error)) from None
