"""What is not known of the road under a drive, as numbers that a fit may change, by name.

- ``bump.start_m``, ``bump.height_m``, ``bump.width_m``: a speed bump that lies on the run's profile (or a flat road);
- ``step.start_m``, ``step.height_m``: a step, such as a bridge's joint;
- ``speed_scale``: recorded speed and distance are so many times the true ones; places are true ones.

They hold for every run. ``run2.bump.start_m`` is that of the second run alone, and ``each.bump.start_m`` stands for one
per run.

Problem: an obstacle whose height, width or place is to be found moves a little with every step of a fit, and samples of
a profile would move in jumps. Solution: an obstacle is a track of its own, whose samples move and stretch with it.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from logger.profiles.track import Track
from logger.roads.obstacles import speed_bump
from logger.vehicle.named_parameters import WEAKEST, Free

_PIECES, _EDGE_M = 2000, 1e-3
"""Straight lines that a bump consists of: they lie within a millionth of its height of it. How far a step rises [m]."""
# 38.1 mm of 4.4.5 and 150 mm by 2.60 m of 4.4.3 are usual; these are not.
LARGEST_HEIGHT_M = 1.0
LARGEST_WIDTH_M = 50.0


@dataclass(frozen=True)
class Bump:
    """One period of a raised cosine (Eq 4.41 and 4.42 of Blum 2015, over distance) [m].

    ValueError for a width that is not above 0, or a bump out of all proportion.
    """

    start_m: float
    height_m: float
    width_m: float
    sizes = ("height_m", "width_m")

    def __post_init__(self) -> None:
        _check_height(self.height_m)
        if not 0 < self.width_m <= LARGEST_WIDTH_M:
            raise ValueError(f"bump: expected a width above 0 and up to {LARGEST_WIDTH_M:g} m, found {self.width_m:g}")

    @property
    def length_m(self) -> float:
        """From where it begins to where the road is as it will stay [m]."""
        return self.width_m

    @cached_property
    def track(self) -> Track:
        """The bump on a flat road."""
        along_m = np.linspace(0.0, self.width_m, _PIECES + 1)
        return Track(self.width_m / _PIECES, speed_bump(along_m, 0.0, self.height_m, self.width_m), self.start_m)


@dataclass(frozen=True)
class RoadStep:
    """A joint after which the road stays higher, or with a negative height lower (4.4.5 of Blum 2015) [m]."""

    start_m: float
    height_m: float
    length_m = 0.0
    sizes = ("height_m",)

    def __post_init__(self) -> None:
        _check_height(self.height_m)

    @cached_property
    def track(self) -> Track:
        """The step on a flat road."""
        return Track(_EDGE_M, np.array([0.0, self.height_m]), self.start_m - _EDGE_M / 2)


Obstacle = Bump | RoadStep
KINDS: dict[str, type[Bump] | type[RoadStep]] = {"bump": Bump, "step": RoadStep}


def _check_height(height_m: float) -> None:
    if not 0 < abs(height_m) <= LARGEST_HEIGHT_M:
        raise ValueError(f"expected a height other than 0, within {LARGEST_HEIGHT_M:g} m, found {height_m:g}")


SPEED_SCALE, EACH = "speed_scale", "each"
_RUN = re.compile(r"run([1-9][0-9]*)\.(.+)")
# How far from its start a number may go when nothing else is said: factors, and metres.
_HEIGHT_FACTOR, _WIDTH_FACTOR, _SPEED_FACTOR = 20.0, 4.0, 1.5
_PLACE_M = 5.0
# What is known without any fit: an estimate that is rougher is none. Speed relative, places as a share of 5 m.
_WEAKEST_SPEED, _WEAKEST_PLACE = 0.02, 0.1


@dataclass(frozen=True)
class RoadInput:
    """What lies on the profile of a run, and how its distances are to be read: distance / speed_scale is true [m]."""

    bump: Bump | None = None
    step: RoadStep | None = None
    speed_scale: float = 1.0

    @property
    def obstacles(self) -> dict[str, Obstacle]:
        """Those there are, by name."""
        return {name: one for name in KINDS if (one := getattr(self, name)) is not None}


def input_names(road: RoadInput) -> list[str]:
    """Every number that this input has, by its name for all runs."""
    return [f"{part}.{leaf}" for part in road.obstacles for leaf in ("start_m", *KINDS[part].sizes)] + [SPEED_SCALE]


def is_input(name: str) -> bool:
    """Whether a name is one of a road's numbers, and not of a vehicle's."""
    _, whole = run_and_name(name.removeprefix(f"{EACH}."))
    return whole == SPEED_SCALE or whole.partition(".")[0] in KINDS


def run_and_name(name: str) -> tuple[int | None, str]:
    """The run that a name is for, counted from 0, or None for all of them; and the name for all runs."""
    found = _RUN.fullmatch(name)
    return (int(found[1]) - 1, found[2]) if found else (None, name)


def expanded(name: str, runs: int) -> list[str]:
    """Names without ``each``: one per run where it stood, ``name`` alone where there is but one run."""
    if not name.startswith(f"{EACH}."):
        return [name]
    whole = name.removeprefix(f"{EACH}.")
    return [whole] if runs == 1 else [f"run{number}.{whole}" for number in range(1, runs + 1)]


def read_input(road: RoadInput, name: str) -> float:
    """The number of that name. ValueError, which lists the names there are, for another one."""
    whole = run_and_name(name)[1]
    if whole not in (known := input_names(road)):
        raise ValueError(f"the road has no parameter {name!r}; expected one of {', '.join(known)}"
                         + ("" if road.obstacles else "; give it a bump or a step first"))
    part, _, leaf = whole.rpartition(".")
    return float(getattr(road.obstacles[part] if part else road, leaf))


def changed_input(road: RoadInput, values: Mapping[str, float], run: int) -> RoadInput:
    """The road's input in a run, counted from 0, with other numbers; those of other runs are passed over."""
    for name, value in values.items():
        only, whole = run_and_name(name)
        part, _, leaf = whole.rpartition(".")
        if only in (None, run):
            there: Any = getattr(road, part) if part else None
            changed: Any = replace(there, **{leaf: value}) if part else value
            road = replace(road, **{part or SPEED_SCALE: changed})
    return road


def free_input(road: RoadInput, name: str, start: float | None = None) -> Free:
    """A free number of a road's input: from its present value, unless something else is said.

    Heights stay within a factor of 20 and keep their sign, widths within 4, the scale of speed within 1.5, places
    within 5 m. ValueError as ``read_input`` and ``Free``.
    """
    value = read_input(road, name)
    value = value if start is None else start
    leaf = name.rpartition(".")[2]
    if leaf == "start_m":
        return Free(name, value, value - _PLACE_M, value + _PLACE_M, place=True, weakest=_WEAKEST_PLACE)
    factor = {"height_m": _HEIGHT_FACTOR, "width_m": _WIDTH_FACTOR, SPEED_SCALE: _SPEED_FACTOR}[leaf]
    most = {"height_m": LARGEST_HEIGHT_M, "width_m": LARGEST_WIDTH_M, SPEED_SCALE: np.inf}[leaf]
    far = float(np.sign(value)) * min(abs(value) * factor, most)
    low, high = sorted((value / factor, far))
    return Free(name, value, low, high, weakest=_WEAKEST_SPEED if leaf == SPEED_SCALE else WEAKEST)


def check_names(names: Sequence[str], runs: int) -> None:
    """ValueError for a number of a run that there is not, or that is set both for one run and for all."""
    for name in names:
        only, whole = run_and_name(name)
        if only is not None and (only >= runs or whole in names):
            there = "there is 1 run" if runs == 1 else f"there are {runs} runs"
            what = there if only >= runs else f"{whole} is free for all runs"
            raise ValueError(f"{name}: {what}")
