"""Names of a package whose modules are imported when a name is first asked for.

Numba takes half a second to load, for which nobody should wait who only reads a list of names.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module


def lazy_names(package: str, modules: Mapping[str, Sequence[str]]) -> Callable[[str], object]:
    """A ``__getattr__`` (PEP 562) for ``package``, by the names that each of ``modules`` has."""
    homes = {name: module for module, names in modules.items() for name in names}

    def find(name: str) -> object:
        if name not in homes:
            msg = f'module {package!r} has no attribute {name!r}'
            raise AttributeError(msg)
        value: object = getattr(import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return find
