"""Where compiled code is kept: apart for each version of the sources.

Numba takes a compiled function from its cache while the file of that function is unchanged. What it
calls is compiled into it, and so an update of another file alone would go on running old code.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import time
from pathlib import Path

_VARIABLE = 'NUMBA_CACHE_DIR'
_PREFIX = 'sources-'
#: What a module has in it that is compiled, or has the types of what is.
_COMPILED = (b'njit', b'@compiled', b'@entry', b'@uncounted', b'NamedTuple')
#: Age of the compiled code of another version that is deleted, seconds.
_UNUSED_S = 24 * 3600.0


def version_of(folder: Path) -> str:
    """A name that changes with every compiled module under ``folder``."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob('*.py')):
        content = path.read_bytes()
        if any(word in content for word in _COMPILED):
            digest.update(path.relative_to(folder).as_posix().encode() + b'\0' + content)
    return _PREFIX + digest.hexdigest()[:16]


def keep_apart(folder: Path) -> None:
    """Let Numba keep what is compiled from ``folder`` in a directory of this version's own.

    That lies in ``NUMBA_CACHE_DIR``, or beside the modules; those of other versions are deleted
    when no process that began with them may still write there. Call before anything is compiled.
    """
    base = Path(os.environ.get(_VARIABLE) or folder / '__pycache__')
    if base.name.startswith(_PREFIX):  # of the process that started this one
        base = base.parent
    own = base / version_of(folder)
    if not own.exists() and base.is_dir():
        for other in base.glob(_PREFIX + '*'):
            if time.time() - other.stat().st_mtime > _UNUSED_S:
                shutil.rmtree(other, ignore_errors=True)
    os.environ[_VARIABLE] = str(own)
    if 'numba' in sys.modules:
        sys.modules['numba'].config.CACHE_DIR = str(own)
