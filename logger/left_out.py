"""What a command did not use of what it was given: how much, and why, in one form for all of them."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from logger.printable import counted

_LEAST_S = 2.0
"""A drive's first and last second lie beside no fix, and nobody asks for them."""


@dataclass(frozen=True)
class LeftOut:
    """``amount`` of seconds (``unit`` "s") or of things that are counted ("row", "line", "sample"), and ``why``."""

    amount: float
    unit: str
    why: str

    @property
    def words(self) -> str:
        """Such as ``38 s without a fix``."""
        said = f"{self.amount:.3g} s" if self.unit == "s" else counted(round(self.amount), self.unit)
        return f"{said} {self.why}"


def counting(found: Iterable[LeftOut]) -> tuple[LeftOut, ...]:
    """Those of some amount; the same reason but once."""
    sums: dict[tuple[str, str], float] = {}
    for one in found:
        sums[one.unit, one.why] = sums.get((one.unit, one.why), 0.0) + one.amount
    return tuple(LeftOut(amount, unit, why) for (unit, why), amount in sums.items()
                 if amount >= (_LEAST_S if unit == "s" else 1.0))


def left_out_json(found: Iterable[LeftOut]) -> dict[str, list[dict[str, Any]]]:
    """The field ``left_out`` of every command's JSON: ``[{"amount", "unit", "why"}]``, empty where all was used."""
    return {"left_out": [asdict(one) for one in counting(found)]}


def left_out_lines(found: Iterable[LeftOut]) -> list[str]:
    """One line, or none where all was used."""
    there = counting(found)
    return [f"Not used: {'; '.join(one.words for one in there)}."] if there else []
