"""What a run was told: its options, as the parameter files of its nodes hold them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from pack_cell.options.declaration import declared_options
from pack_cell.options.run_options import RunOptions

#: Where in the folder of a run the files lie that it was begun with.
_KEPT = 'config/kept/'


def run_settings(folder: Path) -> dict[str, str]:
    """The options of the run in ``folder`` that nodes were given, by name, in their order.

    What is not to be read is left out: a run of an older release knows fewer options.
    """
    parameters = dict(_parameters(folder / 'config'))
    settings = {}
    for named in declared_options(RunOptions):
        for parameter in named.declaration.parameters:
            if parameter in parameters:
                settings[named.argument.replace('_', ' ')] = _text(parameters[parameter], folder)
                break
    return settings


def _parameters(config: Path) -> Iterator[tuple[str, Any]]:
    """Every parameter as ``node.parameter`` with its value."""
    for path in sorted(config.glob('*.param.yaml')):
        try:
            content = yaml.safe_load(path.read_text(encoding='utf-8'))
            values = content['/**']['ros__parameters']
            node = path.name.removesuffix('.param.yaml')
            yield from ((f'{node}.{name}', value) for name, value in values.items())
        except (OSError, UnicodeDecodeError, yaml.YAMLError, AttributeError, KeyError, TypeError):
            continue


def _text(value: Any, folder: Path) -> str:  # noqa: ANN401 - whatever a parameter holds
    if isinstance(value, bool):
        return 'on' if value else 'off'
    if isinstance(value, str) and _KEPT in value:
        return _kept_file(folder / value[value.index(_KEPT) :])
    return f'{value:g}' if isinstance(value, float) else str(value)


def _kept_file(path: Path) -> str:
    """A file of which each run has a copy, by its name and what is in it: the same in all of them.

    Also where the folder of the run was moved since.
    """
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return path.name
    return f'{path.name} ({digest[:6]})'
