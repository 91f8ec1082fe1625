"""Small line charts side by side, as one SVG file without any library."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

_COLUMNS = 3
_WIDTH, _HEIGHT = 300, 190
_LEFT, _TOP, _RIGHT, _BOTTOM = 44, 30, 14, 40
_INKS = ("#0b6e4f", "#c1440e", "#2b4c7e", "#7a5195")
_HEAD = 44


@dataclass(frozen=True, slots=True)
class Chart:
    """One chart.

    Attributes:
        title: Over it.
        unit: Of the horizontal axis.
        x: Values along it, rising.
        lines: Values of each line, by name, as many as ``x``.
    """

    title: str
    unit: str
    x: Sequence[float]
    lines: Mapping[str, Sequence[float]]


def draw_charts(charts: Sequence[Chart], title: str, y_label: str) -> str:
    """An SVG document with all charts to the same vertical scale, from 0."""
    top = max((value for chart in charts for line in chart.lines.values() for value in line), default=0.0)
    top = max(top, 1e-9) * 1.05
    rows = -(-len(charts) // _COLUMNS)
    width, height = _COLUMNS * _WIDTH, _HEAD + rows * _HEIGHT
    size = f'width="{width}" height="{height}"'
    box = f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} {box}>',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        _text(10, 18, title, size=14),
        *_legend(charts, y_label),
    ]
    for number, chart in enumerate(charts):
        x, y = number % _COLUMNS * _WIDTH, _HEAD + number // _COLUMNS * _HEIGHT
        parts.append(f'<g transform="translate({x} {y})">{"".join(_chart(chart, top))}</g>')
    return "\n".join([*parts, "</svg>", ""])


def _legend(charts: Sequence[Chart], y_label: str) -> list[str]:
    names = list(charts[0].lines) if charts else []
    parts = [_text(10, 36, y_label)]
    for number, name in enumerate(names):
        x = 320 + 150 * number
        parts.append(
            f'<line x1="{x}" y1="32" x2="{x + 22}" y2="32" stroke="{_ink(number)}" stroke-width="2"/>'
        )
        parts.append(_text(x + 28, 36, name))
    return parts


def _chart(chart: Chart, top: float) -> list[str]:
    low, high = chart.x[0], chart.x[-1]
    across, up = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _TOP - _BOTTOM
    parts = [
        _text(_LEFT, _TOP - 8, chart.title, size=12),
        f'<rect x="{_LEFT}" y="{_TOP}" width="{across}" height="{up}" fill="none" stroke="#999"/>',
        _text(_LEFT, _HEIGHT - 22, f"{low:g}"),
        _text(_WIDTH - _RIGHT, _HEIGHT - 22, f"{high:g}", anchor="end"),
        _text(_LEFT + across / 2, _HEIGHT - 22, chart.unit, anchor="middle"),
        _text(_LEFT - 4, _TOP + 8, f"{top:.3g}", anchor="end"),
        _text(_LEFT - 4, _TOP + up, "0", anchor="end"),
    ]
    for number, line in enumerate(chart.lines.values()):
        points = [
            (_LEFT + across * (x - low) / max(high - low, 1e-12), _TOP + up * (1 - y / top))
            for x, y in zip(chart.x, line, strict=True)
        ]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{_ink(number)}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{_ink(number)}"/>' for x, y in points]
    return parts


def _ink(number: int) -> str:
    return _INKS[number % len(_INKS)]


def _text(x: float, y: float, text: str, *, size: int = 11, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" text-anchor="{anchor}">{escape(text)}</text>'
