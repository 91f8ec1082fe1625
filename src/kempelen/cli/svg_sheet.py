"""Drawings to scale as SVG files: panels with axes in millimetres, lines, coloured cells."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from kempelen.core.geometry import Array

INKS = ("#0b6e4f", "#c1440e", "#2b4c7e", "#7a5195")
_MARGIN, _HEAD = 52.0, 34.0
_TICKS = 5


@dataclass
class Panel:
    """One drawing: data coordinates in mm, y upwards.

    Attributes:
        title: Over it.
        x: Ends of the horizontal axis.
        y: Ends of the vertical axis.
        across: Name of the horizontal axis.
        upwards: Name of the vertical one.
        width: Of the drawing, pixels; the height follows from the scale, which is the same both ways.
        height: Only where both ways have scales of their own, pixels.
    """

    title: str
    x: tuple[float, float]
    y: tuple[float, float]
    across: str = "mm"
    upwards: str = "mm"
    width: float = 360.0
    height: float = 0.0
    _parts: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.height = self.height or self.width * (self.y[1] - self.y[0]) / (self.x[1] - self.x[0])

    def line(self, points: npt.ArrayLike, ink: str, *, width: float = 1.6, dash: str = "") -> None:
        """A line through (k, 2) points; gaps where they are NaN."""
        rows = np.asarray(points, dtype=np.float64)
        for run in _runs(rows):
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(self._at, run))
            dashes = f' stroke-dasharray="{dash}"' if dash else ""
            self._parts.append(
                f'<polyline points="{path}" fill="none" stroke="{ink}" stroke-width="{width:g}"{dashes}/>'
            )

    def cell(
        self, low: Sequence[float] | Array, high: Sequence[float] | Array, fill: str, told: str = ""
    ) -> None:
        """A rectangle between two corners, with a word in its middle."""
        (x0, y1), (x1, y0) = self._at(low), self._at(high)
        self._parts.append(
            f'<rect x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}" height="{y1 - y0:.1f}" fill="{fill}"/>'
        )
        if told:
            self._parts.append(_text((x0 + x1) / 2, (y0 + y1) / 2 + 4, told, anchor="middle", size=10))

    def dot(self, point: Sequence[float] | Array, ink: str, told: str = "") -> None:
        """A dot with a word beside it."""
        x, y = self._at(point)
        self._parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{ink}"/>')
        if told:
            right = x > _MARGIN + self.width / 2  # so that the word stays inside
            self._parts.append(
                _text(x - 6 if right else x + 6, y - 6, told, anchor="end" if right else "start")
            )

    def drawn(self) -> str:
        """Its SVG, the axes' corner at (_MARGIN, _HEAD)."""
        box = (
            f'<rect x="{_MARGIN}" y="{_HEAD}" width="{self.width:g}" height="{self.height:g}" fill="none" '
            'stroke="#999"/>'
        )
        return "".join([_text(_MARGIN, _HEAD - 10, self.title, size=13), *self._parts, box, *self._axes()])

    @property
    def size(self) -> tuple[float, float]:
        """With its margins, pixels."""
        return self.width + 1.5 * _MARGIN, self.height + _HEAD + _MARGIN

    def _axes(self) -> list[str]:
        foot = _HEAD + self.height
        parts = [_text(_MARGIN + self.width / 2, foot + 34, self.across, anchor="middle")]
        middle = f"{_HEAD + self.height / 2:.1f}"
        name = _text(0, 0, self.upwards, anchor="middle")
        parts.append(f'<g transform="translate(12 {middle}) rotate(-90)">{name}</g>')
        for value in _ticks(*self.x):
            parts += [_text(self._at((value, 0))[0], foot + 16, f"{value:g}", anchor="middle")]
        for value in _ticks(*self.y):
            parts += [_text(_MARGIN - 5, self._at((0, value))[1] + 4, f"{value:g}", anchor="end")]
        return parts

    def _at(self, point: Sequence[float] | Array) -> tuple[float, float]:
        x = _MARGIN + self.width * (point[0] - self.x[0]) / (self.x[1] - self.x[0])
        y = _HEAD + self.height * (self.y[1] - point[1]) / (self.y[1] - self.y[0])
        return float(x), float(y)


def sheet(title: str, panels: Sequence[Panel], legend: Sequence[tuple[str, str]] = ()) -> str:
    """An SVG document with panels side by side under a title, and words with their inks."""
    width = max(sum(panel.size[0] for panel in panels), 8.0 * len(title))
    height = max(panel.size[1] for panel in panels) + 50
    box = f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="11"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" {box}>',
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>',
        _text(10, 20, title, size=15),
    ]
    at = 10.0
    for word, ink in legend:
        parts.append(
            f'<rect x="{at:g}" y="30" width="14" height="8" fill="{ink}"/>{_text(at + 18, 38, word)}'
        )
        at += 34 + 6.2 * len(word)
    left = 0.0
    for panel in panels:
        parts.append(f'<g transform="translate({left:.1f} 44)">{panel.drawn()}</g>')
        left += panel.size[0]
    return "\n".join([*parts, "</svg>", ""])


def shade(share: float) -> str:
    """From green at 0 by yellow to red at 1; grey where it is not a number."""
    if not np.isfinite(share):
        return "#e2e2e2"
    share = min(max(share, 0.0), 1.0)
    stops = ((120, 190, 130), (245, 225, 120), (215, 95, 70))
    low, part = (0, 2 * share) if share < 0.5 else (1, 2 * share - 1)  # noqa: PLR2004 - the middle
    mixed = (round(a + (b - a) * part) for a, b in zip(stops[low], stops[low + 1], strict=True))
    return "#" + "".join(f"{one:02x}" for one in mixed)


def _runs(rows: Array) -> list[Array]:
    breaks = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    return [
        run
        for run in np.split(rows, breaks)
        if np.isfinite(run).all(axis=1).sum() > 1
        for run in [_whole(run)]
    ]


def _whole(run: Array) -> Array:
    return run[np.isfinite(run).all(axis=1)]


def _ticks(low: float, high: float) -> list[float]:
    raw = (high - low) / _TICKS
    size = 10.0 ** np.floor(np.log10(raw))
    step = size * min((one for one in (1, 2, 5, 10) if one * size >= raw), default=10)
    # + 0: no minus before the 0
    return [float(value) + 0.0 for value in np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step]


def _text(x: float, y: float, text: str, *, size: int = 11, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}">{escape(text)}</text>'
