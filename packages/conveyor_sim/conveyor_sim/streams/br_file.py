"""Container-loading instances of Bischoff and Ratcliff (1995) in the OR-Library's format `thpack`.

A number of problems; for each its number and seed, the container, the number of types, and for
each type: number, and three edges, each with 1 if it may stand upright, then how many. Centimetres.
The problems of Loh and Nee, and of Ivancic, Mathur and Mohanty (`thpack8`, `thpack9`) have no seed.
"""

from __future__ import annotations

from dataclasses import dataclass
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
from pack_msgs_py.wording import how_many

_UP = (UP_POS_X | UP_NEG_X, UP_POS_Y | UP_NEG_Y, UP_POS_Z | UP_NEG_Z)
_MM_PER_CM = 10.0
_MAX_BYTES = 10_000_000
_MAX_BOXES = 1_000_000


@dataclass(frozen=True)
class _Number:
    """A number of the file and the line that it stands in."""

    value: int
    line: int


#: One type of boxes: number, three edges each with 1 if it may stand upright, how many.
_Kind = tuple[int, ...]


class _Damage(ValueError):
    """The numbers are not those of a whole file of this format."""


def br_boxes(path: Path, problem: int, scale: float = 1.0) -> list[Box]:
    """The boxes of one problem, type after type; ``scale`` shrinks what was made for containers.

    Raises
    ------
    BoxFileError
        The file cannot be read, is not of this format, or has no such problem.
    """
    numbers = _numbers(path)
    try:
        problems = _problems(numbers, seeded=_has_seeds(numbers))
    except _Damage as damage:
        msg = f'{path}, {damage}'
        raise BoxFileError(msg) from None
    if not 1 <= problem <= len(problems):
        msg = f'{path} holds problems 1 to {len(problems)}, not {problem}'
        raise BoxFileError(msg)
    return _boxes(problems[problem - 1], f'{path.stem}-{problem}', scale, path)


def _has_seeds(numbers: list[_Number]) -> bool:
    """Whether the line of the first problem's number holds a seed too."""
    lines = [number.line for number in numbers[1:3]]
    return len(lines) == 2 and lines[0] == lines[1]


def _problems(numbers: list[_Number], *, seeded: bool) -> list[list[_Kind]]:
    """All problems of a file; ``seeded`` ones have a seed behind their number.

    Raises
    ------
    _Damage
        With the line and what is wrong.
    """
    place = 0

    def take(count: int) -> tuple[int, ...]:
        nonlocal place
        taken = numbers[place : place + count]
        if len(taken) < count:
            msg = f'line {numbers[-1].line if numbers else 1}: the file ends within a problem'
            raise _Damage(msg)
        place += count
        return tuple(number.value for number in taken)

    def damage(what: str, back: int) -> _Damage:
        return _Damage(f'line {numbers[place - back].line}: {what}')

    (total,) = take(1)
    problems = []
    for number in range(1, total + 1):
        head = take(6 if seeded else 5)
        if head[0] != number:
            raise damage(f'problem {number} is expected, {head[0]} is there', len(head))
        if not 1 <= head[-1] <= _MAX_BOXES:
            raise damage(f'{head[-1]} types in a problem', 1)
        kinds = []
        for kind in range(1, head[-1] + 1):
            row = take(8)
            if row[0] != kind or not {row[2], row[4], row[6]} <= {0, 1}:
                shown = ' '.join(map(str, row))
                wanted = 'three edges each with 0 or 1, and how many'
                raise damage(f'type {kind}, {wanted}, is expected, {shown} is there', 8)
            kinds.append(row)
        problems.append(kinds)
    if place < len(numbers):
        msg = f'line {numbers[place].line}: there is more than {total} problems'
        raise _Damage(msg)
    return problems


def _numbers(path: Path) -> list[_Number]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            msg = f'{path} is larger than {_MAX_BYTES // 1_000_000} MB: it is no thpack file'
            raise BoxFileError(msg)
        text = path.read_text(encoding='ascii', errors='replace')
    except OSError as error:
        msg = f'{path} cannot be read: {error.strerror or error}'
        raise BoxFileError(msg) from None
    numbers = []
    for line, words in enumerate(text.splitlines(), start=1):
        for word in words.split():
            if not word.isdecimal():
                msg = f'{path}, line {line}: {word[:20]!r} is not a whole number'
                raise BoxFileError(msg)
            numbers.append(_Number(int(word), line))
    return numbers


def _boxes(rows: list[_Kind], stem: str, scale: float, path: Path) -> list[Box]:
    boxes: list[Box] = []
    for kind, x, up_x, y, up_y, z, up_z, count in rows:
        edges = tuple(round(_MM_PER_CM * scale * edge, 1) for edge in (x, y, z))
        upright = sum(bits for bits, flag in zip(_UP, (up_x, up_y, up_z), strict=True) if flag)
        good = all(0 < edge <= MAX_EDGE_MM for edge in edges) and max(up_x, up_y, up_z) == 1
        if not good or len(boxes) + count > _MAX_BOXES:
            read = f'{x} {up_x} {y} {up_y} {z} {up_z}, {how_many(count, "time")}'
            msg = (
                f'{path}: type {kind} is {read}; '
                'three edges in cm, each followed by 0 or 1, and a number are needed'
            )
            raise BoxFileError(msg)
        size = (edges[0], edges[1], edges[2])
        weight = size[0] * size[1] * size[2] * DEFAULT_DENSITY_KG_PER_MM3
        boxes += [
            Box(f'{stem}-{kind}-{n}', size, weight, allowed_up=upright) for n in range(1, count + 1)
        ]
    return boxes
