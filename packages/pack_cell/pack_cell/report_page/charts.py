"""Charts as SVG that stand in a page: they follow its colours, light, dark and on paper.

Matplotlib draws text as outlines, 100 kB a chart and black on white; libraries that draw in the
browser weigh megabytes. These few kinds of marks are all that the report needs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from markupsafe import Markup

#: More marks than this look the same as a part of them.
MOST_MARKS = 2000
#: Space around the drawing area: left, top, right, bottom.
_LEFT, _TOP, _RIGHT, _BOTTOM = 58, 14, 14, 40


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers from ``low`` to ``high``, about ``count`` of them.

    >>> ticks(0, 100)
    [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]
    """
    span = high - low
    if span <= 0:
        return [low]
    rough = span / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [round(n * step, 10) for n in range(first, math.floor(high / step + 1e-9) + 1)]


def _decades(low: float, high: float) -> list[float]:
    return [10.0**n for n in range(math.ceil(math.log10(low)), math.floor(math.log10(high)) + 1)]


def thinned(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points, or of many the highest of each stretch, so that no peak is hidden."""
    stretch = math.ceil(len(points) / MOST_MARKS)
    if stretch <= 1:
        return list(points)
    parts = (points[at : at + stretch] for at in range(0, len(points), stretch))
    return [max(part, key=lambda point: point[1]) for part in parts]


@dataclass(frozen=True)
class Plot:
    """A drawing area with axes: ranges of x and y, what they are, and the size in pixels."""

    x_range: tuple[float, float]
    y_range: tuple[float, float]
    x_label: str
    y_label: str = ''
    width: int = 720
    height: int = 250
    log_y: bool = False
    left: int = _LEFT
    whole_x: bool = False

    def x(self, value: float) -> float:
        """Pixel of a value."""
        low, high = self.x_range
        share = (value - low) / ((high - low) or 1.0)
        return self.left + share * (self.width - self.left - _RIGHT)

    def y(self, value: float) -> float:
        """Pixel of a value."""
        low, high = self.y_range
        if self.log_y:
            low, high, value = math.log10(low), math.log10(high), math.log10(max(value, low))
        share = (value - low) / ((high - low) or 1.0)
        return self.height - _BOTTOM - share * (self.height - _TOP - _BOTTOM)

    def line(self, points: Iterable[tuple[float, float]], style: str, told: str = '') -> Markup:
        """A line through ``points``; ``told`` shows when one points at it."""
        path = 'L'.join(f'{self.x(x):.1f} {self.y(y):.1f}' for x, y in points)
        return Markup('<path class="line {}" d="M{}">{}</path>').format(style, path, _told(told))

    def dots(self, points: Sequence[tuple[float, float]], style: str) -> Markup:
        """A dot for each of ``points``."""
        path = ''.join(f'M{self.x(x):.1f} {self.y(y):.1f}h0' for x, y in thinned(points))
        return Markup('<path class="dots {}" d="{}"/>').format(style, path)

    def rule(self, value: float, text: str) -> Markup:
        """A horizontal line with ``text`` at its right end."""
        y, right = round(self.y(value), 1), self.width - _RIGHT
        return Markup(
            '<path class="rule" d="M{} {}H{}"/><text class="ruled" x="{}" y="{}">{}</text>'
        ).format(self.left, y, right, right, round(y - 5, 1), text)

    def bar(
        self, x_from: float, x_to: float, y: float, height: float, style: str, told: str = ''
    ) -> Markup:
        """A horizontal bar around ``y``, ``height`` pixels high and at least one wide."""
        left, right = self.x(x_from), self.x(x_to)
        return Markup(
            '<rect class="bar {}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}">{}</rect>'
        ).format(style, left, self.y(y) - height / 2, max(1.0, right - left), height, _told(told))

    def label(self, x: float, y: float, text: str, anchor: str = 'start') -> Markup:
        """A text at pixel ``x`` beside the value ``y``."""
        return Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>').format(
            x, self.y(y) + 4, anchor, text
        )

    def svg(self, marks: Iterable[Markup], what: str) -> Markup:
        """The whole: axes and ``marks``; ``what`` it shows is read out to who cannot see it."""
        return Markup(
            '<div class="chart"><svg viewBox="0 0 {} {}" role="img" aria-label="{}">{}{}</svg>'
            '</div>'
        ).format(self.width, self.height, what, self._axes(), Markup('').join(marks))

    def _axes(self) -> Markup:
        bottom, right = self.height - _BOTTOM, self.width - _RIGHT
        parts = []
        values = []
        if self.y_label:
            values = _decades(*self.y_range) if self.log_y else ticks(*self.y_range)
        for value in values:
            y = round(self.y(value), 1)
            parts.append(
                Markup(
                    '<path class="grid" d="M{} {}H{}"/>'
                    '<text x="{}" y="{}" text-anchor="end">{}</text>'
                ).format(self.left, y, right, self.left - 7, y + 4, f'{value:g}')
            )
        for value in ticks(*self.x_range, count=8):
            if self.whole_x and value != int(value):
                continue
            parts.append(
                Markup('<text x="{:.1f}" y="{}" text-anchor="middle">{}</text>').format(
                    self.x(value), bottom + 17, f'{value:g}'
                )
            )
        parts.append(Markup('<path class="axis" d="M{} {}H{}"/>').format(self.left, bottom, right))
        parts.append(
            Markup('<text class="axis-label" x="{}" y="{}" text-anchor="end">{}</text>').format(
                right, self.height - 5, self.x_label
            )
        )
        if self.y_label:
            middle = round((bottom + _TOP) / 2)
            parts.append(
                Markup(
                    '<text class="axis-label" transform="translate(13 {}) rotate(-90)" '
                    'text-anchor="middle">{}</text>'
                ).format(middle, self.y_label)
            )
        return Markup('').join(parts)


def _told(text: str) -> Markup:
    return Markup('<title>{}</title>').format(text) if text else Markup('')


def legend(names: Sequence[tuple[str, str]]) -> Markup:
    """What the colours mean: style and text of each."""
    keys = (
        Markup('<span class="key"><i class="{}"></i>{}</span>').format(style, text)
        for style, text in names
    )
    return Markup('<div class="legend">{}</div>').format(Markup('').join(keys))


def shares(rows: Sequence[tuple[str, int]], whole: int) -> Markup:
    """Counts as bars with their names, the longest first, each by its share of ``whole``."""
    lines = (
        Markup(
            '<tr><td class="text">{}</td><td>{}</td><td>{}</td>'
            '<td class="text share"><i style="width:{:.1f}%"></i></td></tr>'
        ).format(name, count, f'{100 * count / whole:.1f} %', 100 * count / whole)
        for name, count in sorted(rows, key=lambda row: -row[1])
    )
    return Markup('<table class="shares">{}</table>').format(Markup('').join(lines))
