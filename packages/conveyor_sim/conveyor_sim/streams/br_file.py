"""Container-loading instances of Bischoff and Ratcliff (1995) in the OR-Library's format `thpack`.

A number of problems; for each its number and seed, the container, the number of types, and for
each type: number, and three edges, each with 1 if it may stand upright, then how many. Centimetres.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from conveyor_sim.streams.box_records import DEFAULT_DENSITY_KG_PER_MM3, BoxFileError
from pack_msgs_py.values import (
    MAX_EDGE_MM,
    UP_NEG_X,
    UP_NEG_Y,
    UP_NEG_Z,
    UP_POS_X,
    UP_POS_Y,
    UP_POS_Z,
    Box,
)

_UP = (UP_POS_X | UP_NEG_X, UP_POS_Y | UP_NEG_Y, UP_POS_Z | UP_NEG_Z)
_MM_PER_CM = 10.0
_MAX_BYTES = 10_000_000
_MAX_BOXES = 1_000_000


def br_boxes(path: Path, problem: int, scale: float = 1.0) -> list[Box]:
    """The boxes of one problem, type after type; ``scale`` shrinks what was made for containers.

    Raises
    ------
    BoxFileError
        The file cannot be read, is not of this format, or has no such problem.
    """
    numbers = _numbers(path)
    try:
        total = next(numbers)
        if not 1 <= problem <= total:
            msg = f'{path} holds problems 1 to {total}, not {problem}'
            raise BoxFileError(msg)
        for current in range(1, problem + 1):
            _, _, _, _, _, kinds = (next(numbers) for _ in range(6))
            rows = [[next(numbers) for _ in range(8)] for _ in range(_checked(kinds, path))]
            if current == problem:
                return _boxes(rows, f'{path.stem}-{problem}', scale, path)
    except StopIteration:
        msg = f'{path} ends before problem {problem} does: it is not a whole thpack file'
        raise BoxFileError(msg) from None
    raise AssertionError


def _numbers(path: Path) -> Iterator[int]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            msg = f'{path} is larger than {_MAX_BYTES // 1_000_000} MB: it is no thpack file'
            raise BoxFileError(msg)
        text = path.read_text(encoding='ascii', errors='replace')
    except OSError as error:
        msg = f'{path} cannot be read: {error.strerror or error}'
        raise BoxFileError(msg) from None
    for line, words in enumerate(text.splitlines(), start=1):
        for word in words.split():
            if not word.isdecimal():
                msg = f'{path}, line {line}: {word[:20]!r} is not a whole number'
                raise BoxFileError(msg)
            yield int(word)


def _checked(kinds: int, path: Path) -> int:
    if not 1 <= kinds <= _MAX_BOXES:
        msg = f'{path}: {kinds} types in a problem; the file is damaged or of another format'
        raise BoxFileError(msg)
    return kinds


def _boxes(rows: list[list[int]], stem: str, scale: float, path: Path) -> list[Box]:
    boxes: list[Box] = []
    for kind, x, up_x, y, up_y, z, up_z, count in rows:
        edges = tuple(round(_MM_PER_CM * scale * edge, 1) for edge in (x, y, z))
        upright = sum(bits for bits, flag in zip(_UP, (up_x, up_y, up_z), strict=True) if flag)
        good = all(0 < edge <= MAX_EDGE_MM for edge in edges) and max(up_x, up_y, up_z) == 1
        if not good or len(boxes) + count > _MAX_BOXES:
            msg = (
                f'{path}: type {kind} is {x} {up_x} {y} {up_y} {z} {up_z}, {count} times; '
                'three edges in cm, each followed by 0 or 1, and a number are needed'
            )
            raise BoxFileError(msg)
        size = (edges[0], edges[1], edges[2])
        weight = size[0] * size[1] * size[2] * DEFAULT_DENSITY_KG_PER_MM3
        boxes += [
            Box(f'{stem}-{kind}-{n}', size, weight, allowed_up=upright) for n in range(1, count + 1)
        ]
    return boxes
