"""What runs that repeat each other differ by: noise that no model explains, whatever its kind.

Problem: the noise of a sensor is estimated where no car moves it, at the highest frequencies. A rig that sticks here
and there, a cable or a rubber that warms up differ from run to run in the middle of the band; a model that has to
explain that as well seems to lack something. Solution: the variance of runs of one excitation around their mean
estimates all that does not repeat (analysis of variance: R. A. Fisher, Statistical Methods for Research Workers, 1925).
No shaker moves twice quite alike; the model predicts what that makes, so that it is the residuals that are compared.
On roads no two drives have the same places and speeds, so that this is known of rigs only.

The noise of the sensors, estimated from the residuals of a model; and the error that it alone makes.

Problem: an error means little without the noise floor, below which no model comes. Solution: at the highest frequencies
a car moves no sensor, so that what is there is the sensor's own noise, unless that went through the recorder's filter
as well: then the quietest band that passes is noise. Every other band that is no louder is pooled with it, the quietest
first. Where the highest frequencies are outside of the pass band, because somebody filtered the record, the quietest
remaining band is the first. What runs that repeat each other differ by is noise as well; and so is what does not grow
with the motion: what a car does grows with how much it is shaken, what a sensor adds does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.bounds import DISCREPANCY, SURE_SIGMA, UNUSUAL_SIGMA
from logger.dsp.white_noise import EQUAL_SIGMA, OF_QUIETEST, pooled
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.signals import SignalResiduals, by_signal
from logger.lab.likelihood.whittle import UNEXPLAINED, Bands
from logger.profiles.excitation import Excitation
from logger.runs import Run


@dataclass(frozen=True)
class Repeats:
    """Runs that repeat others.

    names             of the runs
    deviation_mps2    r.m.s. of what does not repeat [m/s2]
    freedom           degrees of freedom of that
    """

    names: tuple[str, ...]
    deviation_mps2: float
    freedom: int


def find_repeats(runs: Sequence[Run], residuals: Sequence[Array] | None = None) -> Repeats | None:
    """The runs of one excitation, and what the sensor's acceleration differs by in them beyond what a model says, by
    its residuals (n,) per run; None: what was measured is compared. None where none repeats another."""
    samples = [run.measured_mps2 for run in runs] if residuals is None else list(residuals)
    groups: list[list[int]] = []
    for index, run in enumerate(runs):
        group = next((one for one in groups if repeat_each_other(runs[one[0]], run)), None)
        if group is None:
            groups.append([index])
        else:
            group.append(index)
    repeated = [group for group in groups if len(group) > 1]
    if not repeated:
        return None
    squares = freedom = 0.0
    for group in repeated:
        first, count = max(runs[one].first for one in group), min(runs[one].count for one in group)
        both = np.stack([samples[one][first:count] for one in group])
        squares += float(((both - both.mean(axis=0)) ** 2).sum())
        freedom += (len(group) - 1) * both.shape[1]
    return Repeats(tuple(runs[one].name for group in repeated for one in group), float(np.sqrt(squares / freedom)),
                   int(freedom))


def repeat_each_other(first: Run, other: Run) -> bool:
    """Whether two runs are of one excitation: tables and forces differ by no more than what counts as explained. (Two
    runs of one command on a bench car were measured to differ by 6 to 9 %, other sweeps differ by their whole size.)
    What nothing drives repeats another that begins alike: then all of it is."""
    one, two = first.track, other.track
    if not (isinstance(one, Excitation) and isinstance(two, Excitation)) or (
            (one.rate_hz, one.start_s, one.forces) != (two.rate_hz, two.start_s, two.forces)):
        return False
    pairs = [(first.measured_mps2, other.measured_mps2) if one.is_still else (one.elevation_m, two.elevation_m)]
    if one.force_n is not None and two.force_n is not None:
        pairs += zip(one.force_n.T, two.force_n.T, strict=True)
    return all(_alike(here, there) for here, there in pairs)


def _alike(one: Array, two: Array) -> bool:
    count = min(len(one), len(two))
    one, two = one[:count] - one[:count].mean(axis=0), two[:count] - two[:count].mean(axis=0)
    return one.shape == two.shape and bool(np.linalg.norm(one - two) <= UNEXPLAINED * np.linalg.norm(one))


# Noise that is quieter than this share of the quietest band where the filter begins went through the filter. The mean
# over each sample leaves the highest frequencies two thirds of what it leaves there (the square of a sinc).
_FILTERED = 0.75
# Without a fit, equally loud bands are noise if they hold this share of all degrees of freedom, and the highest
# frequencies at most that share of their power, which the recorder's filter leaves: what a car leaves falls towards the
# highest band, and the sensor's own noise does not pass through the filter (judgements).
_FLAT_SHARE, _FILTERED_SHARE = 0.22, 0.01


@dataclass(frozen=True, eq=False)
class NoiseLevel:
    """The noise of the sensors: its standard deviation, and the standard error of that [m/s2]."""

    deviation_mps2: float
    standard_error_mps2: float


@dataclass(frozen=True)
class SignalErrors:
    """Normalised r.m.s. errors of one signal before and after, and the error that its noise makes."""

    before: float
    after: float
    noise_floor: float


def sensor_noise_of(posterior: Posterior, state: State) -> NoiseLevel:
    """The noise of the sensor under the residuals of a fitted state, or the r.m.s. of several sensors'; without their
    rounding where readings are taken for bounds."""
    sensors = [one for one in _by_signal(posterior, state) if not one.name]
    each = [_noise_of(one) for one in sensors]
    weights = np.array([sum(map(len, one.residuals)) for one in sensors], float)
    deviation = float(np.sqrt(np.average([one.deviation_mps2**2 for one in each], weights=weights)))
    parts = [weight / weights.sum() * one.deviation_mps2 / deviation * one.standard_error_mps2
             for weight, one in zip(weights, each, strict=True)]
    return NoiseLevel(deviation, float(np.linalg.norm(parts)))


def sensor_noise_with_rounding(posterior: Posterior, state: State) -> NoiseLevel:
    """The noise with rounding, which adds a twelfth of the step's square to its variance."""
    return sensor_noise_of(posterior.without_rounding(), state)


def signal_errors_of(posterior: Posterior, before: State, after: State) -> dict[str, SignalErrors]:
    """Errors of the other signals than the sensor's acceleration, by name, under one model and under another."""
    was, now = (signals_with_noise(posterior, posterior.residuals(one)) for one in (before, after))
    return {name: SignalErrors(was[name][0], *now[name]) for name in now if name}


def signals_with_noise(posterior: Posterior, residuals: Sequence[Array]) -> dict[str, tuple[float, float]]:
    """Normalised r.m.s. errors by residuals (n,) per run, and those that noise makes, of all signals by name; empty
    where the sensor's acceleration (whose name is empty) is the only one."""
    if not any(run.signals for run in posterior.runs.runs):
        return {}
    found: dict[str, Array] = {}
    for one in by_signal(posterior.readings, posterior.bands, residuals):
        counts = sum(int(run.read[run.first:].sum()) for run in one.runs)
        left = sum(float((part[run.first:]**2).sum()) for run, part in zip(one.runs, one.residuals, strict=True))
        found[one.name] = found.get(one.name, 0.0) + np.array(
            [left, counts * _noise_of(one).deviation_mps2**2, counts * one.size**2])
    return {name: (float(np.sqrt(left / whole)), float(np.sqrt(noise / whole)))
            for name, (left, noise, whole) in found.items() if whole > 0}


def _by_signal(posterior: Posterior, state: State) -> list[SignalResiduals]:
    """Residuals of a state by signal and sensor."""
    return by_signal(posterior.readings, posterior.bands, posterior.residuals(state))


def _noise_of(one: SignalResiduals) -> NoiseLevel:
    """The noise of one signal; of a sensor no less than what repeated runs differ by."""
    scaled = [residual * np.sqrt(share) for residual, share in zip(one.residuals, one.shares, strict=True)]
    found = sensor_noise(one.bands, scaled, DISCREPANCY * one.size)
    repeats = None if one.name else find_repeats(one.runs, one.residuals)
    if repeats is None or repeats.deviation_mps2 <= found.deviation_mps2:
        return found
    return NoiseLevel(repeats.deviation_mps2, repeats.deviation_mps2 / float(np.sqrt(2 * repeats.freedom)))


def sensor_noise(bands: Sequence[Bands], residuals: Sequence[Array], least_mps2: float, fitted: bool = True
                 ) -> NoiseLevel:
    """The sensor's noise under residuals (n,), per run; no less than ``least_mps2``.

    fitted    the residuals are a fit's, whose quietest bands are noise; else bands have to be equally loud to be taken
              for noise that was filtered, and noise that was not filtered is read at the highest frequencies alone
    """
    quiet = [one.noise_band_power(residual) for one, residual in zip(bands, residuals, strict=True)]
    freedom = sum(n for _, n in quiet)
    power = sum(level * n for level, n in quiet) / freedom if freedom else 0.0
    powers = [one.power(residual) for one, residual in zip(bands, residuals, strict=True)]
    places = range(min(map(len, powers)))
    freedoms = [sum(float(one.freedom[place]) for one in bands) for place in places]
    levels = [sum(float(one.freedom[place] * own[place]) for one, own in zip(bands, powers, strict=True))
              / freedoms[place] for place in places]
    highest = (power, freedom) if freedom else (levels[-1], freedoms[-1])
    by_level = sorted(zip(levels, freedoms, strict=True))
    louder = EQUAL_SIGMA
    if not freedom or power < _FILTERED * by_level[0][0]:
        (power, freedom), *by_level = by_level
        louder = OF_QUIETEST
    power, freedom = pooled(by_level, power, freedom, louder)
    # Below 30 Hz all bands are full of what the road does.
    flat = freedom > _FLAT_SHARE * sum(freedoms) and all(one.edges_hz[-1] > 30.0 for one in bands)
    if not fitted and not (flat and highest[0] < _FILTERED_SHARE * power):
        power, freedom = highest
    power = max(power, least_mps2**2)
    return NoiseLevel(float(np.sqrt(power)), float(np.sqrt(power / (2 * freedom))))


def gain_of_full_explanation(posterior: Posterior, state: State) -> float:
    """Decrease of minus twice the log-likelihood if the residuals were just small enough to count as explained; at
    least 0. Bands that are quiet make up for those that are not. What surely does not grow with the motion is noise of
    a colour, which no effect explains."""
    found = 0.0
    for signal in _by_signal(posterior, state):
        steady = _steady_of(signal)
        noise = (1 + UNEXPLAINED) ** 2 * np.maximum(_noise_of(signal).deviation_mps2**2, steady)
        found += sum(float(one.freedom @ np.log(one.levels(residual) / np.maximum(noise / share, one.floor)))
                     for one, residual, share in zip(signal.bands, signal.residuals, signal.shares, strict=True))
    return max(0.0, found)


def _steady_of(signal: SignalResiduals) -> Array:
    """Power (b,) of a sensor's residuals that surely does not grow with the motion; 0 of another signal, and where runs
    are compared in several bands."""
    bands = signal.bands
    if signal.name or len({one.edges_hz.tobytes() for one in bands}) > 1:
        return np.zeros(1)
    motions = [run.measured_mps2 * run.read - residual
               for run, residual in zip(signal.runs, signal.residuals, strict=True)]
    power, motion = (np.concatenate([one.block_powers(samples) for one, samples in zip(bands, some, strict=True)])
                     for some in (signal.residuals, motions))
    return steady_power(power, motion)


def excess_over_noise(posterior: Posterior, state: State, chance: float) -> float:
    """The largest of ``excess_by_signal``, whose arguments these are."""
    return max(excess_by_signal(posterior, state, chance).values())


def excess_by_signal(posterior: Posterior, state: State, chance: float, noise: NoiseLevel | None = None,
                     sigma: float = UNUSUAL_SIGMA) -> dict[str, float]:
    """Share by which the residual is above what right models leave, by name of the signal (empty: the sensor's
    acceleration), of the run where it is largest. They leave the noise, what the model makes of the noise of its
    measured input, the discrepancy of two right simulations, and what is within the prior of calibrated sensors: as
    large a share of what was measured as ``sigma`` deviations of the gain of the sensor, and of that which measured a
    rig's input. (Gains are fitted; how far a sensor is off a straight line, or its cross talk, are of that size at
    most.) A run so short that noise alone may do the same with this probability counts no higher than ``UNEXPLAINED``.

    noise    of the sensors, where it is known; None: estimated from the residuals
    sigma    0: sensors are taken to be right but for their noise
    """
    from scipy.special import gammainccinv

    signals = _by_signal(posterior, state)
    carried = by_signal(posterior.readings, posterior.bands, posterior.carried_noise(state, 0))
    count, found = sum(len(one.bands) for one in signals), dict[str, float]()
    for signal, inputs in zip(signals, carried, strict=True):
        own = noise or _noise_of(signal)
        for run, one, residual, share, moved in zip(signal.runs, signal.bands, signal.residuals, signal.shares,
                                                    inputs.residuals, strict=True):
            sensor = next((one for one in run.signals if one.name == signal.name), run.facts.main)
            of_input = posterior.tolerance.scale if run.timed else 0.0
            chain = sigma * np.hypot(posterior.tolerance.gain_of(sensor), of_input) / DISCREPANCY
            freedom = float(one.freedom.sum())
            expected = one.freedom @ (own.deviation_mps2**2 / share + (1 + chain**2) * one.floor + one.power(moved))
            above = float(np.sqrt(one.freedom @ one.levels(residual) / expected)) - 1
            by_chance = float(np.sqrt(gammainccinv(freedom / 2, chance / count) / (freedom / 2))) - 1
            above = above if above > by_chance else min(above, UNEXPLAINED)
            found[signal.name] = max(above, found.get(signal.name, above))
    return found


def is_within_discrepancy(posterior: Posterior, state: State, other: State) -> bool:
    """Whether two states predict the same of every signal, but for what two right simulations of one model differ by.
    """
    changes = [one - of for one, of in zip(posterior.residuals(state), posterior.residuals(other), strict=True)]
    return all(np.mean(np.concatenate([part[run.first:] for run, part in zip(one.runs, one.residuals, strict=True)])**2)
               < (DISCREPANCY * one.size)**2 for one in by_signal(posterior.readings, posterior.bands, changes))


def floor_error(posterior: Posterior, noise: NoiseLevel) -> float:
    """Noise floor: rms(noise) / rms(measured) over all samples that count, both in the pass band."""
    runs = posterior.runs.runs
    share = np.average([one.share_passed for one in runs], weights=[one.count - one.first for one in runs])
    return float(noise.deviation_mps2 * np.sqrt(share) / posterior.size_mps2)


def steady_power(power: Array, motion: Array) -> Array:
    """The part of the mean power (b,) that surely does not grow with the motion's, by powers (blocks, b) of both: what
    grows is taken to be ``SURE_SIGMA`` standard errors more than it is found to be."""
    grows, errors = growing_power(power, motion)
    return np.maximum(power.mean(axis=0) - np.maximum(grows, 0.0) - SURE_SIGMA * errors, 0.0)


def growing_power(power: Array, motion: Array) -> tuple[Array, Array]:
    """The part of the mean power (b,) that grows with the motion's, and its standard error (b,), by powers (blocks, b)
    of both. In each band the power, block by block, is regressed on that of the model's motion (weighted least squares,
    as of gamma distributed powers); the intercept is noise, of whatever colour."""
    worth = 0.947  # of a block with Hann's taper that overlaps the next by half, over one alone (P. D. Welch 1967)
    grows, errors = np.zeros(power.shape[1]), np.full(power.shape[1], np.inf)
    for band, (one, moved) in enumerate(zip(power.T, motion.T, strict=True)):
        if len(one) < 4 or not np.ptp(moved) > 0 or not one.mean() > 0:
            continue
        # Counted from the mean, motion that hardly varies is no near copy of the ones.
        columns = np.column_stack([np.ones(len(one)), moved / moved.mean() - 1])
        expected = np.full(len(one), one.mean())
        for _ in range(6):
            weights = expected**-2
            inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
            found = inverse @ (columns.T @ (weights * one))
            expected = np.maximum(columns @ found, 0.1 * one.mean())
        spread = float(weights @ (one - columns @ found) ** 2) / (worth * len(one) - 2)
        grows[band], errors[band] = float(found[1]), float(np.sqrt(spread * inverse[1, 1] / worth))
    return grows, errors
