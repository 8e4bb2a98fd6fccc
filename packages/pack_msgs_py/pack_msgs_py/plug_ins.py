"""Plug-ins of other people: values found by where they stand, or by the name they were given.

Where: ``module:attribute`` for what Python can import, ``folder/file.py:attribute`` for a file.
Name: an entry point of an installed distribution, see
https://packaging.python.org/en/latest/specifications/entry-points/.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType


class PlugInError(ValueError):
    """A plug-in cannot be had; the message names it and says what to do."""


def load_plug_in(where: str) -> object:
    """The value at ``where``, which is ``module:attribute`` or ``folder/file.py:attribute``.

    Raises
    ------
    PlugInError
        ``where`` is neither, or the module or the attribute does not exist or fails to load.
    """
    place, _, attribute = where.rpartition(':')
    if not place or not attribute:
        msg = f'{where!r} must be module:attribute, such as my_package.my_module:thing'
        raise PlugInError(msg)
    try:
        module = _module_of_file(Path(place)) if place.endswith('.py') else _module_called(place)
    except Exception as error:
        msg = f'{where!r}: {place} cannot be loaded: {type(error).__name__}: {error}'
        raise PlugInError(msg) from error
    try:
        return getattr(module, attribute)
    except AttributeError:
        names = ', '.join(name for name in vars(module) if not name.startswith('_'))
        msg = f'{where!r}: {place} has no {attribute!r}; it has {names or "nothing"}'
        raise PlugInError(msg) from None


def _module_called(name: str) -> ModuleType:
    return importlib.import_module(name)


def _module_of_file(path: Path) -> ModuleType:
    """The module in the file at ``path``, loaded once however often it is asked for."""
    path = path.expanduser().resolve()
    name = f'plug_in_of{path.with_suffix("")}'.replace('/', '_')
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        msg = f'{path} is not a file of Python'
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    # Known before it runs, as dataclasses in it look their own module up.
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def plug_ins_by_name(group: str) -> dict[str, str]:
    """What installed distributions offer as entry points of ``group``: name to where it stands."""
    return {point.name: point.value for point in entry_points(group=group)}
