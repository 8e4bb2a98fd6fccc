"""Files that cannot be written: which one it was, what was kept, how to go on."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

#: A file system with less room than this counts as full, bytes.
_FULL = 100_000


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Whatever of the system's errors comes out of the block names ``path``.

    Python itself names the file only where opening it fails, not where writing to it does.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def error_text(error: Exception) -> str:
    """``error`` in words, with the file that it is about."""
    if isinstance(error, OSError) and error.filename is not None:
        return f'{error.filename}: {error.strerror or error}'
    return str(error)


def full_disk(folder: Path) -> str:
    """Says that the file system of ``folder`` is full; empty where it is not."""
    free = shutil.disk_usage(folder).free
    return f'the file system of {folder} is full: {free} bytes are free' if free < _FULL else ''
