"""A bin as a work order: in which order what goes where, which way up, with a picture per layer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from pack_cell.report_page.run_folder import InBin, RunBin
from pack_msgs_py.orientation import way_up
from pack_msgs_py.values import Walls

#: A box stands on those whose tops are at most this far above its bottom, millimetres.
LAYER_TOLERANCE_MM = 15
#: Width of the picture of a layer, pixels.
_WIDTH = 250


@dataclass(frozen=True)
class PackingStep:
    """One line of a work order: a box, the layer that it belongs to, and how it is turned."""

    placed: InBin
    layer: int
    turned: str


@dataclass(frozen=True)
class PackingLayer:
    """The boxes that stand on boxes of the layer below, the first on the floor; with a picture."""

    number: int
    steps: tuple[int, ...]
    picture: Markup


def layers_of(boxes: Sequence[InBin]) -> list[int]:
    """The layer of each box: 1 on the floor, else one more than the highest that it lies on."""
    layers: list[int] = []
    for at, placed in enumerate(boxes):
        below = [
            layers[other]
            for other in range(at)
            if _overlap(boxes[other], placed)
            and _top_mm(boxes[other]) <= placed.corner_mm[2] + LAYER_TOLERANCE_MM
        ]
        layers.append(1 + max(below, default=0))
    return layers


def _top_mm(placed: InBin) -> float:
    return placed.corner_mm[2] + placed.size_mm[2]


def _overlap(one: InBin, other: InBin) -> bool:
    """Whether one stands above the other, seen from above."""
    return all(
        one.corner_mm[axis] < other.corner_mm[axis] + other.size_mm[axis]
        and other.corner_mm[axis] < one.corner_mm[axis] + one.size_mm[axis]
        for axis in (0, 1)
    )


def packing_steps(of_run: RunBin) -> list[PackingStep]:
    """The lines of the work order, in the order of placing."""
    return [
        PackingStep(placed, layer, way_up(placed.box.orientation))
        for placed, layer in zip(of_run.boxes, layers_of(of_run.boxes), strict=True)
    ]


def packing_layers(of_run: RunBin, steps: Sequence[PackingStep]) -> list[PackingLayer]:
    """The layers from the floor up, each seen from above with the layers below in grey."""
    layers = []
    for number in range(1, max((step.layer for step in steps), default=0) + 1):
        own = [step.placed for step in steps if step.layer == number]
        below = [step.placed for step in steps if step.layer < number]
        picture = _picture(of_run, own, below, number)
        layers.append(PackingLayer(number, tuple(placed.step for placed in own), picture))
    return layers


def _picture(of_run: RunBin, own: Sequence[InBin], below: Sequence[InBin], layer: int) -> Markup:
    """Seen from above with the side that one packs from at the bottom; a dot marks the origin."""
    length, breadth, _ = of_run.spec.size_mm
    scale = _WIDTH / length
    cage = of_run.spec.walls is Walls.OPEN_FRONT

    def rectangle(placed: InBin) -> tuple[float, float, float, float]:
        (x, y, _), (dx, dy, _) = placed.corner_mm, placed.size_mm
        # Of a cage the origin is at the back wall: from its open front all is turned by half.
        left, top = (length - x - dx, y) if cage else (x, breadth - y - dy)
        return scale * left, scale * top, scale * dx, scale * dy

    height = scale * breadth
    parts = [
        Markup('<rect class="floor" width="{}" height="{:.1f}"/>').format(_WIDTH, height),
        *(_rectangle('under', *rectangle(placed)) for placed in below),
    ]
    for placed in own:
        x, y, dx, dy = rectangle(placed)
        parts.append(_rectangle('box', x, y, dx, dy))
        size = min(16.0, 0.55 * dx, 0.75 * dy)
        parts.append(
            Markup('<text x="{:.1f}" y="{:.1f}" font-size="{:.1f}">{}</text>').format(
                x + dx / 2, y + dy / 2 + 0.36 * size, size, placed.step
            )
        )
    rim = Markup('<rect class="rim" width="{}" height="{:.1f}"/>').format(_WIDTH, height)
    dot_x, dot_y = (_WIDTH, 0.0) if cage else (0.0, height)
    dot = Markup('<circle class="origin" cx="{:.1f}" cy="{:.1f}" r="5"/>').format(dot_x, dot_y)
    what = f'layer {layer} from above: steps {", ".join(str(placed.step) for placed in own)}'
    return Markup(
        '<svg class="layer" viewBox="-6 -6 {} {:.0f}" role="img" aria-label="{}">{}</svg>'
    ).format(_WIDTH + 12, height + 12, what, Markup('').join([*parts, rim, dot]))


def _rectangle(style: str, x: float, y: float, dx: float, dy: float) -> Markup:
    return Markup('<rect class="{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>').format(
        style, x, y, dx, dy
    )


def scene(of_run: RunBin) -> dict[str, object]:
    """What the 3D picture needs: size and walls of the bin, and its boxes in order of placing.

    A box is its name, corner and edges in millimetres along the bin's axes, where it was measured.
    """
    return {
        'name': of_run.name,
        'size': of_run.spec.size_mm,
        'walls': of_run.spec.walls.value,
        'boxes': [
            [placed.box.id, *(round(v) for v in (*placed.seen_mm, *placed.size_mm))]
            for placed in of_run.boxes
        ],
    }
