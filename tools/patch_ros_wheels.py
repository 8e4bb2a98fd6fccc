"""Make the CMake files of the ROS 2 wheels fit the interpreter that runs this.

The wheels were built elsewhere: their CMake export files name the include folders of the
builder's Python and NumPy. CMake stops at a folder that does not exist, so both are replaced
by this interpreter's own. Doing it again changes nothing.
"""

from __future__ import annotations

import re
import sys
import sysconfig
from pathlib import Path

import numpy

BUILDER = '/opt/(?:_internal/c?python[^/;"]*|python/[^/;"]+)'
NUMPY_INCLUDE = re.compile(BUILDER + r'/[^;"]*numpy/_?core/include')
PYTHON_INCLUDE = re.compile(BUILDER + r'/include/python3\.\d+')


def patch(share: Path) -> int:
    """Rewrite the ``*.cmake`` files under `share` and return how many changed."""
    python_include = sysconfig.get_path('include')
    changed = 0
    for file in sorted(share.rglob('*.cmake')):
        old = file.read_text(encoding='utf-8')
        new = NUMPY_INCLUDE.sub(lambda _: numpy.get_include(), old)
        new = PYTHON_INCLUDE.sub(lambda _: python_include, new)
        if new != old:
            file.write_text(new, encoding='utf-8')
            changed += 1
    return changed


if __name__ == '__main__':
    print(f'{patch(Path(sys.prefix) / "share")} CMake files changed')
