"""Parameters of the planner on the command line of ``cell run``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pack_cell.options.parsers import BadValue, typed_value
from pack_msgs_py.parameter_fields import Value, check_value, parameter_fields
from pack_msgs_py.plug_ins import absolute_place
from pack_planner.algorithms import find_algorithm
from pack_planner.algorithms.tuned_tables import read_table
from pack_planner.parameters import PlannerParameters, settings

#: Parameters that follow from other options of ``cell run``.
OWN_OPTION = (
    'algorithm', 'profile', 'orientations', 'size_sigmas', 'clearance_mm', 'resolution_mm',
    'max_payload_kg', 'look_ahead', 'deadline_s', 'tuned',
)  # fmt: skip


def algorithm_name(text: str) -> str:
    """Read the name of an algorithm; of ``FILE.py:FUNCTION`` the path becomes absolute.

    The planner is another process, which may work elsewhere.
    """
    try:
        find_algorithm(text)
    except ValueError as error:
        raise BadValue(str(error)) from None
    return absolute_place(text)


def tuned_file(text: str) -> Path | None:
    """Read the path of a file with tuned weights and make it absolute; the empty text is none."""
    if not text:
        return None
    read_table(text)
    return Path(text).expanduser().resolve()


def planner_value(text: str) -> tuple[str, Value]:
    """Read ``NAME=VALUE``, a checked parameter of the node `planner`."""
    name, equals, written = text.partition('=')
    specs = {spec.name: spec for spec in parameter_fields(PlannerParameters)}
    known = [parameter for parameter in specs if parameter not in OWN_OPTION]
    if not equals or name not in known:
        msg = f'{text!r} is not NAME=VALUE with one of {", ".join(known)}'
        raise BadValue(msg)
    try:
        value = check_value(specs[name], typed_value(type(specs[name].default), written))
        changed: dict[str, Any] = {name: value}
        settings(replace(PlannerParameters(), **changed))
    except ValueError as error:
        raise BadValue(str(error)) from None
    return name, value
