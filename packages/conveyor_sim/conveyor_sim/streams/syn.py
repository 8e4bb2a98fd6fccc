"""SYN boxes: bins cut into boxes of whole centimetres that fill them exactly.

Ojha et al., section IV: bins of 80x45x45 cm, ten to a collection, each cut into about 23 boxes.
"""

from __future__ import annotations

import random

from pack_msgs_py.values import BinSpec, Vec3

#: Bins whose volume a collection has.
SYN_BINS = 10
BOXES_PER_BIN = 23

#: A piece with a longer edge is cut along it first, centimetres.
LONGEST_EDGE_CM = 45

#: A cut leaves at least so much on both sides, centimetres.
SHORTEST_EDGE_CM = 5

#: Edges that are too long may need as many pieces as this in a bin of 80x45x45 cm.
LEAST_PIECES = 8

Piece = tuple[int, int, int]


def cut_bins(spec: BinSpec, pieces: int, rng: random.Random, bins: int = SYN_BINS) -> list[Vec3]:
    """``bins`` bins, each cut into ``pieces`` boxes, and all of them shuffled; millimetres."""
    length, breadth, height = (edge // 10 for edge in spec.size_mm)
    pieces_cm = [
        piece for _ in range(bins) for piece in cut((length, breadth, height), pieces, rng)
    ]
    rng.shuffle(pieces_cm)
    return [(10.0 * x, 10.0 * y, 10.0 * z) for x, y, z in pieces_cm]


def cut(size_cm: Piece, pieces: int, rng: random.Random) -> list[Piece]:
    """Cut one bin into ``pieces`` boxes that fill it exactly.

    A piece with an edge above 45 cm is cut first, along that edge; else a piece is taken with
    probability proportional to its volume, and a random axis. The cut is uniform over the whole
    centimetres that leave at least 5 cm on both sides.

    Raises
    ------
    ValueError
        No piece is large enough to be cut once more.
    """
    pieces_cm = [size_cm]
    while True:
        large = [index for index, piece in enumerate(pieces_cm) if max(piece) > LONGEST_EDGE_CM]
        if large:
            index = large[0]
            axis = max(range(3), key=lambda a: pieces_cm[index][a])
        elif len(pieces_cm) >= pieces:
            return pieces_cm
        elif all(max(piece) < 2 * SHORTEST_EDGE_CM for piece in pieces_cm):
            size = 'x'.join(map(str, size_cm))
            msg = f'a bin of {size} cm cannot be cut into {pieces} boxes: use fewer boxes per bin'
            raise ValueError(msg)
        else:
            volumes = [piece[0] * piece[1] * piece[2] for piece in pieces_cm]
            index = rng.choices(range(len(pieces_cm)), volumes)[0]
            axis = rng.randrange(3)
        edge = pieces_cm[index][axis]
        if edge < 2 * SHORTEST_EDGE_CM:
            continue
        where = rng.randint(SHORTEST_EDGE_CM, edge - SHORTEST_EDGE_CM)
        near, far = list(pieces_cm[index]), list(pieces_cm[index])
        near[axis], far[axis] = where, edge - where
        pieces_cm[index] = (near[0], near[1], near[2])
        pieces_cm.append((far[0], far[1], far[2]))
