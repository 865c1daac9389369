"""Random cases of the examination, each made from its kind and seed alone.

Problem: an examination must ask everything evenly: small cars and vans, smooth roads and rough, faint effects and
strong; and it must know the right answer exactly.

Solution: the car, the drives and the noise are drawn first, then an effect and the strength it shall have, which is the
r.m.s. of the change that it makes in the noise-free record over the r.m.s. of the noise. The effect's path is searched
for that strength with a coarser step; what is recorded, and the strength that is reported, come from the fine one.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ..simulator.cars import STEP_S, Axle, Car
from ..simulator.effects import EFFECTS, NEVER_TOGETHER, Effect
from ..simulator.newcomers import NEWCOMERS
from ..simulator.outsiders import OUTSIDERS
from ..simulator.recorder import HUNDREDTH_G_MPS2, RATE_HZ, Noise
from ..simulator.roads import Road, random_road
from ..simulator.scene import Drive, Scene, clean_acceleration, measured

Array = NDArray[np.float64]
Parameters = dict[str, float]

KINDS = ("none", "one", "two", "three", "outsider", "two_outsider", "wandering")
SKIPPED_S = 2.0  # at the start of every run, left out of every error
VISIBLE = 2.0
NUMBERS_OFF = 0.04
LENGTHS_OFF = (0.005, 0.02, 0.04)
"""By what shares a data sheet may be wrong, drawn evenly up to them; a case has one of those for its lengths."""
WRONG_MPS, WRONG_FOR_S = (0.02, 0.1), (0.05, 5.0)
"""By what the speed signal of a ``wandering`` case is wrong, and how long an error of it lasts."""
OF_THE_DISTANCE = ("speed_scale", "time_offset")
_SEARCH_STEP_S = 1 / 1000
_TRIES = 8


@dataclass(frozen=True)
class Hidden:
    """An effect as it is in the truth."""

    effect: Effect
    parameters: Parameters
    wanted: float
    strength: float = 0.0


@dataclass(frozen=True)
class Recording:
    """One run as it was recorded, beside what a perfect recorder would have written."""

    t_s: Array
    accel_z_mps2: Array
    speed_mps: Array
    distance_m: Array
    clean_mps2: Array


@dataclass(frozen=True)
class Case:
    """A question and its answer; ``bare``: the scene without what is hidden."""

    kind: str
    seed: int
    nominal: Car
    scene: Scene
    noise: Noise
    hidden: tuple[Hidden, ...]
    recordings: tuple[Recording, ...]
    profiles: tuple[Road, ...]
    both_tracks: bool
    noise_rms_mps2: float
    bare: Scene

    @cached_property
    def error(self) -> dict[str, float]:
        """Normalised errors: of the sensor's noise, of the true car on the distances that were recorded, and of the car
        without what is hidden; simulated when they are asked for."""
        taken = tuple(run.accel_z_mps2 for run in self.recordings)
        size = difference_rms(taken, tuple(np.zeros_like(one) for one in taken))
        by_way = tuple(
            clean_acceleration(self.scene, drive, STEP_S * 2, (run.distance_m, run.speed_mps))
            for drive, run in zip(self.scene.drives, self.recordings, strict=True))
        plain = measured(self.bare, STEP_S * 2)
        return {"noise_floor_error": self.noise_rms_mps2 / size,
                "attainable_error": difference_rms(taken, by_way) / size,
                "error_without_effects": difference_rms(taken, plain) / size}


def generator(kind: str, seed: int, effect: str | None) -> np.random.Generator:
    """Random numbers of a case; other kinds and seeds share nothing with it."""
    return np.random.default_rng([zlib.crc32(f"{kind}/{effect}".encode()), seed])


# --- drawing --------------------------------------------------------------------------------------------------------

def _axle(rng: np.random.Generator, distance_m: float, sprung_kg: float, likeness: dict[str, float]) -> Axle:
    """An axle that carries so much and whose frequencies lie near the car's."""
    def near(value: float, low: float, high: float) -> float:
        return float(np.clip(value * rng.uniform(0.87, 1.13), low, high))

    bounce, hop = near(likeness["bounce"], 0.9, 1.7), near(likeness["hop"], 9, 14)
    # A wheel so heavy that its tire is at least 4.5 times as stiff as the spring.
    lightest = 5.5**2 / 4.5 * (bounce / hop) ** 2
    unsprung = sprung_kg * max(likeness["unsprung"] * rng.uniform(0.87, 1.13), lightest)
    # Wheel hop: both springs on the wheel; bounce: both in series under the body. Sum and product give the two.
    ride = sprung_kg * (2 * np.pi * bounce) ** 2
    total = unsprung * (2 * np.pi * hop) ** 2
    tire = 0.5 * total * (1 + np.sqrt(1 - 4 * ride / total))
    spring = total - tire
    damper = 2 * near(likeness["damping"], 0.15, 0.4) * np.sqrt(spring * sprung_kg)
    return Axle(distance_m, float(unsprung), float(spring), float(damper), float(tire))


def draw_car(rng: np.random.Generator, model: str) -> Car:
    """A small car ... a van, one side or one corner of it."""
    side_kg = float(np.exp(rng.uniform(*np.log([400, 1200]))))
    likeness = {"unsprung": rng.uniform(0.09, 0.17), "bounce": rng.uniform(0.98, 1.55), "hop": rng.uniform(9.8, 12.8),
                "damping": rng.uniform(0.18, 0.36)}
    patch = rng.uniform(0.10, 0.26)
    if model == "quarter_car":
        return Car(model, 0.5 * side_kg, np.inf, _axle(rng, 0.0, 0.5 * side_kg, likeness), None, patch)
    ahead, behind = rng.uniform(1.0, 1.8), rng.uniform(1.0, 1.8)
    base = ahead + behind
    return Car(
        model, side_kg, side_kg * ahead * behind * rng.uniform(0.8, 1.2),
        _axle(rng, ahead, side_kg * behind / base, likeness), _axle(rng, behind, side_kg * ahead / base, likeness),
        patch)


def mistaken(rng: np.random.Generator, car: Car) -> Car:
    """The car as its data sheet has it: every number off by up to 4 %, geometry by as much or by less."""
    lengths = float(rng.choice(LENGTHS_OFF))

    def off(value: float, share: float = NUMBERS_OFF) -> float:
        return float(f"{value * (1 + rng.uniform(-share, share)):.5g}")

    def axle(one: Axle) -> Axle:
        return Axle(off(one.cg_distance_m, lengths), off(one.unsprung_mass_kg), off(one.suspension_stiffness_n_per_m),
                    off(one.suspension_damping_n_s_per_m), off(one.tire_stiffness_n_per_m))

    return Car(car.model, off(car.sprung_mass_kg), off(car.pitch_inertia_kg_m2), axle(car.front),
               axle(car.rear) if car.rear else None, off(car.contact_patch_m, lengths))


_FASTEST_MPS = {"A": 30.0, "B": 30.0, "C": 22.0, "D": 14.0}


def draw_drives(rng: np.random.Generator, rough: int) -> tuple[Drive, ...]:
    """One to four runs over one road or several; ``rough`` leaves out so many of the smoothest classes."""
    count = int(rng.choice([1, 2, 3, 4], p=[0.05, 0.1, 0.15, 0.7]))
    grades = "ABCD"[min(rough, 2):]
    same = rng.random() < 0.35
    spacing = float(rng.choice([0.05, 0.1], p=[0.7, 0.3]))
    shared_grade, shared_features = str(rng.choice(list(grades))), bool(rng.random() < 0.5)
    plans = []
    for _ in range(count):
        grade = shared_grade if same else str(rng.choice(list(grades)))
        duration = 60.0 if rng.random() < 0.75 else float(rng.integers(20, 60))
        speed = float(np.exp(rng.uniform(np.log(4.6), np.log(0.9 * _FASTEST_MPS[grade]))))
        swings = ()
        if rng.random() < 0.5:
            swings = ((rng.uniform(0.03, 0.12), rng.uniform(15, 40), rng.uniform(0, 6.28)),
                      (rng.uniform(0.0, 0.03), rng.uniform(6, 12), rng.uniform(0, 6.28)))
        plans.append((grade, Drive(None, duration, speed, -rng.uniform(2.0, 8.0), swings)))
    lengths = [drive.distance_m(np.array([drive.duration_s]))[0] + rng.uniform(-4, 6) for _, drive in plans]
    if same:
        road = random_road(rng, max(lengths), spacing, shared_grade, shared_features)
        return tuple(replace(drive, road=road) for _, drive in plans)
    return tuple(
        replace(drive, road=random_road(rng, length, spacing, grade, bool(rng.random() < 0.4)))
        for (grade, drive), length in zip(plans, lengths, strict=True))


def draw_noise(rng: np.random.Generator) -> Noise:
    if rng.random() < 0.3:
        return Noise(0.01, HUNDREDTH_G_MPS2)
    return Noise(float(np.exp(rng.uniform(*np.log([0.02, 0.1])))), 0.0, bool(rng.random() < 0.3))


def _noise_rms(noise: Noise) -> float:
    return float(np.hypot(noise.white_mps2, noise.step_mps2 / np.sqrt(12)))


# --- effects --------------------------------------------------------------------------------------------------------

def with_effects(scene: Scene, hidden: list[Hidden] | tuple[Hidden, ...]) -> Scene:
    for each in hidden:
        scene = each.effect.apply(scene, each.parameters)
    return scene


def without(scene: Scene, hidden: tuple[Hidden, ...], *gone: int) -> Scene:
    """The scene with all effects but some; without a blurred profile the road is what the profile says."""
    rest = with_effects(scene, [each for i, each in enumerate(hidden) if i not in gone])
    blur = sum(hidden[i].parameters.get("blur_m", 0.0) for i in gone)
    if blur:
        rest = replace(rest, drives=tuple(replace(drive, road=drive.road.blurred(blur)) for drive in rest.drives))
    return rest


def difference_rms(one: tuple[Array, ...], other: tuple[Array, ...]) -> float:
    skipped = int(SKIPPED_S * RATE_HZ)
    return float(np.sqrt(np.mean(np.concatenate([(a - b)[skipped:] for a, b in zip(one, other, strict=True)]) ** 2)))


def strength(scene: Scene, hidden: tuple[Hidden, ...], which: int, noise: Noise) -> float:
    """R.m.s. of what one effect changes in the clean record, over the noise; roughly, by long steps."""
    changed = difference_rms(measured(with_effects(scene, hidden), _SEARCH_STEP_S),
                              measured(without(scene, hidden, which), _SEARCH_STEP_S))
    return changed / _noise_rms(noise)


def hide(
    rng: np.random.Generator, scene: Scene, before: tuple[Hidden, ...], effect: Effect, wanted: float, noise: Noise,
) -> tuple[Scene, Hidden]:
    """Add an effect of the wanted strength, or the nearest that its bounds allow."""
    path = effect.path(rng, scene.car)
    bare = measured(with_effects(scene, before), _SEARCH_STEP_S)

    def at(u: float) -> tuple[Scene, Hidden, float]:
        staged, found = effect.stage(scene, u), Hidden(effect, path(u), wanted)
        both = (*before, found)
        if staged is not scene or "blur_m" in found.parameters:  # then the other side of the comparison moves too
            return staged, found, strength(staged, both, len(both) - 1, noise)
        changed = difference_rms(measured(with_effects(scene, both), _SEARCH_STEP_S), bare)
        return staged, found, changed / _noise_rms(noise)

    goal = np.log(wanted)
    low, high = 0.0, 1.0
    low_value, high_value = (np.log(max(at(u)[2], 1e-4)) for u in (low, high))
    if high_value <= goal:
        return at(high)[:2]
    if low_value >= goal:
        return at(low)[:2]
    for _ in range(7):
        # Between a secant and a halving: strengths are nearly straight in u, but for effects with a threshold.
        u = low + (high - low) * float(np.clip((goal - low_value) / (high_value - low_value), 0.15, 0.85))
        staged, found, value = at(u)
        value = np.log(max(value, 1e-4))
        if abs(value - goal) < 0.1:
            break
        if value < goal:
            low, low_value = u, value
        else:
            high, high_value = u, value
    return staged, found


# --- cases ----------------------------------------------------------------------------------------------------------

def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _choose(rng: np.random.Generator, kind: str, seed: int, effect: str | None) -> list[tuple[Effect, float, float]]:
    """The effects of a case with the strength each shall have and the least it must have."""
    names, outside = list(EFFECTS), list(OUTSIDERS)
    first = (EFFECTS | OUTSIDERS | NEWCOMERS)[effect] if effect else None
    if kind == "none":
        return []
    if kind == "wandering":
        asked = [None, *(name for name in names if name not in OF_THE_DISTANCE)]
        name = effect or asked[seed % len(asked)]
        return [(first or EFFECTS[name], _log_uniform(rng, 2.2, 15.0), VISIBLE)] if name else []
    if kind == "one":
        return [(first or EFFECTS[names[seed % len(names)]], _log_uniform(rng, 0.5, 20.0), 0.0)]
    if kind == "outsider":
        return [(first or OUTSIDERS[outside[seed % len(outside)]], _log_uniform(rng, 2.0, 20.0), VISIBLE)]
    drawn = [first or EFFECTS[names[seed % len(names)]]]
    for _ in range(2 if kind == "three" else 1):
        taken = {one.name for one in drawn}
        pool = outside if kind == "two_outsider" else [
            name for name in names if name not in taken and not any({name, one} in NEVER_TOGETHER for one in taken)]
        drawn.append((EFFECTS | OUTSIDERS)[str(rng.choice(pool))])
    return [(each, _log_uniform(rng, 2.2, 15.0), VISIBLE) for each in drawn]


def _model(rng: np.random.Generator, effects: list[Effect]) -> str:
    quarter = rng.random() < 0.2 and all("quarter_car" in effect.models for effect in effects)
    return "quarter_car" if quarter else "half_car"


def _attempt(
    rng: np.random.Generator, chosen: list[tuple[Effect, float, float]], attempt: int,
    noise_of: Callable[[np.random.Generator], Noise],
) -> tuple[Scene, Noise, tuple[Hidden, ...]]:
    effects = [effect for effect, _, _ in chosen]
    car = draw_car(rng, _model(rng, effects))
    rough = max([effect.rough for effect in effects], default=0) + attempt // 3
    noise = noise_of(rng)
    scene = Scene(car, draw_drives(rng, rough))
    hidden: tuple[Hidden, ...] = ()
    for effect, wanted, _ in sorted(chosen, key=lambda each: each[0].name != "wheel_lift"):
        scene, found = hide(rng, scene, hidden, effect, wanted, noise)
        hidden = (*hidden, found)
    return scene, noise, hidden


def case(kind: str, seed: int, effect: str | None = None,
         noise_of: Callable[[np.random.Generator], Noise] = draw_noise) -> Case:
    """Make a case. ``effect`` fixes the (first) effect of the kinds that have one; else the seeds go round the list.
    ``noise_of`` draws the sensor's noise, by which strengths are measured.

    A draw whose effects cannot be as strong as they must be is drawn again, on rougher roads after some tries.
    """
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {kind}")
    rng = generator(kind, seed, effect)
    chosen = _choose(rng, kind, seed, effect)
    for attempt in range(_TRIES):
        scene, noise, hidden = _attempt(rng, chosen, attempt, noise_of)
        strengths = [strength(scene, hidden, i, noise) for i in range(len(hidden))]
        least = [max(0.9 * low, 0.5 * each.wanted) for each, (_, _, low) in zip(hidden, chosen, strict=True)]
        if all(value >= low for value, low in zip(strengths, least, strict=True)):
            break
    return recorded(rng, kind, seed, scene, noise, hidden)


def recorded(
    rng: np.random.Generator, kind: str, seed: int, scene: Scene, noise: Noise, hidden: tuple[Hidden, ...],
) -> Case:
    full = with_effects(scene, hidden)
    clean = measured(full)
    wrong = (_log_uniform(rng, *WRONG_MPS), _log_uniform(rng, *WRONG_FOR_S)) if kind == "wandering" else None
    recordings = tuple(
        _recording(rng, drive, noise, one, wrong) for drive, one in zip(scene.drives, clean, strict=True))
    noise_rms = difference_rms(tuple(run.accel_z_mps2 for run in recordings), clean)
    found = tuple(
        replace(each, strength=difference_rms(clean, measured(without(scene, hidden, i), STEP_S * 2)) / noise_rms)
        for i, each in enumerate(hidden))
    has_roll = full.physics.track_m is not None
    return Case(
        kind, seed, mistaken(rng, scene.car), full, noise, found, recordings,
        tuple(full.written_road(drive) for drive in full.drives),
        has_roll or bool(rng.random() < 0.3), noise_rms, without(scene, hidden, *range(len(hidden))))


def _recording(
    rng: np.random.Generator, drive: Drive, noise: Noise, clean: Array, wrong: tuple[float, float] | None,
) -> Recording:
    """What the recorder writes: the speed signal is noisy and rounded, the distance is its integral.

    The noise is large enough for the rounding to leave no lasting error: after a minute the distance is wrong by a
    millimetre to two centimetres, and by more where the speed is ``wrong``: by so much [m/s], for so long [s].
    """
    t = drive.times_s
    step = _log_uniform(rng, 0.002, 0.02)
    speed = drive.speed_at_mps(t) + rng.uniform(0.5, 0.7) * step * rng.standard_normal(t.size)
    if wrong:
        speed = speed + wrong[0] * _coloured(rng, t.size, np.exp(-1 / RATE_HZ / wrong[1]))
    speed = step * np.round(speed / step)
    wrong = np.concatenate([[0.0], np.cumsum((speed - drive.speed_at_mps(t))[:-1])]) / RATE_HZ
    return Recording(t, noise.add(clean, rng), speed, drive.distance_m(t) + wrong, clean)


def _coloured(rng: np.random.Generator, count: int, kept: float) -> Array:
    """Noise of deviation 1 of which so much is kept from one sample to the next."""
    fresh = np.sqrt(1 - kept**2) * rng.standard_normal(count)
    fresh[0] = rng.standard_normal()
    return lfilter([1.0], [1.0, -kept], fresh)
