"""Algorithms of a file of one's own, named ``FILE.py:FUNCTION``."""

from __future__ import annotations

import hashlib
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

from pack_planner.algorithms.registry import SPECS, AlgorithmSpec, check_function, told

_NAME = re.compile(r'^(?P<file>.+\.py):(?P<function>\w+)$')

_loaded: dict[str, AlgorithmSpec] = {}


def absolute_name(name: str) -> str:
    """``name`` with an absolute path when it is ``FILE.py:FUNCTION``, else as it is.

    Processes that work elsewhere then find the file as well.
    """
    match = _NAME.match(name)
    if match is None:
        return name
    return f'{Path(match["file"]).expanduser().absolute()}:{match["function"]}'


def load(name: str, digest: str = '') -> AlgorithmSpec:
    """The algorithm ``name``, read once per process; again when another ``digest`` is asked for.

    ``FUNCTION`` is the name of a function of the file, or the one by which the file registers it.

    Raises
    ------
    ValueError
        The file cannot be read, or an error ends it; it has no such function, or one that is no
        algorithm; its content is not that of ``digest``.
    """
    name = absolute_name(name)
    match = _NAME.match(name)
    if match is None:
        msg = f'{name!r} names no algorithm: write FILE.py:FUNCTION'
        raise ValueError(msg)
    if name not in _loaded or digest not in ('', _loaded[name].digest):
        _loaded[name] = _read(Path(match['file']), match['function'])
    found = _loaded[name]
    if digest not in ('', found.digest):
        msg = f'{match["file"]} has changed since it was asked for: start again'
        raise ValueError(msg)
    return found


def _read(path: Path, function: str) -> AlgorithmSpec:
    try:
        content = path.read_bytes()
    except OSError as error:
        msg = f'algorithm file {path} cannot be read: {error.strerror}'
        raise ValueError(msg) from None
    digest = hashlib.sha256(content).hexdigest()[:12]
    module = ModuleType(f'own_algorithms_{path.stem}_{digest}')
    module.__file__ = str(path)
    before = dict(SPECS)
    try:
        _run(content, module, path)
        registered = {name: spec for name, spec in SPECS.items() if spec is not before.get(name)}
    finally:
        # by its plain name another file, or an installed package, may register another one
        SPECS.clear()
        SPECS.update(before)
    shown = f'{path.name}:{function}'
    known = {**{spec.decide.__name__: spec for spec in registered.values()}, **registered}
    if function in known:
        return replace(known[function], name=shown, digest=digest)
    if not hasattr(module, function):
        msg = f'algorithm file {path} has no function {function!r}'
        raise ValueError(msg)
    return AlgorithmSpec(shown, check_function(shown, getattr(module, function)), digest=digest)


def _run(content: bytes, module: ModuleType, path: Path) -> None:
    folder = str(path.parent)
    if folder not in sys.path:
        # so that the file may import others beside it; last, so that it hides nothing
        sys.path.append(folder)
    sys.modules[module.__name__] = module
    try:
        # not by an import: Python may take the code of a version of the same size and second
        exec(compile(content, str(path), 'exec', dont_inherit=True), vars(module))
    except (Exception, SystemExit) as error:
        del sys.modules[module.__name__]
        msg = f'algorithm file {path} cannot be used: {told(error, str(path))}'
        raise ValueError(msg) from error
