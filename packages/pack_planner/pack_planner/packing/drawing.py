"""A bin as a picture, seen from its front, right and top."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pack_msgs_py.values import Bin, Int3, PlacedBox
from pack_msgs_py.wording import how_many

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Share of a length along y that is seen to the right, and of one that is seen upwards.
_DEPTH_X, _DEPTH_Y = 0.45, 0.32
_WALL = '#8a8f98'
#: Brightness of the front, the right and the top face.
_SHADES = (0.86, 0.72, 1.0)

_Flat = tuple[float, float]


def draw_bin(target: Bin, file: str | Path | None = None, *, names: bool = False) -> Figure:
    """Draw the boxes of a bin with their planned sizes, each in a colour of its own.

    Parameters
    ----------
    target : the bin.
    file : where to save the picture; the suffix says how (.png, .svg, .pdf). ``None`` does not.
    names : write the id of a box on it.

    Returns
    -------
    matplotlib.figure.Figure
        To go on drawing with; a notebook shows it.

    Raises
    ------
    ImportError
        Matplotlib is missing.
    """
    try:
        from matplotlib import colormaps
        from matplotlib.figure import Figure
    except ImportError:
        msg = "draw_bin needs matplotlib: install it, or this package as 'pack_planner[plot]'"
        raise ImportError(msg) from None
    size = target.spec.size_mm
    right, top = _seen(size)
    figure = Figure(figsize=(7.0, 7.0 * top / right + 0.5), layout='constrained')
    axes = figure.add_subplot()
    axes.set_aspect('equal')
    axes.set_axis_off()
    axes.set_title(
        f'{target.spec.name}: {how_many(len(target.boxes), "box")}, {target.fill_rate:.1%} full'
    )
    _draw_edges(axes, size, 0, hidden=True)
    colours = colormaps['tab20'].colors  # type: ignore[attr-defined]
    number = {placed.box.id: index for index, placed in enumerate(target.boxes)}
    for layer, placed in enumerate(far_to_near(target.boxes), start=1):
        colour = colours[number[placed.box.id] % len(colours)]
        _draw_box(axes, placed, colour, layer, name=placed.box.id if names else '')
    _draw_edges(axes, size, len(target.boxes) + 1, hidden=False)
    axes.autoscale_view()
    if file is not None:
        figure.savefig(file, dpi=120)
    return figure


def far_to_near(boxes: Sequence[PlacedBox]) -> list[PlacedBox]:
    """In an order in which no box hides one that comes later.

    Of two boxes that do not overlap, the one is left of, behind or below the other. Boxes that go
    round in a circle, each behind the next, come in the order of their far corners.
    """
    left = sorted(boxes, key=lambda placed: (-placed.corner_mm[1], placed.corner_mm[0]))
    order: list[PlacedBox] = []
    while left:
        free = (
            placed
            for placed in left
            if not any(_hides(placed, other) for other in left if other is not placed)
        )
        nearest_last = next(free, left[0])
        left.remove(nearest_last)
        order.append(nearest_last)
    return order


def _hides(placed: PlacedBox, other: PlacedBox) -> bool:
    """Whether ``placed`` may hide part of ``other``: no side of it is turned away from it."""
    return not (
        placed.far_mm[0] <= other.corner_mm[0]
        or placed.corner_mm[1] >= other.far_mm[1]
        or placed.top_mm <= other.corner_mm[2]
    )


def _seen(point: Sequence[float]) -> _Flat:
    """Where a point of the bin frame is on the paper, millimetres."""
    x, y, z = point
    return x + _DEPTH_X * y, z + _DEPTH_Y * y


def _draw_box(
    axes: Axes, placed: PlacedBox, colour: Sequence[float], layer: int, *, name: str
) -> None:
    from matplotlib.patches import Polygon

    (x0, y0, z0), (x1, y1, z1) = placed.corner_mm, placed.far_mm
    faces = (
        ((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
        ((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)),
        ((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
    )
    for corners, shade in zip(faces, _SHADES, strict=True):
        shaded = [shade * part for part in colour]
        corners_seen = [_seen(corner) for corner in corners]
        face = Polygon(corners_seen, facecolor=shaded, edgecolor='black', linewidth=0.6)
        face.set_zorder(layer)
        axes.add_patch(face)
    middle = _seen(((x0 + x1) / 2, y0, (z0 + z1) / 2))
    axes.text(*middle, name, ha='center', va='center', fontsize=7, zorder=layer)


def _draw_edges(axes: Axes, size: Int3, layer: int, *, hidden: bool) -> None:
    """The edges of the bin that the boxes hide, or the others."""
    corners = [tuple(size[axis] * (code >> axis & 1) for axis in range(3)) for code in range(8)]
    behind_all = (0, size[1], 0)
    for number, start in enumerate(corners):
        for axis in range(3):
            if number >> axis & 1:
                continue
            end = corners[number | 1 << axis]
            if (behind_all in (start, end)) is hidden:
                xs, ys = zip(_seen(start), _seen(end), strict=True)
                axes.plot(xs, ys, color=_WALL, linewidth=1.0, zorder=layer)
