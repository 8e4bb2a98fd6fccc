"""The nine classes of Martello, Pisinger and Vigo, 'The three-dimensional bin packing problem',
Operations Research 48(2), 2000, section 6, and class 9 as in the authors' published generator.

The bin is a cube of W units: 100, but 10 in class 6 and 40 in class 7. All edges are whole units.
"""

from __future__ import annotations

import random

from pack_msgs_py.values import Vec3

CLASSES = range(1, 10)
#: Bins into which class 9 is cut.
_CUT_BINS = 3
#: The share of the class's own type in classes 1 to 5; the other four types share the rest.
_OWN_TYPE = 0.6
#: Classes 6 to 8: edge of the bin and longest edge of a box, units.
_UNIFORM = {6: (10, 10), 7: (40, 35), 8: (100, 100)}
_BIN = 100

_Size = tuple[int, int, int]


def bin_units(number: int) -> int:
    """Edge of the bin of a class, units."""
    return _UNIFORM.get(number, (_BIN, _BIN))[0]


def boxes_of_class(number: int, count: int, unit_mm: float, rng: random.Random) -> list[Vec3]:
    """``count`` boxes of a class, millimetres, in random order.

    Raises
    ------
    ValueError
        There is no such class.
    """
    if number not in CLASSES:
        msg = f'class {number} is not one of 1 to 9'
        raise ValueError(msg)
    if number == 9:
        sizes = _all_fill(count, rng)
        rng.shuffle(sizes)
    elif number in _UNIFORM:
        longest = _UNIFORM[number][1]
        sizes = [_uniform(longest, rng) for _ in range(count)]
    else:
        sizes = [_of_type(_type_of(number, rng), rng) for _ in range(count)]
    return [(x * unit_mm, y * unit_mm, z * unit_mm) for x, y, z in sizes]


def _uniform(longest: int, rng: random.Random) -> _Size:
    return (rng.randint(1, longest), rng.randint(1, longest), rng.randint(1, longest))


def _type_of(number: int, rng: random.Random) -> int:
    if rng.random() < _OWN_TYPE:
        return number
    return rng.choice([other for other in range(1, 6) if other != number])


def _of_type(kind: int, rng: random.Random) -> _Size:
    """Types 1 to 3 are short along one axis and long along the others, 4 large, 5 small."""
    half, two_thirds = _BIN // 2, -(-2 * _BIN // 3)

    def edge(axis: int) -> int:
        if kind == 5 or kind - 1 == axis:
            return rng.randint(1, half)
        return rng.randint(half if kind == 4 else two_thirds, _BIN)

    return (edge(0), edge(1), edge(2))


def _all_fill(count: int, rng: random.Random) -> list[_Size]:
    """Three bins cut into ``count`` boxes; the first two into a third each, rounded down."""
    if count < _CUT_BINS:
        msg = f'class 9 cuts {_CUT_BINS} bins: at least {_CUT_BINS} boxes are needed, not {count}'
        raise ValueError(msg)
    third = count // _CUT_BINS
    sizes: list[_Size] = []
    for pieces in (third, third, count - 2 * third):
        cut: list[_Size] = []
        while not cut or min(min(size) for size in cut) < 1:
            # The pattern of five needs three units of room, and the cuts may have left less.
            cut = _cut((_BIN, _BIN, _BIN), pieces, rng)
        sizes += cut
    return sizes


def _cut(size: _Size, pieces: int, rng: random.Random) -> list[_Size]:
    """Halve the number of pieces by a guillotine cut anywhere; five make a pinwheel."""
    x, y, z = size
    if pieces == 1:
        return [size]
    if pieces == 5:
        w, h = x // 3, y // 3
        arms = [(x - w, h, z), (w, y - h, z)]
        return [(x - 2 * w, y - 2 * h, z), *arms, *arms]
    if max(size) < 2:
        return [(0, 0, 0)] * pieces
    axis = rng.choice([axis for axis in range(3) if size[axis] >= 2])
    where = rng.randint(1, size[axis] - 1)
    near, far = list(size), list(size)
    near[axis], far[axis] = where, size[axis] - where
    first = (pieces + 1) // 2
    return [
        *_cut((near[0], near[1], near[2]), first, rng),
        *_cut((far[0], far[1], far[2]), pieces - first, rng),
    ]
