"""Whether drives show what ``ridelog plan`` says that they would: for each of some effects at its usual strength, the
deviations that were predicted beside those that ``ridelog diagnose`` finds, the root of its gain in minus twice the
log-likelihood, on drives from a simulator that shares nothing with the lab. And how long a plan takes."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import ridelog
from logger.api.lab.bench import among, bench_with
from logger.api.lab.question import CompareQuestion
from logger.lab.diagnosis import diagnose
from logger.lab.likelihood.distance_error import USUAL
from logger.question import USUAL_TOLERANCE
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.named_parameters import free_parameters_of

from ..validation.simulator.cars import Axle, Car
from ..validation.simulator.effects import EFFECTS
from ..validation.simulator.recorder import RATE_HZ
from ..validation.simulator.roads import Road, random_road
from ..validation.simulator.scene import Drive, Scene, measured
from .figures import Figures

Array = NDArray[np.float64]

VEHICLE = "rav4-2009"
SHOWN = {"dry_friction": 0.2, "damper_asymmetry": 0.2, "damper_blow_off": 0.3, "top_mount_compliance": 0.25,
         "sensor_gain": 0.05, "sensor_bandwidth": 0.1, "sensor_offset": 0.15, "cg_shift": 0.08, "occupant": 0.1}
"""Effects in force laws, in the body and in the sensor, each with a noise [m/s2] in which it stands out by ten to
twenty-five deviations: of one that stands out by many more, a likelihood whose levels are free gains less than the
square of the deviations, and of a fainter one chance makes a fifth."""
SPEEDS_MPS, LENGTH_M, SPACING_M = (8.0, 15.0), 300.0, 0.05
NOISE_MPS2 = 0.05
NEAR = 0.20
GOAL_S = 20.0


@dataclass(frozen=True)
class Found:
    """Standard deviations by which an effect stands out: as planned, and as it was then found."""

    planned: float
    found: float

    @property
    def off(self) -> float:
        """By which share the plan was wrong."""
        return abs(self.planned / self.found - 1) if self.found > 0 else float("inf")


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    road = a_road()
    started_s, worked_s = time.perf_counter(), time.process_time()
    planned(road, NOISE_MPS2)
    figures.at_most("a plan of two drives", time.perf_counter() - started_s, GOAL_S, "s")
    figures.at_most("  of the processor, for two cores", time.process_time() - worked_s, 2 * GOAL_S, "s")
    for name, noise_mps2 in SHOWN.items():
        one = compared(name, noise_mps2, road)
        print(f"{name}: planned {one.planned:.1f}, found {one.found:.1f} standard deviations")
        figures.at_most(f"  {name}: planned over found, off by", one.off, NEAR, "")
    return 1 if figures.missed else 0


def a_road(seed: int = 5) -> Road:
    """Of class C."""
    return random_road(np.random.default_rng(seed), LENGTH_M, SPACING_M, "C", features=False)


def profile_of(road: Road) -> ridelog.Profile:
    """As the lab is given it."""
    return ridelog.Profile(0.0, road.spacing_m, np.round(road.left_m, 6), None)


def compared(name: str, noise_mps2: float, road: Road) -> Found:
    """An effect at its usual strength, planned and then found."""
    plan = planned(road, noise_mps2, (name,))
    return Found(plan.detectability[name], deviations(name, drives(name, noise_mps2, road)))


def planned(road: Road, noise_mps2: float, candidates: tuple[str, ...] | None = None) -> ridelog.Plan:
    """By the lab."""
    return ridelog.plan(VEHICLE, profile=profile_of(road), speeds_mps=SPEEDS_MPS, noise_mps2=noise_mps2,
                        candidates=candidates)


def deviations(name: str, runs: list[ridelog.Run]) -> float:
    """The root of what the diagnosis of one effect gains, its numbers not counted, in a car that may bend as far as the
    runs ask, as it ends in: a search holds the car's numbers at two deviations, and gains more where an effect would
    bend them farther."""
    bench = bench_with(CompareQuestion(VEHICLE, runs, tolerance=USUAL_TOLERANCE))
    posterior = bench.posterior(searches=True)
    one = diagnose(posterior, among(bench.effects, [name])).candidate(name)
    gain = one.gain + len(free_parameters_of([one.one])) * float(np.log(posterior.freedom))
    return float(np.sqrt(max(gain, 0.0)))


def drives(name: str, noise_mps2: float, road: Road, seed: int = 1) -> list[ridelog.Run]:
    """What would be recorded of a car with an effect at its usual strength, by a recorder whose distance errs as a
    good one's does."""
    rng = np.random.default_rng([seed, len(name)])
    car = simulated_car()
    plans = tuple(Drive(road, (LENGTH_M + car.wheelbase_m) / speed + 1.0, speed, 0.0) for speed in SPEEDS_MPS)
    scene = EFFECTS[name].apply(Scene(car, plans), {**shipped_effects()[name].usual, "_regularised": 0.0})
    found = []
    for drive, clean in zip(plans, measured(scene), strict=True):
        accel = clean + noise_mps2 * rng.standard_normal(len(clean))
        found.append(ridelog.make_run(
            accel, drive.speed_mps, rate_hz=RATE_HZ, profile=profile_of(scene.written_road(drive)),
            distance_m=drive.distance_m(drive.times_s) + wrong_m(rng, drive), name=f"at {drive.speed_mps:g}"))
    return found


def wrong_m(rng: np.random.Generator, drive: Drive) -> Array:
    """The error of a distance (n,) that begins, walks and grows as usual [m]."""
    walk = np.cumsum(rng.standard_normal(len(drive.times_s))) * USUAL.walk_m / np.sqrt(RATE_HZ)
    smooth = np.convolve(np.pad(walk, 50, mode="edge"), np.hanning(101) / np.hanning(101).sum(), "valid")
    way = drive.distance_m(drive.times_s)
    return np.asarray(USUAL.start_m * rng.standard_normal() + smooth + USUAL.scale * rng.standard_normal() * way)


def simulated_car() -> Car:
    """The vehicle, for the other simulator."""
    vehicle = ridelog.read_vehicle(VEHICLE).vehicle
    axles = [Axle(*(getattr(one, name) for name in Axle.__dataclass_fields__)) for one in (vehicle.front, vehicle.rear)]
    return Car("half_car", vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2, *axles, vehicle.contact_patch_m)


if __name__ == "__main__":
    sys.exit(main())
