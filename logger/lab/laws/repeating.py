"""Periodic laws: tones in a residual, along the way or in time, and the amplitudes and phases of each run.

A fit by derivatives has to begin within a fraction of a cycle over all of a run. The periodograms of the whitened
residuals of all runs are added, over the way or over the time; the frequency of the largest sum is refined.

An engine and a wheel begin each drive with another phase. A periodic law has two strengths, of its even and its odd
part: its amplitude and its phase as a run begins. Where the phases of runs differ, each run has two strengths of its
own, and all of them are counted as parameters. A model with such a law, compared with other runs, takes them for the
first, the second, ... of those: its error there is that of a refit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.lab.laws.draft import LawContext
from logger.runs import SLOWEST_MPS

_FINER = 8
"""Grid points per resolution of the longest run, so that a peak is met within a sixteenth of a cycle."""
_LOUD = 12.0
"""A peak with so many times the mean power of its neighbours: noise alone has one in some thousand in a hundred
runs."""


def white_residuals(context: LawContext) -> list[Array]:
    """Residuals (n - first,) per run, white in their bands, in units of the noise."""
    posterior = context.posterior
    found = []
    for run, bands, residual in zip(context.runs, posterior.bands, posterior.residuals(context.state), strict=True):
        white = bands.whitener(residual).in_time(residual)
        found.append(np.asarray(white[: run.count - run.first]))
    return found


def spatial_frequency(context: LawContext, per_m: tuple[float, float], speed_power: float = 0.0) -> float | None:
    """The wave number of the strongest line along the way [1/m]; None where none is strong enough.

    per_m          range that is searched
    speed_power    exponent of the growth of its amplitude with the speed
    """
    signals, ways = [], []
    for run, residual, error_m in zip(context.runs, white_residuals(context),
                                      context.posterior.distance_error_m(context.state.record), strict=True):
        speed = np.maximum(run.speed_mps[run.first:], SLOWEST_MPS)
        signals.append(residual * (speed / speed.mean()) ** speed_power)
        ways.append((run.distance_m + error_m)[run.first:])
    longest_m = max(float(np.ptp(one)) for one in ways)
    if not longest_m > 0:
        return None
    grid = np.arange(*per_m, 1 / (_FINER * longest_m))
    power = sum(_power(signal, way, grid) for signal, way in zip(signals, ways, strict=True))
    return _peak(grid, np.asarray(power))


def _peak(grid: Array, power: Array) -> float | None:
    """Abscissa of the largest power, interpolated; None where it is not strong enough."""
    best = int(power.argmax())
    if power[best] < _LOUD * float(np.median(power)):
        return None
    if 0 < best < len(grid) - 1:  # of a parabola through the three highest
        before, top, after = power[best - 1 : best + 2]
        bend = before - 2 * top + after
        offset = 0.5 * float(before - after) / float(bend) if bend else 0.0
        return float(grid[best] + offset * (grid[1] - grid[0]))
    return float(grid[best])


def _power(signal: Array, way: Array, grid: Array) -> Array:
    """Periodogram of a signal (n,) over uneven places (n,) at even wave numbers (g,)."""
    found = np.empty(len(grid))
    # Over equal steps of a wave number the phase factor of each sample is multiplied by another one.
    step = np.exp(-2j * np.pi * (grid[1] - grid[0]) * way)
    for first in range(0, len(grid), 64):  # so often that its rounding stays small
        turned = signal * np.exp(-2j * np.pi * grid[first] * way)
        for index in range(first, min(first + 64, len(grid))):
            found[index] = abs(turned.sum()) ** 2
            turned = turned * step
    return found / len(signal)


# --- a short pulse that repeats along the way ---

_MULTIPLES = 6
"""Of a wheel's turns: the seventh of a tire's is shorter than the contact patch."""
_EVEN_M = 0.05


def _along_the_way(context: LawContext, signals: list[Array]) -> list[Array]:
    """Signals (n,) of the samples that count, at even places along the way of each run."""
    found = []
    for run, signal, error_m in zip(context.runs, signals, context.posterior.distance_error_m(context.state.record),
                                    strict=True):
        way = np.maximum.accumulate((run.distance_m + error_m)[run.first:])
        # From a multiple of the spacing, so that all runs have the same places.
        begin = np.ceil(way[0] / _EVEN_M) * _EVEN_M
        found.append(np.interp(np.arange(begin, way[-1], _EVEN_M), way, signal))
    return found


def comb_frequency(context: LawContext, per_m: tuple[float, float]) -> float | None:
    """The wave number within a range [1/m] whose multiples are together strongest; None where they are not."""
    signals = _along_the_way(context, white_residuals(context))
    longest = max(map(len, signals))
    size = 2 ** int(np.ceil(np.log2(_FINER * _MULTIPLES * longest)))
    power = np.sum([np.abs(np.fft.rfft(one - one.mean(), size)) ** 2 / len(one) for one in signals], axis=0)
    lines = np.arange(*(round(one * size * _EVEN_M) for one in per_m))
    return _peak(lines / (size * _EVEN_M), np.sum([power[n * lines] for n in range(1, _MULTIPLES + 1)], axis=0))


def best_lags_m(context: LawContext, there: list[Array], turn_m: float, apart: bool) -> list[float]:
    """By how much, within a turn, what predictions (n,) per run add to the model's has to come later along the way to
    be most like the residual [m]; of all runs together, or of each (``apart``)."""
    posterior, residuals = context.posterior, context.posterior.residuals(context.state)
    adds = []
    for run, bands, residual, other in zip(context.runs, posterior.bands, residuals, posterior.residuals_of(there),
                                           strict=True):
        white = bands.whitener(residual).in_time(residual - other)
        adds.append(np.asarray(white[: run.count - run.first]))
    likeness = []
    for signal, added in zip(_along_the_way(context, white_residuals(context)), _along_the_way(context, adds),
                             strict=True):
        size = 2 * len(signal)
        lagged = np.fft.irfft(np.fft.rfft(signal, size) * np.conj(np.fft.rfft(added, size)), size)
        likeness.append(lagged[: int(turn_m / _EVEN_M)])
    kinds = likeness if apart else [np.sum(likeness, axis=0)]
    return [float(one.argmax()) * _EVEN_M for one in kinds]


# --- a tone whose frequency wanders ---


@dataclass(frozen=True)
class Tone:
    """A tone of phase 2 pi f (t + c cos(2 pi t / T) + s sin(2 pi t / T)): its mean frequency f [Hz], the amplitudes of
    its phase modulation (c, s) [s] and their period T [s]; its power, in units of the noise's."""

    frequency_hz: float
    wander_cos_s: float
    wander_sin_s: float
    period_s: float
    power: float

    @property
    def wanders(self) -> bool:
        """Whether its frequency changes."""
        return self.wander_cos_s != 0 or self.wander_sin_s != 0


_WINDOW_S, _HOP = 1.0, 0.5
_DEPTHS = np.array([0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4])
"""Of the frequency, as shares: an engine in one gear seldom changes by more."""
_PERIODS_S = np.array([7.0, 8.5, 10.0, 12.0, 14.0, 17.0, 20.0, 24.0, 28.0, 34.0, 40.0])
_PHASES = np.arange(12) * 2 * np.pi / 12
_STEPS_HZ = 0.25
_COHERENT_S = (2.0, 5.0, 12.0, 30.0, 1e9)


def tone_in_time(context: LawContext, hz: tuple[float, float], wanders: bool) -> Tone | None:
    """The strongest tone, with the same phase at the beginning of each run; None where none is strong enough.

    hz         range of its mean frequency
    wanders    its frequency may vary by a sinusoid, of which a record shows half a period or more
    """
    signals = white_residuals(context)
    rate = context.runs[0].rate_hz
    if wanders and max(map(len, signals)) < _PERIODS_S[0] / 2 * rate:
        return None
    began_s = context.runs[0].first / rate
    begin = _steady_tone(signals, rate, hz) if not wanders else _strongest_ridge(signals, rate, began_s, hz)
    at = np.array([begin.frequency_hz, begin.frequency_hz * begin.wander_cos_s,
                   begin.frequency_hz * begin.wander_sin_s, 1 / begin.period_s])
    for coherent_s in _COHERENT_S:
        at = _refine(signals, rate, began_s, at, coherent_s, wanders)
    power = _coherent(signals, rate, began_s, at, _COHERENT_S[-1])
    if power < _LOUD * len(signals) or not hz[0] < at[0] < hz[1]:
        return None
    return Tone(float(at[0]), float(at[1] / at[0]), float(at[2] / at[0]), float(1 / at[3]), power)


def _steady_tone(signals: list[Array], rate_hz: float, hz: tuple[float, float]) -> Tone:
    """The tone of the largest periodogram."""
    size = _FINER * max(map(len, signals))
    power = sum(np.abs(np.fft.rfft(one, size)) ** 2 / len(one) for one in signals)
    f_hz = np.fft.rfftfreq(size, 1 / rate_hz)
    inside = (f_hz > hz[0]) & (f_hz < hz[1])
    best = int(np.argmax(np.where(inside, power, 0.0)))
    return Tone(float(f_hz[best]), 0.0, 0.0, _PERIODS_S[-1], 0.0)


def _strongest_ridge(signals: list[Array], rate_hz: float, began_s: float, hz: tuple[float, float]) -> Tone:
    """The modulated tone along which the power of short windows is largest."""
    size, hop = round(_WINDOW_S * rate_hz), round(_WINDOW_S * _HOP * rate_hz)
    taper = np.hanning(size + 1)[:-1]
    padded = round(rate_hz / _STEPS_HZ)
    count = 1 + (max(map(len, signals)) - size) // hop
    power = np.zeros((count, padded // 2 + 1))
    for one in signals:
        windows = np.lib.stride_tricks.sliding_window_view(one, size)[::hop]
        power[: len(windows)] += np.abs(np.fft.rfft(windows * taper, padded, axis=1)) ** 2
    power -= np.median(power, axis=0)  # what is as loud all along is no tone that wanders
    middle_s = began_s + (np.arange(count) * hop + 0.5 * size) / rate_hz
    best = (-np.inf, 0.0, 0.0, 0.0, 1.0)
    f_hz = np.arange(*hz, _STEPS_HZ)
    rows = np.arange(count)
    for period_s in _PERIODS_S:
        for phase in _PHASES:
            swing = np.cos(2 * np.pi * middle_s / period_s + phase)
            for depth in _DEPTHS:
                place = np.rint(f_hz[:, None] * (1 + depth * swing) / _STEPS_HZ).astype(int)
                inside = place < power.shape[1]
                sums = (power[rows, np.where(inside, place, 0)] * inside).sum(axis=1)
                top = int(sums.argmax())
                if sums[top] > best[0]:
                    best = (float(sums[top]), float(f_hz[top]), float(depth), float(phase), float(period_s))
    _, frequency_hz, depth, phase, period_s = best
    late_s = depth * period_s / (2 * np.pi)  # the integral of the swing
    return Tone(frequency_hz, late_s * np.sin(phase), late_s * np.cos(phase), period_s, 0.0)


def _coherent(signals: list[Array], rate_hz: float, began_s: float, at: Array, coherent_s: float) -> float:
    """Power of the tone with these numbers, summed coherently over pieces of this length."""
    found = 0.0
    for one in signals:
        time_s = began_s + np.arange(len(one)) / rate_hz
        turn = 2 * np.pi * time_s * at[3]
        turned = one * np.exp(-2j * np.pi * (at[0] * time_s + at[1] * np.cos(turn) + at[2] * np.sin(turn)))
        pieces = max(1, int(len(one) / (coherent_s * rate_hz)))
        size = len(one) // pieces
        sums = turned[: pieces * size].reshape(pieces, size).sum(axis=1)
        found += float((np.abs(sums) ** 2).sum()) / size / pieces
    return found


def _refine(signals: list[Array], rate_hz: float, began_s: float, at: Array, coherent_s: float, wanders: bool) -> Array:
    """The numbers of a tone that maximise that power, by the simplex method."""
    from scipy.optimize import minimize

    lasts_s = min(coherent_s, max(map(len, signals)) / rate_hz)
    # A quarter of a cycle within what is coherent, by each number.
    late = max(0.1, 0.25 / (2 * np.pi * lasts_s * at[3]))
    sizes = np.array([0.25 / lasts_s, late, late, 0.05 / (2 * np.pi * lasts_s * max(np.hypot(at[1], at[2]), 0.1))])
    free = [0, 1, 2, 3] if wanders else [0]

    def negative_power(x: Array) -> float:
        there = at.copy()
        there[free] += x * sizes[free]
        return -_coherent(signals, rate_hz, began_s, there, coherent_s)

    simplex = np.vstack([np.zeros(len(free)), np.eye(len(free))])
    found = minimize(negative_power, np.zeros(len(free)), method="Nelder-Mead",
                     options={"initial_simplex": simplex, "maxfev": 80 * len(free), "xatol": 0.02, "fatol": 0.1})
    there = at.copy()
    there[free] += found.x * sizes[free]
    return there


ALL_ALIKE: Sequence[str] = ("",)
EACH = "_each"
"""End of the names of laws with a phase in each run."""
BEGINS = ", with its own phase in each run"
_MOST = 8


def each_run(context: LawContext) -> Sequence[str]:
    """Names of the runs in such a law's numbers; none for a single run, or for more runs than a law can list."""
    count = len(context.runs)
    return [f"run_{number}" for number in range(1, count + 1)] if 1 < count <= _MOST else []


def in_run(name: str, run: str, unit: str) -> str:
    """Name of a number of a run, its unit last."""
    return "_".join(filter(None, (name, run, unit)))


def of_run(run: str) -> str:
    """The run in words, as the end of a meaning."""
    return f" in run {run.removeprefix('run_')}" if run else ""
