"""The cell from above, with a map of what the robot reaches of each bin."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from arm_executor.model.layout import (
    Block,
    Layout,
    bin_blocks,
    bin_frame,
    conveyor_block,
    rail_block,
)
from arm_executor.model.robot_data import find_robot
from pack_msgs_py.geometry.pose import Pose

if TYPE_CHECKING:
    from arm_executor.reach.reach_motion import StationReach
    from pack_cell.layout.verdict import Verdict

_STEEL, _BELT, _WALL = '#8a8f98', '#3b3f46', '#2f6fb3'
_TILE_M = 0.075


def draw(path: Path, layout: Layout, verdicts: Sequence[Verdict], deadline_s: float) -> None:
    """Draw one view per kind of bin into ``path``; the suffix says which format."""
    import matplotlib as mpl

    mpl.use('Agg')
    from matplotlib import pyplot

    shown = [verdict for verdict in verdicts if verdict.stations] or list(verdicts)
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = pyplot.subplots(
        rows,
        columns,
        figsize=(8.0 * columns, 7.0 * rows + 0.5),
        squeeze=False,
        layout='constrained',
    )
    for axis, verdict in zip(axes.flat, shown, strict=False):
        _view(axis, layout, verdict, deadline_s)
    for axis in axes.flat[len(shown) :]:
        axis.axis('off')
    _legend(figure, axes.flat[0], deadline_s)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _view(axis: Any, layout: Layout, verdict: Verdict, deadline_s: float) -> None:  # noqa: ANN401
    from matplotlib.patches import Circle

    spec = verdict.spec
    _rectangle(axis, rail_block(layout), _STEEL, 0.55)
    _rectangle(axis, conveyor_block(layout), _BELT, 0.85)
    belt = layout.conveyor
    axis.text(
        0.0, belt.front_y + belt.length * 0.7, 'belt', color='white', ha='center', va='center'
    )
    axis.plot(0.0, belt.front_y, 'v', color='white', markersize=7)
    for x in (layout.rail.x_min, 0.0, layout.rail.x_max):
        axis.add_patch(
            Circle(
                (x, 0.0), layout.rail.pedestal_radius, color=_STEEL, alpha=1.0 if x == 0 else 0.4
            )
        )
    reach = find_robot(layout.robot).reach
    axis.add_patch(Circle((0.0, 0.0), reach, fill=False, linestyle=':', color='#555555'))
    axis.text(
        layout.rail.x_max, -0.2, f'rail of the {layout.robot}', ha='right', va='top', fontsize=9
    )
    for station in verdict.stations:
        _station(axis, layout, station, deadline_s)
    axis.set_aspect('equal')
    far = max(
        2.3, reach + 0.1, *(abs(y) for station in verdict.stations for y in _ends(layout, station))
    )
    wide = max(layout.rail.x_max + 0.6, 0.45 + spec.size_mm[0] / 1000 + 0.3)
    axis.set_xlim(-wide, wide)
    axis.set_ylim(-far, far)
    axis.set_xlabel('x along the rail, m')
    axis.set_ylabel('y towards the infeed, m')
    size = ' x '.join(f'{edge / 10:g}' for edge in spec.size_mm)
    title = f'{layout.robot}, bins {spec.name} ({size} cm)'
    axis.set_title(title if not verdict.refusal else f'{title}: refused')


def _ends(layout: Layout, station: StationReach) -> tuple[float, float]:
    blocks = bin_blocks(layout, station.station, station.spec)
    return min(b.low[1] for b in blocks) - 0.1, max(b.high[1] for b in blocks) + 0.1


def _station(axis: Any, layout: Layout, station: StationReach, deadline_s: float) -> None:  # noqa: ANN401
    """Walls, a tile per column of places, and a dot where a motion was planned."""
    from matplotlib.patches import Rectangle

    for block in bin_blocks(layout, station.station, station.spec):
        if not block.name.endswith('floor'):
            _rectangle(axis, block, _WALL, 0.9)
    frame = bin_frame(layout, station.station, station.spec)
    cells = [frame.to_cell(Pose((x, y, z))).position for x, y, z in station.places.tolist()]
    columns: dict[tuple[float, float], list[int]] = {}
    for index, (x, y, _) in enumerate(cells):
        columns.setdefault((round(x, 4), round(y, 4)), []).append(index)
    for (x, y), members in columns.items():
        share = float(np.mean([station.free[index] for index in members]))
        tile = Rectangle((x - _TILE_M / 2, y - _TILE_M / 2), _TILE_M, _TILE_M, color=_shade(share))
        axis.add_patch(tile)
    for index, seconds in station.seconds.items():
        x, y, _ = cells[index]
        if np.isnan(seconds):
            axis.plot(x, y, 'x', color='black', markersize=6)
        else:
            face = 'white' if seconds <= deadline_s else 'black'
            axis.plot(x, y, 'o', color=face, markeredgecolor='black', markersize=5)
    # Away from the rail and from the belt.
    low, high = _ends(layout, station)
    behind = frame.origin[1] < 0
    side = {'A': 'right', 'B': 'left'}.get(station.station, 'center')
    reached = [x for x, _, _ in cells]
    at = {'right': max(reached), 'left': min(reached), 'center': (min(reached) + max(reached)) / 2}
    text = f'{station.station}: {station.share:.0%} free'
    if station.seconds:
        text += f', {station.within(deadline_s):.0%} in time'
    level = 'top' if behind else 'bottom'
    axis.text(at[side], low if behind else high, text, ha=side, va=level, fontsize=9)


def _shade(share: float) -> tuple[float, float, float]:
    """Red at 0, yellow at a half, green at 1."""
    red, green, yellow = (0.80, 0.25, 0.22), (0.30, 0.65, 0.35), (0.95, 0.80, 0.35)
    low, high, way = (red, yellow, 2 * share) if share < 0.5 else (yellow, green, 2 * share - 1)
    r, g, b = (a + (c - a) * way for a, c in zip(low, high, strict=True))
    return (r, g, b)


def _rectangle(axis: Any, block: Block, colour: str, alpha: float) -> None:  # noqa: ANN401
    from matplotlib.patches import Rectangle

    (x, y, _), (width, depth, _) = block.low, block.size
    axis.add_patch(Rectangle((x, y), width, depth, color=colour, alpha=alpha, linewidth=0))


def _legend(figure: Any, axis: Any, deadline_s: float) -> None:  # noqa: ANN401
    from matplotlib.lines import Line2D

    def dot(shape: str, face: str, text: str, edge: str = 'black') -> Line2D:
        return Line2D(
            [], [], linestyle='', marker=shape, color=face, markeredgecolor=edge, label=text
        )

    entries = [
        dot('s', _hex(1.0), 'free at all heights', _hex(1.0)),
        dot('s', _hex(0.5), 'at some', _hex(0.5)),
        dot('s', _hex(0.0), 'at none', _hex(0.0)),
        dot('o', 'white', f'planned, within {deadline_s:g} s'),
        dot('o', 'black', 'planned, slower'),
        dot('x', 'black', 'no motion found'),
        Line2D([], [], linestyle=':', color='#555555', label='reach of the robot (data sheet)'),
    ]
    figure.legend(handles=entries, loc='outside lower center', ncols=4, fontsize=9)


def _hex(share: float) -> str:
    return '#' + ''.join(f'{round(255 * value):02x}' for value in _shade(share))
