"""How a benchmark prints: each figure beside its goal."""

from __future__ import annotations

import re

_LINE = re.compile(r"(\S.*?) {2,}(\S+)(?: (\S*))? +(goal: .*?) +(met|MISSED)")


class Figures:
    """Collects and prints figures; ``missed`` counts goals that were not met."""

    def __init__(self) -> None:
        self.missed = 0

    def at_most(self, name: str, value: float, goal: float, unit: str) -> None:
        """A figure that should be small."""
        self._print(name, value, f"goal: at most {goal:g}", unit, value <= goal)

    def at_least(self, name: str, value: float, goal: float, unit: str) -> None:
        """A figure that should be large."""
        self._print(name, value, f"goal: at least {goal:g}", unit, value >= goal)

    def _print(self, name: str, value: float, goal: str, unit: str, met: bool) -> None:
        self.missed += not met
        print(f"{name:48s} {value:10.4g} {unit:6s} {goal:22s} {'met' if met else 'MISSED'}", flush=True)


def read_figures(text: str) -> list[tuple[str, str, str, bool]]:
    """What ``Figures`` has printed: names, values with units, goals, and whether they were met."""
    lines = (_LINE.fullmatch(line.strip()) for line in text.splitlines())
    return [(line[1], f"{line[2]} {line[3] or ''}".strip(), line[4].removeprefix("goal: "), line[5] == "met")
            for line in lines if line]
