"""Collections of boxes: cut from bins (SYN), drawn from a list (industrial), or a file's own."""

from __future__ import annotations

import random
from dataclasses import replace

from pack_msgs_py.values import BinSpec, Box
from pack_planner.bench.values import Case, Settings

#: Bins whose volume a collection has (Ojha et al., section IV).
SYN_BINS, INDUSTRIAL_BINS = 10, 4

#: A piece with a longer edge is cut along it first, centimetres.
LONGEST_EDGE_CM = 45

#: A cut leaves at least so much on both sides, centimetres.
SHORTEST_EDGE_CM = 5

#: Weight of a cut box: that of a parcel of average density, as for box files without weights.
DENSITY_KG_PER_MM3 = 1.0 / 6.0e6

_Piece = tuple[int, int, int]


def collection(case: Case, settings: Settings, number: int) -> tuple[Box, ...]:
    """The boxes of collection ``number``, from 0, in the order of their arrival.

    Equal for all algorithms and look-aheads, so that these are compared on the same boxes.
    """
    source = case.source
    rng = random.Random(f'{settings.seed}/{case.bin_spec.name}/{number}')
    if not source.boxes:
        return cut_collection(case.bin_spec, settings.boxes_per_bin, rng)
    if not source.in_order:
        return drawn_collection(case.bin_spec, source.boxes, rng)
    boxes = list(source.boxes)
    if source.shuffle is not None:
        random.Random(f'{source.shuffle}/{number}').shuffle(boxes)
    return tuple(boxes)


def cut_collection(spec: BinSpec, pieces: int, rng: random.Random) -> tuple[Box, ...]:
    """Ten bins, each cut into ``pieces`` boxes of whole centimetres, and all of them shuffled."""
    size = tuple(edge // 10 for edge in spec.size_mm)
    found = [
        piece for _ in range(SYN_BINS) for piece in cut((size[0], size[1], size[2]), pieces, rng)
    ]
    rng.shuffle(found)
    return tuple(_cut_box(number, piece) for number, piece in enumerate(found, start=1))


def _cut_box(number: int, piece: _Piece) -> Box:
    x, y, z = (10.0 * edge for edge in piece)
    return Box(f'syn-{number}', (x, y, z), weight_kg=x * y * z * DENSITY_KG_PER_MM3)


def cut(size_cm: _Piece, pieces: int, rng: random.Random) -> list[_Piece]:
    """Cut one bin into ``pieces`` boxes that fill it exactly.

    A piece with an edge above 45 cm is cut first, along that edge; else a piece is taken with
    probability proportional to its volume, and a random axis. The cut is uniform over the whole
    centimetres that leave at least 5 cm on both sides.

    Raises
    ------
    ValueError
        No piece is large enough to be cut once more.
    """
    found = [size_cm]
    while True:
        large = [index for index, piece in enumerate(found) if max(piece) > LONGEST_EDGE_CM]
        if large:
            index = large[0]
            axis = max(range(3), key=lambda a: found[index][a])
        elif len(found) >= pieces:
            return found
        elif all(max(piece) < 2 * SHORTEST_EDGE_CM for piece in found):
            size = 'x'.join(map(str, size_cm))
            msg = f'a bin of {size} cm cannot be cut into {pieces} boxes: use fewer boxes per bin'
            raise ValueError(msg)
        else:
            volumes = [piece[0] * piece[1] * piece[2] for piece in found]
            index = rng.choices(range(len(found)), volumes)[0]
            axis = rng.randrange(3)
        edge = found[index][axis]
        if edge < 2 * SHORTEST_EDGE_CM:
            continue
        where = rng.randint(SHORTEST_EDGE_CM, edge - SHORTEST_EDGE_CM)
        one, other = list(found[index]), list(found[index])
        one[axis], other[axis] = where, edge - where
        found[index] = (one[0], one[1], one[2])
        found.append((other[0], other[1], other[2]))


def drawn_collection(spec: BinSpec, boxes: tuple[Box, ...], rng: random.Random) -> tuple[Box, ...]:
    """Boxes drawn with replacement until their true volume fills four bins; each gets a new id."""
    found: list[Box] = []
    volume, wanted = 0.0, INDUSTRIAL_BINS * spec.volume_mm3
    while volume < wanted:
        box = rng.choice(boxes)
        found.append(replace(box, id=f'{box.id}/{len(found) + 1}'))
        volume += box.volume_mm3
    return tuple(found)
