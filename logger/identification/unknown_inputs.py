"""What is not known of the road under a drive, as numbers that a fit may change, by name.

- ``bump.start_m``, ``bump.height_m``, ``bump.width_m``: a speed bump that lies on the run's profile (or a flat road);
- ``step.start_m``, ``step.height_m``: a step, such as a bridge's joint;
- ``speed_scale``: recorded speed and distance are so many times the true ones; places are true ones.

They hold for every run. ``run2.bump.start_m`` is that of the second run alone, and ``each.bump.start_m`` stands for
one per run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.identification.obstacle_paths import LARGEST_HEIGHT_M, LARGEST_WIDTH_M, Bump, Obstacle, RoadStep
from logger.vehicle.named_parameters import WEAKEST, Free

SPEED_SCALE, EACH = "speed_scale", "each"
_RUN = re.compile(r"run([1-9][0-9]*)\.(.+)")
_NUMBERS = {"bump": ("start_m", "height_m", "width_m"), "step": ("start_m", "height_m")}
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
        both: tuple[tuple[str, Obstacle | None], ...] = (("bump", self.bump), ("step", self.step))
        return {name: one for name, one in both if one is not None}


def input_names(road: RoadInput) -> list[str]:
    """Every number that this input has, by its name for all runs."""
    return [f"{part}.{leaf}" for part in road.obstacles for leaf in _NUMBERS[part]] + [SPEED_SCALE]


def is_input(name: str) -> bool:
    """Whether a name is one of a road's numbers, and not of a vehicle's."""
    _, whole = run_and_name(name.removeprefix(f"{EACH}."))
    return whole == SPEED_SCALE or whole.partition(".")[0] in _NUMBERS


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
        raise ValueError(f"the road has no number {name!r}; expected one of {', '.join(known)}"
                         + ("" if road.obstacles else "; give it a bump or a step first"))
    part, _, leaf = whole.rpartition(".")
    return float(getattr(road.obstacles[part] if part else road, leaf))


def changed_input(road: RoadInput, values: Mapping[str, float], run: int) -> RoadInput:
    """The road's input in a run, counted from 0, with other numbers; those of other runs are passed over."""
    for name, value in values.items():
        only, whole = run_and_name(name)
        part, _, leaf = whole.rpartition(".")
        if only not in (None, run):
            continue
        if part == "bump" and road.bump is not None:
            road = replace(road, bump=replace(road.bump, **{leaf: value}))
        elif part == "step" and road.step is not None:
            road = replace(road, step=replace(road.step, **{leaf: value}))
        else:
            road = replace(road, speed_scale=value)
    return road


def free_input(
    road: RoadInput, name: str, start: float | None = None, bounds: tuple[float, float] | None = None
) -> Free:
    """A free number of a road's input: from its present value, unless something else is said.

    Heights stay within a factor of 20 and keep their sign, widths within 4, the scale of speed within 1.5, places
    within 5 m. ValueError as ``read_input`` and ``Free``, and for bounds that a size cannot have.
    """
    value = read_input(road, name)
    value = value if start is None else start
    leaf = name.rpartition(".")[2]
    if leaf == "start_m":
        low, high = bounds or (value - _PLACE_M, value + _PLACE_M)
        return Free(name, value, low, high, place=True, weakest=_WEAKEST_PLACE)
    factor = {"height_m": _HEIGHT_FACTOR, "width_m": _WIDTH_FACTOR, SPEED_SCALE: _SPEED_FACTOR}[leaf]
    most = {"height_m": LARGEST_HEIGHT_M, "width_m": LARGEST_WIDTH_M, SPEED_SCALE: np.inf}[leaf]
    far = float(np.sign(value)) * min(abs(value) * factor, most)
    low, high = bounds or sorted((value / factor, far))
    if not (low * high > 0 and max(abs(low), abs(high)) <= most):
        raise ValueError(f"{name}: expected bounds of one sign, within {most:g}, found {low:g} to {high:g}")
    return Free(name, value, low, high, weakest=_WEAKEST_SPEED if leaf == SPEED_SCALE else WEAKEST)


def check_names(names: Sequence[str], runs: int) -> None:
    """ValueError for a number of a run that there is not, or that is set both for one run and for all."""
    for name in names:
        only, whole = run_and_name(name)
        if only is not None and (only >= runs or whole in names):
            there = "there is 1 run" if runs == 1 else f"there are {runs} runs"
            what = there if only >= runs else f"{whole} is free for all runs"
            raise ValueError(f"{name}: {what}")
