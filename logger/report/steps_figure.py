"""A number that falls from step to step, as SVG text: a point and a word for each step."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from textwrap import wrap

from logger.report.figures import nice_ticks

WIDTH, HEIGHT = 1000, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 110, 26, 62
_ABOUT, _LINE_PX, _LETTER_PX, _MOST_LINES = 5, 15, 7.0, 3


@dataclass(frozen=True)
class Steps:
    """What is drawn: words and a value (0 or more) per step, at least one; ``level``: a value that has a name, drawn
    across."""

    title: str
    unit: str
    values: tuple[tuple[str, float], ...]
    level: tuple[float, str] | None = None


def steps_figure(one: Steps) -> str:
    """The figure element."""
    highest = max([value for _, value in one.values] + ([one.level[0]] if one.level else [])) or 1.0
    ticks = nice_ticks(highest * 1.1, _ABOUT)
    top = max(highest * 1.1, ticks[-1])
    apart = (WIDTH - _LEFT - _RIGHT) / len(one.values)

    def x(index: int) -> float:
        return _LEFT + apart * (index + 0.5)

    def y(value: float) -> float:
        return _TOP + (HEIGHT - _TOP - _BOTTOM) * (1 - value / top)

    parts = [f'<path class="grid" d="M{_LEFT} {y(tick):.1f}H{WIDTH - _RIGHT}"/>'
             f'<text class="tick" x="{_LEFT - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>'
             for tick in ticks]
    if one.level is not None:
        at = y(one.level[0])
        parts.append(f'<path class="thick s3" d="M{_LEFT} {at:.1f}H{WIDTH - _RIGHT}" stroke-dasharray="6 5"/>'
                     f'<text class="tick" x="{WIDTH - _RIGHT + 6}" y="{at + 4:.1f}">{escape(one.level[1])}</text>')
    points = " ".join(f"{x(index):.1f} {y(value):.1f}" for index, (_, value) in enumerate(one.values))
    if len(one.values) > 1:
        parts.append(f'<path class="thick s0" d="M{points}"/>')
    for index, (words, value) in enumerate(one.values):
        parts.append(f'<circle class="dot" cx="{x(index):.1f}" cy="{y(value):.1f}" r="5" style="fill:var(--c0)"/>'
                     f'<text class="tick" x="{x(index):.1f}" y="{y(value) - 10:.1f}" text-anchor="middle">{value:.3f}'
                     "</text>")
        for number, line in enumerate(wrap(words, max(8, int(apart / _LETTER_PX)))[:_MOST_LINES]):
            parts.append(f'<text class="tick" x="{x(index):.1f}" y="{HEIGHT - _BOTTOM + 18 + _LINE_PX * number}" '
                         f'text-anchor="middle">{escape(line)}</text>')
    parts.append(f'<text class="tick" x="{_LEFT}" y="{_TOP - 10}">{escape(one.unit)}</text>')
    return (f'<figure><figcaption>{escape(one.title)}</figcaption><svg class="plot" viewBox="0 0 {WIDTH} {HEIGHT}" '
            f'role="img" aria-label="{escape(one.title)}">{"".join(parts)}</svg></figure>')
