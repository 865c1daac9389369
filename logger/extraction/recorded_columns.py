"""Columns that a phone or another logger wrote, as a drive needs them: samples even and upright, fixes that are new.

When fixes were true. Problem: on board a fix is placed by the earliest arrival so far; what comes later in the drive
may have come with less wait, and tells of the fixes before it as well. Solution: the lowest floor of arrivals is
carried back in time too, raised by no more than the two clocks drift apart, as far back as the receiver's clock did not
jump.

Which fixes are new. Problem: many programs write the last fix again in every row, and some write places but no speed.
But an unchanged row is no lost fix by itself: a car that stands, or goes at a steady speed that is written in whole
km/h, gives the same numbers again. Solution: a fix is new where something of it changes. An unchanged one counts at the
usual pace until it says that the car went farther than its places would hide; beyond that the receiver only repeats
what it had. Places alone give the speed from each to the next.
"""

from dataclasses import dataclass
from math import atan, radians
from typing import Any

import numpy as np

from logger.arrays import Array, Bools, Whole
from logger.bounds import FASTEST_HZ, LONGEST_HOLE_S, ROUNDING_STEPS
from logger.comfort.iso2631 import LEAST_TAKEN_HZ
from logger.dsp import repeated_samples
from logger.dsp.whole_record import mean_rate_hz, on_even_grid
from logger.estimation.drive_alignment import MOVED_DEG, angle_rad, has_moved, sitting
from logger.geodesy import EARTH_RADIUS_M
from logger.units import DAY_US, STANDARD_GRAVITY_MPS2, US_PER_S

KEPT_STANDING_S = 5.0


def stretches(time_s: Array, present: Bools, fix_s: Array, speed_mps: Array, longest_gap_s: float,
              longest_standing_s: float, stationary_mps: float) -> list[tuple[float, float]]:
    """Begin and end of each [s], in order.

    Problem: a recording goes on while the car is parked, the receiver sees no sky, or the sensor is silent; a model
    needs speed and readings without a break. Solution: a stretch ends where fixes or readings are missing for too long,
    or where the car stands for long; what is shorter than that stays inside, marked.

    time_s, present       (n,) of readings, and whether there was one
    fix_s, speed_mps      (k,) of fixes
    longest_gap_s         between two fixes of one stretch
    longest_standing_s    with a speed below ``stationary_mps``; some seconds of a longer one are kept at either end
    """
    if len(fix_s) < 2 or not present.any():
        return []
    at_s = time_s[present]
    breaks = [*_gaps(fix_s, longest_gap_s), *_gaps(at_s, LONGEST_HOLE_S)]
    for first, end in zip(*repeated_samples.stretches_of(speed_mps < stationary_mps), strict=True):
        if fix_s[end - 1] - fix_s[first] > longest_standing_s:
            breaks.append((fix_s[first] + KEPT_STANDING_S, fix_s[end - 1] - KEPT_STANDING_S))
    begin_s, end_s = max(fix_s[0], at_s[0]), min(fix_s[-1], at_s[-1])
    found = []
    for gone_s, back_s in sorted(breaks):
        if gone_s > begin_s:
            found.append((float(begin_s), float(min(gone_s, end_s))))
        begin_s = max(begin_s, back_s)
    found.append((float(begin_s), float(end_s)))
    return [one for one in found if one[1] > one[0]]


def _gaps(time_s: Array, longest_s: float) -> list[tuple[float, float]]:
    wide = np.flatnonzero(np.diff(time_s) > longest_s)
    return [(float(time_s[index]), float(time_s[index + 1])) for index in wide]


_FEWEST = 20  # samples of a piece: the filter's ends are continued by guesses
_FEW_STEPS = 3.5
_INSTANT_S = 1e-6


@dataclass(frozen=True, eq=False)
class EvenSamples:
    """Samples on a grid, but where ``time_s`` jumps, since nothing was heard for half a second or more.

    time_s (n,), samples (n, axes), present (n,), clipped (n,)
    own_hz       the recorder's own rate
    repeats      share of the samples that only repeated the one before; these were dropped
    as_read      nothing had to be laid on the grid: the samples stood on it
    holds_s      how long the sensor stood still each time, which is left out [s]
    """

    time_s: Array
    samples: Array
    present: Bools
    clipped: Bools
    own_hz: float
    repeats: float
    as_read: bool
    holds_s: tuple[float, ...] = ()


def clipped_samples(samples: Array) -> Bools:
    """Which samples (n, axes) stand at an end of the range on some axis (n,), as ``dsp.repeated_samples`` sees it."""
    found = np.zeros(len(samples), dtype=np.bool_)
    for axis in samples.T:
        half = 0.5 * repeated_samples.resolution(axis)
        for one in repeated_samples.range_ends(axis):
            found |= np.sign(one.at) * axis >= abs(one.at) - half
    return found


def even_samples(time_s: Array, samples: Array, rate_hz: float) -> EvenSamples:
    """Lay samples (n, axes) at times (n,), not decreasing [s], on a grid. ValueError where that cannot be.

    Problem: a phone samples at 51, 104 or 417 Hz, unevenly, writes each reading several times, gives times in bursts,
    and stops for a while. Solution: repeats are dropped (``dsp.repeated_samples``), bursts ``spread``, and what lies
    between two long silences is laid on an even grid through an anti-alias filter (``dsp.whole_record``); where a few
    samples are missing, or were clipped, the grid says so.
    """
    pieces = _pieces(time_s)
    if not pieces:
        raise ValueError(f"expected {_FEWEST} samples or more without a pause of {LONGEST_HOLE_S:g} s, found none")
    held = repeated_samples.find_holds(time_s, samples)
    whole = [_taken(time_s[part], samples[part], held[part]) for part in pieces]
    clipped = clipped_samples(np.concatenate([one[1] for one in whole]))
    ends = np.cumsum([len(one[0]) for one in whole])[:-1]
    taken = [(one[0][part], one[1][part], ends_met[part]) for one, ends_met in zip(whole, np.split(clipped, ends),
                                                                              strict=True) for part in _pieces(one[0])]
    dropped = 1.0 - sum(len(one[0]) for one in whole) / sum(len(part) for part in pieces)
    longest = max(taken, key=lambda one: len(one[0]))[0] if taken else np.concatenate([one[0] for one in whole])
    if len(longest) < 2:
        raise ValueError("expected two samples or more at different times, found one")
    own_hz = mean_rate_hz(longest)
    if own_hz > FASTEST_HZ:
        raise ValueError(f"expected at most {FASTEST_HZ:g} samples a second, found {own_hz:.3g}: is the unit of the "
                         "time right?")
    if own_hz < LEAST_TAKEN_HZ:
        also = f" written at {len(time_s) / (time_s[-1] - time_s[0]):.3g} Hz" if dropped > 0 else ""
        raise ValueError(f"expected {LEAST_TAKEN_HZ:g} measured samples a second or more, found {own_hz:.3g}{also}: "
                         "set the program to a higher rate")
    laid = [_laid(*one, own_hz, rate_hz) for one in taken]
    times_s, values, present, ends_met = (np.concatenate(part) for part in list(zip(*laid, strict=True))[:4])
    return EvenSamples(times_s, values, present, ends_met, own_hz, dropped, all(one[4] for one in laid),
                       tuple(float(end_s - begin_s) for begin_s, end_s in zip(*holes_of(time_s, held), strict=True)))


def holes_of(time_s: Array, held: Bools) -> tuple[Array, Array]:
    """Begin and end (k,) [s] of the holes that samples at times (n,) leave which were not taken (``find_holds``)."""
    first, end = repeated_samples.stretches_of(held)
    return time_s[first - 1], time_s[np.minimum(end, len(time_s) - 1)]


def _pieces(time_s: Array) -> list[Any]:
    """Samples without a long pause among them."""
    ends = np.flatnonzero(np.diff(time_s) > LONGEST_HOLE_S) + 1
    return [part for part in np.split(np.arange(len(time_s)), ends) if len(part) >= _FEWEST]


def _taken(time_s: Array, samples: Array, held: Bools) -> tuple[Array, Array]:
    """What was taken, and when: without repeats, at times that grow."""
    if (ends := repeated_samples.burst_ends(time_s)) is not None:
        time_s = repeated_samples.spread(time_s, ends)
    grows = np.append(True, np.diff(time_s) > 0)
    time_s, samples, held = time_s[grows], samples[grows], held[grows]
    repeats = repeated_samples.find_repeats(samples[~held])
    if repeats is None:
        return time_s[~held], samples[~held]
    return repeated_samples.fresh_times(repeats, time_s[~held]), samples[~held][repeats.fresh]


def _laid(time_s: Array, samples: Array, clipped: Bools, own_hz: float, rate_hz: float
          ) -> tuple[Array, Array, Bools, Bools, bool]:
    """On the grid, and whether it stood there."""
    grid_s = time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * rate_hz + 0.5) + 1) / rate_hz
    if len(grid_s) == len(time_s) and np.abs(time_s - grid_s).max() < ROUNDING_STEPS / rate_hz:
        return grid_s, samples, np.ones(len(grid_s), dtype=np.bool_), clipped, True
    laid = on_even_grid(time_s, samples, own_hz, rate_hz)
    grid_s = time_s[0] + np.arange(len(laid)) / rate_hz
    hole_s = _FEW_STEPS / min(own_hz, rate_hz)
    inside = np.zeros(len(grid_s) + 1)
    wide = np.flatnonzero(np.diff(time_s) > hole_s)
    np.add.at(inside, np.searchsorted(grid_s, time_s[wide] + _INSTANT_S), 1)
    np.add.at(inside, np.searchsorted(grid_s, time_s[wide + 1] - _INSTANT_S), -1)
    near = np.zeros(len(grid_s), dtype=np.bool_)
    apart_s = max(1.0 / own_hz, 1.0 / rate_hz)
    for at_s in time_s[clipped]:
        near[slice(*np.searchsorted(grid_s, [at_s - apart_s, at_s + apart_s]))] = True
    return grid_s, laid, np.cumsum(inside)[:-1] == 0, near, False


BLOCK_S = 2.0
LEAST_PART_S = 10.0
"""What sat still for less than that says nothing of how it sat."""
GRAVITY_WITHIN = 0.05
"""Zero errors of 0.3 m/s2 and gains that are 2 % off are what phones have."""
NO_GRAVITY_MPS2 = 0.7
"""Less than that is braking and errors of zero (as ``GRAVITY_WITHIN``), and no gravity."""
_CHANGE_MPS = 25.0  # from 90 km/h to a halt
_ROUNDS = 30
_FINE_S = 0.2


@dataclass(frozen=True)
class Felt:
    """What is felt on the whole: the vector (axes,) in the unit of the record, its size, and how many m/s2 are one unit
    if that is gravity, in m/s2, g or thousandths of g; None: it is not."""

    mean: Array
    size: float
    unit_mps2: float | None


def felt(time_s: Array, samples: Array, unit_mps2: float | None = None) -> Felt:
    """Of samples (n, axes) at times (n,) [s], in a unit of so many m/s2; None: not known, the size of gravity shows
    it."""
    mean = steady_mean(block_means(time_s, samples, BLOCK_S)[1])
    size = float(np.linalg.norm(mean))
    units = (1.0, STANDARD_GRAVITY_MPS2, STANDARD_GRAVITY_MPS2 / 1000.0) if unit_mps2 is None else (unit_mps2,)
    fits = [one for one in units if abs(size * one / STANDARD_GRAVITY_MPS2 - 1.0) < GRAVITY_WITHIN]
    return Felt(mean, size, fits[0] if fits else None)


def block_means(time_s: Array, samples: Array, block_s: float) -> tuple[Array, Array]:
    """Middles (k,) [s] and means (k, axes) of blocks of so long, in which there are samples."""
    number = np.floor((time_s - time_s[0]) / block_s).astype(np.int64)
    there, first = np.unique(number, return_inverse=True)
    counts = np.bincount(first)
    means = np.stack([np.bincount(first, axis) / counts for axis in samples.T], axis=1)
    return time_s[0] + (there + 0.5) * block_s, means


def steady_mean(means: Array) -> Array:
    """The geometric median (axes,) of vectors (k, axes): half of them may be anything, and it turns as they turn.

    Source: E. Weiszfeld, Tohoku Mathematical Journal 43, 1937.
    """
    found = means.mean(axis=0)
    for _ in range(_ROUNDS):
        apart = np.linalg.norm(means - found, axis=1)
        weight = 1.0 / np.maximum(apart, 1e-6 * (apart.max() or 1.0) + 1e-12)
        found = weight @ means / weight.sum()
    return np.asarray(found)


def upwards(time_s: Array, samples: Array) -> tuple[Array, float]:
    """What of samples (n, axes) [m/s2] points up (n,), without gravity, and how far gravity lies from the nearest axis
    [rad].

    Problem: a phone sits in its mount at any angle, its program may write g or m/s2, count all axes the other way
    round, leave gravity out, and the phone may slip half way. Solution: over tens of seconds of driving what a recorder
    feels is gravity, for braking, curves and hills come to little; a mean that outliers do not move is taken of the
    means of short blocks. Its size shows the unit, its direction the vertical. An accelerometer at rest feels a push
    upwards of 1 g; a program that writes the opposite does so for every acceleration, so along the direction in which
    gravity is felt both read the same.

    A turn in the mount is a lasting change of that direction that is larger than braking and curves can feign: within
    the time that is compared a car changes its velocity by no more than ``_CHANGE_MPS``, and what is left is held
    against the scatter of the blocks (``estimation.drive_alignment``).
    """
    gravity = felt(time_s, samples).mean
    size = float(np.linalg.norm(gravity))
    up = gravity / size
    return samples @ up - size, float(np.arccos(min(1.0, np.abs(up).max())))


def turns(time_s: Array, samples: Array) -> list[tuple[float, str]]:
    """When a recorder turned in its mount [s], and by how much in words, in order of time."""
    at_s, means = block_means(time_s, samples, BLOCK_S)
    found = []
    for place, words in _turns(means):
        middle_s = 0.5 * (at_s[place - 1] + at_s[place])
        near = np.abs(time_s - middle_s) <= 2 * BLOCK_S
        found.append((_instant(time_s[near], samples[near]), words))
    return found


def _turns(means: Array, first: int = 0) -> list[tuple[int, str]]:
    """Blocks (k, 3) at which something else begins, counted from ``first``."""
    least = round(LEAST_PART_S / BLOCK_S)
    if len(means) < 2 * least:
        return []
    sizes = np.arange(1, len(means))[:, None]
    before = np.cumsum(means, axis=0)[:-1] / sizes
    after = np.cumsum(means[::-1], axis=0)[:-1][::-1] / sizes[::-1]
    apart = np.linalg.norm(after - before, axis=1) * np.sqrt(sizes * sizes[::-1])[:, 0]
    place = least + int(np.argmax(apart[least - 1 : len(means) - least]))
    sides = [sitting(one, None, None) for one in (means[:place], means[place:])]
    words = has_moved(*sides)
    shorter_s = min(place, len(means) - place) * BLOCK_S
    feigned = atan(_CHANGE_MPS / shorter_s / STANDARD_GRAVITY_MPS2)
    if not words or angle_rad(sides[0].gravity, sides[1].gravity) < max(radians(MOVED_DEG), feigned):
        return []
    return [*_turns(means[:place], first), (first + place, words), *_turns(means[place:], first + place)]


def _instant(time_s: Array, samples: Array) -> float:
    """The instant after which samples (n, 3) of some seconds are others than before [s]."""
    at_s, means = block_means(time_s, samples, _FINE_S)
    if len(at_s) < 3:
        return float(time_s.mean())
    left = [float(np.sum((one - one.mean(axis=0)) ** 2) + np.sum((other - other.mean(axis=0)) ** 2))
            for one, other in ((means[:place], means[place:]) for place in range(1, len(means)))]
    return float(0.5 * (at_s[(place := int(np.argmin(left)))] + at_s[place + 1]))


DAY_S = DAY_US / US_PER_S
_DRIFT = 1e-4
_JUMP_S = 0.7
"""Both as on board (``service/timebase``)."""


def fix_times_s(placed_s: Array, time_of_day_s: Array) -> Array:
    """Times (k,) of fixes on the recorder's clock [s].

    placed_s         (k,) as they were placed on board [s], growing but for single ones
    time_of_day_s    (k,) as the fixes name it [s]; NaN where they do not: these stay where they were placed
    """
    times_s = placed_s.copy()
    named = np.flatnonzero(np.isfinite(time_of_day_s))
    if not len(named):
        return times_s
    floor_s = placed_s[named] - time_of_day_s[named]
    floor_s = floor_s - DAY_S * np.round((floor_s - floor_s[0]) / DAY_S)
    jumps = np.flatnonzero(np.abs(np.diff(floor_s)) > _JUMP_S) + 1
    for part in np.split(np.arange(len(named)), jumps):
        drifted_s = _DRIFT * placed_s[named[part]]
        lowest_s = np.minimum.accumulate((floor_s[part] + drifted_s)[::-1])[::-1] - drifted_s
        times_s[named[part]] += lowest_s - floor_s[part]
    return times_s


_LATE = 1.5  # of the usual pace
_SLOWEST_S, _USUAL_S = 5.0, 1.0
"""Receivers and on-board diagnosis send once a second at least, the slowest receivers once in five."""
_ALIKE = (0.7, 1.4)
"""Places lie on the way: no detour, and no rounding of a unit, makes so much of it."""
_LEAST_M = 50.0
_MOVING = 0.3  # of the fastest


def new_rows(time_s: Array, columns: Array, speed_mps: Array, hides_m: float = np.inf) -> Whole:
    """Rows with a fix that counts, of columns (n, c) at growing times (n,) [s]: those that are new, and of those that
    repeat one before some, as long as the car went no farther since, at its speed (n,), than ``hides_m``."""
    fresh = np.flatnonzero(repeated_samples.fresh_samples(columns))
    if not len(fresh):
        return fresh
    usual_s = float(np.median(np.diff(time_s[fresh]))) if len(fresh) > 1 else _SLOWEST_S
    pace_s = min(usual_s, _USUAL_S)
    kept = [fresh]
    for first, last in zip(fresh, np.append(fresh[1:], len(time_s)), strict=True):
        may_s = hides_m / speed_mps[first] if speed_mps[first] > 0 else np.inf
        end_s = min(time_s[last - 1], time_s[first] + may_s)
        late_s = _LATE * (min(usual_s, _SLOWEST_S) if last < len(time_s) else pace_s)
        if time_s[last - 1] - time_s[first] > late_s:
            rows = np.searchsorted(time_s, np.append(np.arange(time_s[first] + pace_s, end_s, pace_s), end_s), "right")
            kept.append(rows - 1)
    return np.unique(np.concatenate(kept)).astype(np.int64)


def hidden_m(lat_deg: Array, lon_deg: Array) -> float:
    """How far a car can go while its places (k,) [degrees] do not change: the step in which they are written [m]."""
    lat_step_deg, lon_step_deg = map(repeated_samples.resolution, (lat_deg, lon_deg))
    step_deg = np.array([lat_step_deg, lon_step_deg * np.cos(np.radians(lat_deg.mean()))])
    return float(EARTH_RADIUS_M * np.radians(step_deg.max()))


def speeds_of_places(time_s: Array, lat_deg: Array, lon_deg: Array) -> Array:
    """Speeds (k,) [m/s] at fixes with places (k,) [degrees], k at least 2: over the steps before and after each."""
    step_m, step_s = ways_m(lat_deg, lon_deg), np.diff(time_s)
    middle = (step_m[:-1] + step_m[1:]) / (step_s[:-1] + step_s[1:])
    return np.concatenate([step_m[:1] / step_s[:1], middle, step_m[-1:] / step_s[-1:]])


def ways_m(lat_deg: Array, lon_deg: Array) -> Array:
    """From each place (k,) to the next, (k - 1,) [m]."""
    east_deg = (np.diff(lon_deg) + 180.0) % 360.0 - 180.0
    across = np.cos(np.radians(lat_deg[:-1]))
    return np.asarray(EARTH_RADIUS_M * np.radians(np.hypot(np.diff(lat_deg), east_deg * across)))


def way_over_speed(time_s: Array, lat_deg: Array, lon_deg: Array, speed_mps: Array) -> float | None:
    """How far the places (k,) lie apart, over the way by the speeds (k,), where it is no usual error: a speed in
    another unit than was said. None: they agree, or the way is too short to decide."""
    middle_mps = 0.5 * (speed_mps[1:] + speed_mps[:-1])
    moving = middle_mps > _MOVING * middle_mps.max()  # a standing car's places wander
    by_speed_m = float((middle_mps * np.diff(time_s))[moving].sum())
    by_place_m = float(ways_m(lat_deg, lon_deg)[moving].sum())
    if max(by_speed_m, by_place_m) < _LEAST_M:
        return None
    ratio = by_place_m / max(by_speed_m, 1e-9)
    return None if _ALIKE[0] <= ratio <= _ALIKE[1] else ratio
