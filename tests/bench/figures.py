"""How a benchmark prints: each figure beside its goal."""

from __future__ import annotations


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
