"""Plug-ins of other people: values found by where they stand, or by the name they were given.

Where: ``module:attribute`` for what Python can import, ``folder/file.py:attribute`` for a file.
Name: an entry point of an installed distribution, see
https://packaging.python.org/en/latest/specifications/entry-points/.
"""

from __future__ import annotations

import hashlib
import importlib
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
        msg = f'{where!r}: {place} cannot be loaded: {said(error, place)}'
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
    """The module in the file at ``path``, loaded once for each content that it has."""
    path = path.expanduser().resolve()
    content = path.read_bytes()
    name = f'plug_in_of{path.with_suffix("")}_{_digest(content)}'.replace('/', '_')
    if name in sys.modules:
        return sys.modules[name]
    folder = str(path.parent)
    if folder not in sys.path:
        # it may import what lies beside it; last, so that this hides nothing
        sys.path.append(folder)
    module = ModuleType(name)
    module.__file__ = str(path)
    # Known before it runs, as dataclasses in it look their own module up.
    sys.modules[name] = module
    try:
        # Not by a loader: that takes the compiled code of another content of the same second.
        exec(compile(content, str(path), 'exec', dont_inherit=True), vars(module))
    except BaseException:
        del sys.modules[name]
        raise
    return module


def content_digest(where: str) -> str:
    """Changes with the content of the file that ``where`` is in; empty when that is no file."""
    place = where.rpartition(':')[0]
    if not place.endswith('.py'):
        return ''
    try:
        return _digest(Path(place).expanduser().read_bytes())
    except OSError as error:
        msg = f'{where!r}: {place} cannot be read: {error.strerror}'
        raise PlugInError(msg) from None


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]


def absolute_place(where: str) -> str:
    """``where`` with an absolute path when it is in a file, for processes that work elsewhere."""
    place, _, attribute = where.rpartition(':')
    return f'{Path(place).expanduser().resolve()}:{attribute}' if place.endswith('.py') else where


def said(error: BaseException, file: str) -> str:
    """``error`` in a line, with the last line of ``file`` that it came through."""
    path, line, trace = str(Path(file).expanduser().resolve()), 0, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == path:
            line = trace.tb_lineno
        trace = trace.tb_next
    text = f'{type(error).__name__}: {error}'
    return f'{text} (line {line})' if line else text


def plug_ins_by_name(group: str) -> dict[str, str]:
    """What installed distributions offer as entry points of ``group``: name to where it stands."""
    return {point.name: point.value for point in entry_points(group=group)}
