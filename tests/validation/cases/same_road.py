"""Cases for the lab without a profile: several drives of one car over the same road, at speeds well apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..simulator.effects import EFFECTS
from ..simulator.recorder import Noise
from ..simulator.roads import random_road
from ..simulator.scene import Drive, Scene
from .random_case import Case, draw_car, draw_noise, generator, hide, recorded

KIND = "same_road"
_GRADES = "BC"


def same_road_case(
    seed: int, effect: str | None = None, strength: float = 8.0, length_m: float = 250.0,
    speeds_mps: tuple[float, ...] = (8.0, 13.0, 19.0), model: str = "half_car",
    noise_by: Callable[[np.random.Generator], Noise] = draw_noise,
) -> Case:
    """A case with one effect (or none), as strong as it is wanted over the noise, which is drawn by ``noise_by``."""
    rng = generator(KIND, seed, effect)
    car = draw_car(rng, model)
    road = random_road(rng, length_m + 60.0, 0.05, str(rng.choice(list(_GRADES))), bool(rng.random() < 0.5))
    drives = tuple(
        Drive(road, float(round(length_m / speed)), speed * rng.uniform(0.9, 1.1), -rng.uniform(2.0, 8.0),
              ((rng.uniform(0.03, 0.08), rng.uniform(15, 30), rng.uniform(0, 6.28)),))
        for speed in speeds_mps)
    noise, scene = noise_by(rng), Scene(car, drives)
    if effect is None:
        return recorded(rng, "none", seed, scene, noise, ())
    scene, hidden = hide(rng, scene, (), EFFECTS[effect], strength, noise)
    return recorded(rng, "one", seed, scene, noise, (hidden,))


def speeds(case: Case) -> list[float]:
    """Mean speeds of its drives [m/s]."""
    return [float(np.mean(run.speed_mps)) for run in case.recordings]
