"""Plane geometry for the support rules: rectangles, convex hull, distance to its edge."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

Rect = tuple[float, float, float, float]
Point = tuple[float, float]
#: Corners, counter-clockwise.
Polygon = list[Point]


def overlap(a: Rect, b: Rect) -> Rect | None:
    """Rectangle that ``a`` and ``b`` (x0, y0, x1, y1) share, ``None`` if they share no area."""
    x0, y0 = max(a[0], b[0]), max(a[1], b[1])
    x1, y1 = min(a[2], b[2]), min(a[3], b[3])
    return (x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None


def convex_hull(points: Iterable[Point]) -> Polygon:
    """Corners of the convex hull, counter-clockwise, by Andrew's monotone chain (1979)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered

    def half(run: Iterable[Point]) -> list[Point]:
        chain: list[Point] = []
        for p in run:
            while len(chain) >= 2 and _cross(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        return chain

    lower, upper = half(ordered), half(reversed(ordered))
    return lower[:-1] + upper[:-1]


def _cross(o: Point, a: Point, b: Point) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def distance_inside(polygon: Sequence[Point], point: Point) -> float:
    """Signed distance of ``point`` from the boundary of a convex ``polygon``, positive inside.

    ``polygon`` is counter-clockwise with at least three corners.
    """
    return min(
        _cross(a, b, point) / math.dist(a, b)
        for a, b in zip(polygon, (*polygon[1:], polygon[0]), strict=True)
    )


def area(polygon: Sequence[Point]) -> float:
    """Area of a polygon, positive when its corners go counter-clockwise."""
    return (
        sum(
            a[0] * b[1] - b[0] * a[1]
            for a, b in zip(polygon, (*polygon[1:], *polygon[:1]), strict=True)
        )
        / 2
    )


def clipped(polygon: Sequence[Point], rect: Rect) -> Polygon:
    """Corners of the part of a convex ``polygon`` that lies in ``rect`` (x0, y0, x1, y1).

    One side of the rectangle after the other.

    >>> clipped([(0, 0), (4, 0), (0, 4)], (1, 1, 9, 9))
    [(3.0, 1.0), (1.0, 3.0), (1.0, 1.0)]
    """
    x0, y0, x1, y1 = rect
    corners = list(polygon)
    for normal, limit in (((1, 0), x0), ((-1, 0), -x1), ((0, 1), y0), ((0, -1), -y1)):
        corners = beyond(corners, normal, limit)
    return corners


def beyond(polygon: Sequence[Point], normal: Point, limit: float) -> Polygon:
    """Corners of the part of a convex ``polygon`` whose points times ``normal`` reach ``limit``.

    One step of Sutherland and Hodgman (1974).

    >>> beyond([(0, 0), (4, 0), (0, 4)], (1, 0), 2)
    [(2.0, 0.0), (4, 0), (2.0, 2.0)]
    """
    nx, ny = normal
    kept: Polygon = []
    for a, b in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        inside_a, inside_b = nx * a[0] + ny * a[1] - limit, nx * b[0] + ny * b[1] - limit
        if inside_a >= 0:
            kept.append(a)
        if inside_a * inside_b < 0:
            share = inside_a / (inside_a - inside_b)
            kept.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
    return kept


def hull_distance(rects: Iterable[Rect], point: Point) -> float:
    """Signed distance of ``point`` from the hull's boundary, positive inside.

    The hull is that of all corners of ``rects``. Without area it is negative infinity.

    >>> hull_distance([(0, 0, 10, 10)], (5, 3))
    3.0
    """
    hull = convex_hull(
        (x, y) for x0, y0, x1, y1 in rects for x, y in ((x0, y0), (x1, y0), (x0, y1), (x1, y1))
    )
    return distance_inside(hull, point) if len(hull) > 2 else -math.inf
