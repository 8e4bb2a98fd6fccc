"""Plane geometry for the support rules: rectangles, convex hull, distance to its edge."""

from __future__ import annotations

import math
from collections.abc import Iterable

Rect = tuple[float, float, float, float]
Point = tuple[float, float]


def overlap(a: Rect, b: Rect) -> Rect | None:
    """Rectangle that ``a`` and ``b`` (x0, y0, x1, y1) share, ``None`` if they share no area."""
    x0, y0 = max(a[0], b[0]), max(a[1], b[1])
    x1, y1 = min(a[2], b[2]), min(a[3], b[3])
    return (x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None


def convex_hull(points: Iterable[Point]) -> list[Point]:
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


def hull_distance(rects: Iterable[Rect], point: Point) -> float:
    """Signed distance of ``point`` from the hull's boundary, positive inside.

    The hull is that of all corners of ``rects``. Without area it is negative infinity.

    >>> hull_distance([(0, 0, 10, 10)], (5, 3))
    3.0
    """
    hull = convex_hull(
        (x, y) for x0, y0, x1, y1 in rects for x, y in ((x0, y0), (x1, y0), (x0, y1), (x1, y1))
    )
    if len(hull) < 3:
        return -math.inf
    return min(
        _cross(a, b, point) / math.dist(a, b)
        for a, b in zip(hull, hull[1:] + hull[:1], strict=True)
    )
