"""The state of one bin for the search: a piecewise-constant height map over box edges.

The floor plan is cut at every edge of a placed box. Each piece knows its height and the box whose
top it is, so the size of the map depends on the number of boxes and not on the resolution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pack_msgs_py.orientation import oriented_size
from pack_msgs_py.profiles import Profile
from pack_msgs_py.values import Bin, BinSpec, PlacedBox
from pack_planner.engine.bearing import with_bearing
from pack_planner.engine.turns import sure_part

GRAVITY = 9.80665  # m/s2, standard gravity (ISO 80000-3)


Ints = NDArray[np.int64]


@njit(cache=True, nogil=True)
def _with_edges(edges, low, high):  # type: ignore[no-untyped-def]
    """``edges`` with ``low`` and ``high`` inserted, and for each new strip the old strip it was."""
    merged = np.empty(len(edges) + 2, np.int64)
    source = np.empty(len(edges) + 1, np.int64)
    size = 0
    for i in range(len(edges)):
        if size == 0 or edges[i] != merged[size - 1]:
            merged[size] = edges[i]
            size += 1
        if i + 1 < len(edges):
            source[size - 1] = i
            for value in (low, high):
                if edges[i] < value < edges[i + 1]:
                    merged[size] = value
                    source[size] = i
                    size += 1
    return merged[:size], source[: size - 1]


@njit(cache=True, nogil=True)
def _add_box(columns, rows, height, owner, rect, top, number):  # type: ignore[no-untyped-def]
    """The height map with one more box on it."""
    new_columns, from_column = _with_edges(columns, rect[0], rect[2])
    new_rows, from_row = _with_edges(rows, rect[1], rect[3])
    new_height = np.empty((len(from_column), len(from_row)), height.dtype)
    new_owner = np.empty((len(from_column), len(from_row)), owner.dtype)
    for i in range(len(from_column)):
        inside_x = rect[0] <= new_columns[i] and new_columns[i + 1] <= rect[2]
        for j in range(len(from_row)):
            new_height[i, j] = height[from_column[i], from_row[j]]
            new_owner[i, j] = owner[from_column[i], from_row[j]]
            inside = inside_x and rect[1] <= new_rows[j] and new_rows[j + 1] <= rect[3]
            if inside and top > new_height[i, j]:
                new_height[i, j] = top
                new_owner[i, j] = number
    return new_columns, new_rows, new_height, new_owner


@njit(cache=True, nogil=True)
def _grid_lines(boxes, columns, rows, height, tolerance, step, axis):  # type: ignore[no-untyped-def]
    """Edges along ``axis`` of the boxes that can still matter, rounded to the grid both ways.

    A box matters while somewhere over it the map is not more than ``tolerance`` above its top.
    """
    lines = [0]
    for box in boxes:
        matters = False
        for i in range(len(columns) - 1):
            if matters or columns[i] < box[0] or columns[i + 1] > box[2]:
                continue
            for j in range(len(rows) - 1):
                under = rows[j] >= box[1] and rows[j + 1] <= box[3]
                if under and height[i, j] <= box[4] + tolerance:
                    matters = True
                    break
        if matters:
            for edge in (box[axis], box[axis + 2]):
                lines.append(edge // step * step)
                lines.append(-(-edge // step) * step)
    return np.unique(np.array(lines))


@dataclass(frozen=True, eq=False)
class BinModel:
    """One open bin as the search sees it. Immutable: :meth:`with_box` returns a new one.

    Attributes
    ----------
    source : the bin this is a model of.
    blocked : why nothing may be added, empty when boxes may.
    boxes, columns, rows, height, owner, lines_x, lines_y, slack, passed_on, bearing : see
        :func:`pack_planner.engine.search.search_bin`.
    """

    source: Bin
    blocked: str
    boxes: Ints
    columns: Ints
    rows: Ints
    height: NDArray[np.int32]
    owner: NDArray[np.int32]
    lines_x: Ints
    lines_y: Ints
    slack: NDArray[np.float64]
    passed_on: NDArray[np.float64]
    bearing: tuple[NDArray[np.float64], Ints]

    def arrays(self) -> tuple[Any, ...]:
        """What the search reads, in the order it takes it."""
        return (
            self.boxes,
            self.columns,
            self.rows,
            self.height,
            self.owner,
            self.lines_x,
            self.lines_y,
            self.slack,
            self.passed_on,
            self.bearing,
        )


def empty_model(source: Bin) -> BinModel:
    """The model of ``source`` without its boxes."""
    length, breadth, _ = source.spec.size_mm
    line = np.zeros(1, np.int64)
    return BinModel(
        source=source,
        blocked='',
        boxes=np.empty((0, 5), np.int64),
        columns=np.array([0, length], np.int64),
        rows=np.array([0, breadth], np.int64),
        height=np.zeros((1, 1), np.int32),
        owner=np.full((1, 1), -1, np.int32),
        lines_x=line,
        lines_y=line,
        slack=np.empty(0),
        passed_on=np.empty((0, 0)),
        bearing=(np.empty((0, 2)), np.zeros(1, np.int64)),
    )


def build_model(source: Bin, profile: Profile) -> BinModel:
    """The model of a bin and all that is in it."""
    model = empty_model(source)
    for placed in source.boxes:
        model = _stacked(model, placed, source.spec, profile)
    return _finished(model, source, profile)


def with_box(model: BinModel, placed: PlacedBox, profile: Profile) -> BinModel:
    """``model`` with one more box; the rules are not checked."""
    old = model.source
    # dataclasses.replace() would cost a tenth of a decision
    source = Bin(
        old.id, old.serial, old.spec, (*old.boxes, placed), old.station, old.revision + 1,
        old.destination,
    )  # fmt: skip
    return _finished(_stacked(model, placed, source.spec, profile), source, profile)


def _stacked(model: BinModel, placed: PlacedBox, spec: BinSpec, profile: Profile) -> BinModel:
    (x0, y0, _), (x1, y1, top) = placed.corner_mm, placed.far_mm
    length, breadth, _ = spec.size_mm
    x0, x1 = max(0, x0), min(length, x1)
    y0, y1 = max(0, y0), min(breadth, y1)
    row = np.array([[x0, y0, x1, y1, top]], np.int64)
    columns, rows, height, owner = _add_box(
        model.columns, model.rows, model.height, model.owner,
        (x0, y0, x1, y1), top, len(model.boxes),
    )  # fmt: skip
    bearing = model.bearing
    if profile.stability_margin_mm is not None:
        true = oriented_size(placed.box.size_mm, placed.orientation)
        sure = sure_part(placed.size_mm, true, profile.bearing_inset_mm)
        bearing = with_bearing(
            *bearing, model.boxes, placed.corner_mm, placed.size_mm,
            profile.support_tolerance_mm, sure,
        )  # fmt: skip
    return BinModel(
        model.source, '', np.concatenate((model.boxes, row)), columns, rows, height, owner,
        model.lines_x, model.lines_y, model.slack, model.passed_on, bearing,
    )  # fmt: skip


def _finished(model: BinModel, source: Bin, profile: Profile) -> BinModel:
    shape = (model.boxes, model.columns, model.rows, model.height)
    tolerance, step = profile.support_tolerance_mm, profile.resolution_mm
    slack, passed_on, blocked = _loads(source, profile)
    return BinModel(
        source, blocked, *shape, model.owner,
        _grid_lines(*shape, tolerance, step, 0), _grid_lines(*shape, tolerance, step, 1),
        slack, passed_on, model.bearing,
    )  # fmt: skip


def _loads(source: Bin, profile: Profile) -> tuple[NDArray[np.float64], NDArray[np.float64], str]:
    """Load each top can still take, how forces travel down the stack, and what is overloaded.

    A box hands its weight and all that stands on it to its supporters in proportion to the area
    they share with it. ``passed_on[k, j]`` is the part of a force on top k that reaches top j.
    """
    boxes = source.boxes
    if not profile.check_top_load or all(placed.box.max_top_load_n is None for placed in boxes):
        return np.empty(0), np.empty((0, 0)), ''
    passed_on = np.eye(len(boxes))
    load = np.zeros(len(boxes))
    for k in sorted(range(len(boxes)), key=lambda index: boxes[index].corner_mm[2]):
        areas = np.array([_shared_area(boxes[k], other, profile) for other in boxes])
        if areas.sum() > 0:
            below = areas @ passed_on / areas.sum()
            passed_on[k] += below
            load += boxes[k].box.weight_kg * GRAVITY * below
    limit = np.array(
        [math.inf if b.box.max_top_load_n is None else b.box.max_top_load_n for b in boxes]
    )
    slack = limit - load
    worst = int(np.argmin(slack))
    blocked = ''
    if slack[worst] < -1e-6:
        name = boxes[worst].box.id
        blocked = f'box {name!r} carries {load[worst]:.1f} N, {limit[worst]:g} N is its limit'
    return slack, passed_on, blocked


def _shared_area(upper: PlacedBox, lower: PlacedBox, profile: Profile) -> float:
    """Area in mm2 over which ``lower`` carries ``upper``; 0 when it does not."""
    gap = upper.corner_mm[2] - lower.top_mm
    if not 0 <= gap <= profile.support_tolerance_mm:
        return 0.0
    wide, deep = (
        min(upper.far_mm[axis], lower.far_mm[axis])
        - max(upper.corner_mm[axis], lower.corner_mm[axis])
        for axis in (0, 1)
    )
    return float(wide * deep) if wide > 0 and deep > 0 else 0.0
