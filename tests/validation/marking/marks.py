"""Answers marked: what was right, by the rules that were set before.

A record is one line of the results (``sitting``). The rules: an effect counts as named when it stands in the verdict,
or is said to be what these runs cannot tell from one that does. A number counts as right within 10 % (of what differs
from 1, where 1 means nothing) or within three of its standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any

from ..cases.visibility import UNSEEN

Record = Mapping[str, Any]

NEAR = 1.1
"""An error after adding up to so many times the noise floor is near to it."""
_SHARE, _DEVIATIONS = 0.10, 3.0
_FROM_ONE = ("gain", "scale", "rebound_to_bump_ratio")
_NAME_ONLY = ("roll",)  # what is linear moves a sensor on the centre line alike for any track width
_BY_NOW = {"bushing_hysteresis": "hysteresis", "quadratic_damping": "orifice_damping", "trailer": "occupant"}
CLASSES = (("below 1", 0.0, 1.0), ("1 to 3", 1.0, 3.0), ("above 3", 3.0, float("inf")))

NOTHING, UNEXPLAINED, FAILED = "nothing", "unexplained", "no answer"


# --- one case -------------------------------------------------------------------------------------------------------

def hidden(record: Record) -> list[Record]:
    """What was hidden, on the list or not."""
    return [*record["truth"]["effects"], *record["truth"]["outsiders"]]


def strength(record: Record) -> float:
    """Of the weakest that was hidden; infinite where nothing was."""
    return min((one["strength"] for one in hidden(record)), default=float("inf"))


def unseen(record: Record) -> bool:
    """Whether the weakest that was hidden is within what the car's numbers and the distance may be off by."""
    return min(record["left"], default=float("inf")) < UNSEEN


def verdict(record: Record) -> list[str]:
    """The names that were said, the first one first."""
    return list(record["said"]["verdict"]) if record["said"] else []


def rivals(record: Record, name: str) -> list[str]:
    """What was said to look just like an effect of the verdict."""
    return next((one["confused_with"] for one in record["said"]["candidates"] if one["effect"] == name), [])


def first_right(record: Record) -> bool:
    """The effect stands first, or is named as not distinguishable from the first."""
    names, wanted = verdict(record), record["truth"]["effects"][0]["name"]
    return bool(names) and wanted in (names[0], *rivals(record, names[0]))


def by_confusion(record: Record) -> bool:
    """The effect does not stand first, but is named as not distinguishable from the first."""
    return first_right(record) and verdict(record)[0] != record["truth"]["effects"][0]["name"]


def all_named(record: Record) -> bool:
    """Every effect of the list that was hidden is named, each by an answer of its own."""
    wanted = [one["name"] for one in record["truth"]["effects"]]
    answers = [(name, *rivals(record, name)) for name in verdict(record)]
    return _matched(wanted, answers)


def _matched(wanted: Sequence[str], answers: Sequence[Sequence[str]]) -> bool:
    if not wanted:
        return True
    return any(wanted[0] in answer and _matched(wanted[1:], [*answers[:i], *answers[i + 1:]])
               for i, answer in enumerate(answers))


def all_found(record: Record) -> bool:
    """Every effect of the list that was hidden stands in the verdict itself, so that its numbers can be judged."""
    return all(one["name"] in verdict(record) for one in record["truth"]["effects"])


def unexplained(record: Record) -> bool:
    """Something that no candidate explains was said to be there."""
    return bool(record["said"] and record["said"]["unexplained"])


def off_list_seen(record: Record) -> bool:
    """What is off the list was said to be there: as something that no candidate explains, by the effect of the list
    that it is by now or, where it is one of them in one axle alone, by that name at an axle."""
    akin = {name for one in record["truth"]["outsiders"] for name in one["akin"]}
    by_now = {_BY_NOW.get(one["name"]) for one in record["truth"]["outsiders"]}
    return unexplained(record) or bool(by_now & set(verdict(record))) or any(
        one["effect"] in akin & set(verdict(record)) and one["parameters"].get("axle")
        for one in (record["said"] or {"candidates": ()})["candidates"])


def alarm(record: Record) -> bool:
    """Anything was said to be missing, or nothing was said at all."""
    return record["said"] is None or bool(verdict(record)) or unexplained(record)


def said(record: Record) -> str:
    """What was said, in words."""
    if record["said"] is None:
        return f"{FAILED}: {record['failed']}"
    names = [name + (f" (or {', '.join(rivals(record, name))})" if rivals(record, name) else "")
             for name in verdict(record)]
    return ", ".join([*names, *([UNEXPLAINED] if unexplained(record) else [])]) or NOTHING


def first_said(record: Record) -> str:
    """The column of the confusion matrix: the first name; for what is off the list, whether it was unexplained."""
    if record["said"] is None:
        return FAILED
    if unexplained(record) and (record["truth"]["outsiders"] or not verdict(record)):
        return UNEXPLAINED
    return verdict(record)[0] if verdict(record) else NOTHING


def right_on_wandering(record: Record) -> bool:
    """Where the distance wanders: the effect first, or nothing said where nothing is missing; and all explained."""
    if not record["truth"]["effects"]:
        return not alarm(record)
    return first_right(record) and not unexplained(record)


def right(record: Record) -> bool:
    """The answer that its kind asks for."""
    kinds: dict[str, Callable[[Record], bool]] = {
        "none": lambda one: not alarm(one), "one": first_right, "two": all_named, "three": all_named,
        "outsider": off_list_seen, "two_outsider": off_list_seen, "wandering": right_on_wandering,
    }
    return kinds[record["kind"]](record)


# --- numbers --------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Number:
    """A number of an effect: as it was hidden and as it was found, with its standard error where one was given."""

    effect: str
    name: str
    true: float
    found: float | None
    standard_error: float | None

    @property
    def right(self) -> bool:
        """Within a tenth, or within three standard errors."""
        if self.found is None:
            return False
        size = abs(self.true - 1) if self.name in _FROM_ONE else abs(self.true)
        off = abs(self.found - self.true)
        known = self.standard_error is not None and isfinite(self.standard_error)
        return off <= _SHARE * size or (known and off <= _DEVIATIONS * self.standard_error)

    @property
    def words(self) -> str:
        """Found beside hidden."""
        found = "not there" if self.found is None else f"{self.found:.4g}"
        error = "" if self.standard_error is None else f" ± {self.standard_error:.2g}"
        return f"{self.effect} {self.name} {found}{error}, hidden {self.true:.4g}"


def numbers(record: Record) -> Iterator[Number]:
    """Of all effects of the list that were hidden, as they were after adding."""
    added = record["added"]["effects"] if record["added"] else []
    found = {one["name"]: one for one in added}
    for one in record["truth"]["effects"]:
        if one["name"] not in _NAME_ONLY:
            there = found.get(one["name"], {})
            for name, true in one["parameters"].items():
                yield Number(one["name"], name, true, there.get(name), there.get("standard_errors", {}).get(name))


def numbers_right(record: Record) -> bool:
    """All effects of the list stand in the verdict, and their numbers are right."""
    return all_found(record) and record["added"] is not None and all(one.right for one in numbers(record))


def above(record: Record, floor: str) -> float:
    """The error after adding over ``noise_floor_error`` or ``attainable_error``; infinite where nothing was added."""
    return record["added"]["error_after"] / record["truth"][floor] if record["added"] else float("inf")


def near(record: Record, floor: str = "noise_floor_error") -> bool:
    """The error after adding is within a tenth of a floor."""
    return above(record, floor) <= NEAR


# --- all cases ------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Share:
    """How many of how many."""

    count: int
    of: int

    @property
    def value(self) -> float:
        return self.count / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Where the true share lies with 95 % (E. B. Wilson 1927)."""
        z, n = 1.96, max(self.of, 1)
        middle = (self.value + z**2 / (2 * n)) / (1 + z**2 / n)
        half = z / (1 + z**2 / n) * sqrt(self.value * (1 - self.value) / n + z**2 / (4 * n**2))
        return max(0.0, middle - half), min(1.0, middle + half)


def share(records: Sequence[Record], holds: Callable[[Record], bool]) -> Share:
    """Of those records for which something holds."""
    return Share(sum(map(holds, records)), len(records))


@dataclass(frozen=True)
class Goal:
    """What is to be reached, and what was: at least or at most so large a share."""

    name: str
    goal: float
    at_least: bool
    found: Share

    @property
    def met(self) -> bool:
        value = self.found.value
        return value >= self.goal if self.at_least else value <= self.goal

    @property
    def wanted(self) -> str:
        return f"{'≥' if self.at_least else '≤'} {self.goal:.0%}"

    @property
    def verdict(self) -> str:
        """In a word; nothing where no case was asked."""
        return ("met" if self.met else "**missed**") if self.found.of else ""


def of_kind(records: Sequence[Record], *kinds: str) -> list[Record]:
    return [one for one in records if one["kind"] in kinds]


def goals(records: Sequence[Record]) -> list[Goal]:
    """All that are shares of cases."""
    one, listed = of_kind(records, "one"), of_kind(records, "one", "two")
    others = of_kind(records, "none", "one", "two", "three")
    found = [record for record in listed if all_found(record)]
    return [
        Goal("One effect: right one first, or named as not distinguishable from the first", 0.90, True,
             share(one, first_right)),
        Goal("Nothing missing: anything said to be missing", 0.05, False, share(of_kind(records, "none"), alarm)),
        Goal("Two effects: both named", 0.75, True, share(of_kind(records, "two"), all_named)),
        Goal("Three effects that stand out: all named", 0.70, True,
             share([record for record in of_kind(records, "three") if not unseen(record)], all_named)),
        Goal("Off the list: unexplained", 0.80, True,
             share(of_kind(records, "outsider", "two_outsider"), off_list_seen)),
        Goal("Nothing off the list, distances right: unexplained", 0.05, False, share(others, unexplained)),
        Goal("Distances that wander: right about one effect or none, nothing unexplained", 0.80, True,
             share(of_kind(records, "wandering"), right_on_wandering)),
        Goal("Effects found: error after adding within 10 % of the noise floor", 0.85, True, share(found, near)),
        Goal("Effects found: parameters within 10 % or three standard errors", 0.85, True, share(found, numbers_right)),
        Goal("Effects found: both of these", 0.85, True,
             share(found, lambda record: near(record) and numbers_right(record))),
        Goal("One or two effects, found or not: both of these", 0.85, True,
             share(listed, lambda record: all_found(record) and near(record) and numbers_right(record))),
    ]


def in_class(records: Sequence[Record], low: float, high: float) -> list[Record]:
    """Those whose weakest effect is so strong."""
    return [record for record in records if low <= strength(record) < high]
