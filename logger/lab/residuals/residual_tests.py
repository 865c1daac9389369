"""Tests of a model's residual: a fixed list, which knows no effect.

Problem: a residual has to be read by people who want to know whether physics is missing, and of which kind. Solution:
each test asks one question (does it follow the road, is the car's answer proportional, does it owe to the direction of
motion ...), and comes with a value, its standard error where it has one, how probable such a value would be in a
residual that is noise, and a sentence that says it plainly. A test finds something when it is improbable by chance and
large enough to matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.identification.residual_whiteness import LAGS, autocorrelation
from logger.lab.likelihood.lag import Lags, constant, drift, lags
from logger.lab.residuals.block_statistics import autocorrelations, band_pass, mean_of_blocks, rank_correlation, rms
from logger.lab.residuals.breakdown import BAND_NAMES, Breakdown, ModelResiduals, Part, block_means, short_names
from logger.lab.residuals.force_state_map import Curve, ForceMap, Term, force_map
from logger.lab.residuals.road_coherence import Coherence, with_road
from logger.lab.residuals.spectral_lines import NEIGHBOURS, loudest, periodogram

Array = npt.NDArray[np.float64]

DOUBT = 0.002
"""A test whose result is less probable than this finds something: of some fifteen tests, one is false in thirty
comparisons."""
_LEAST_SHARE = 0.02
_LEAST_CHANGE = 0.02
_LEAST_LEAN = 0.3
_ALIKE = 0.5
_HIGHEST_OF_RATE = 0.38
_LONG_BLOCK_S = 2.0
_TONE_WIDTH_HZ = 0.4
_SPEED_SPREAD = 1.15
_LEAST_LOG_FACTOR = 0.25
_GROWN = 1.3
_MEMORY = 50
_LEAST_SHIFT_S = 0.003
_LEAST_DRIFT_M, _MUCH_DRIFT_M = 0.05, 0.3
_UNKNOWN = float("nan")


@dataclass(frozen=True)
class ResidualTest:
    """What one test found.

    value, unit        what it is, and its standard error where there is one; NaN where the runs cannot tell
    p_value            how probable it would be in noise; NaN where the runs cannot tell
    large              whether it is large enough to matter
    road               whether it ties the residual to the road or to the car's motion
    sentence           what it says when it is found
    """

    name: str
    value: float
    unit: str
    standard_error: float | None
    p_value: float
    large: bool
    road: bool
    sentence: str

    @property
    def found(self) -> bool:
        """Whether it is there, and matters."""
        return bool(self.p_value < DOUBT and self.large)


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """All tests of a residual, and what they were read from, for pictures."""

    tests: tuple[ResidualTest, ...]
    coherence: Coherence
    forces: ForceMap
    alignment: Lags

    @property
    def found(self) -> tuple[ResidualTest, ...]:
        """Those that are there."""
        return tuple(one for one in self.tests if one.found)


def run_residual_tests(residuals: ModelResiduals, where: Breakdown, unmoved: ModelResiduals) -> ResidualTests:
    """Test the residuals of a model.

    where      where it sits
    unmoved    the same car on the distances as they were recorded, which alignment is asked of
    """
    coherence, forces, alignment = with_road(residuals), force_map(residuals), lags(unmoved.runs, unmoved.predictions)
    drifting = _drift(alignment)
    tests = (
        drifting, _shift(alignment, drifting), _whiteness(residuals), _frequency(residuals, where),
        _follows_road(residuals, coherence), _gain(residuals),
        _proportion(residuals), _by_rate(forces), _direction(forces, residuals), _by_travel(forces), _lean(residuals),
        _excitation(residuals, where), _speed(residuals), _place(residuals, where), _tone(residuals),
    )
    return ResidualTests(tests, coherence, forces, alignment)


# --- the residual by itself ---


def _whiteness(residuals: ModelResiduals) -> ResidualTest:
    test = autocorrelation(residuals.residual, 0)
    rho = autocorrelations(residuals.residual, LAGS)
    largest = int(np.abs(rho).argmax())
    error = sum(map(len, residuals.residual)) ** -0.5
    return ResidualTest("whiteness", float(rho[largest]), "1", error, test.p_value, abs(rho[largest]) > 0.1, False,
                f"The residual is not white: samples {(largest + 1) / residuals.rate_hz * 1000:.0f} ms apart have a "
                f"correlation of {rho[largest]:.2f}.")


def _frequency(residuals: ModelResiduals, where: Breakdown) -> ResidualTest:
    """The band that holds most beyond what white noise would leave in it: F tests, the best of some bands."""
    from scipy.stats import f

    parts = where.frequency
    whole, span_s = parts[-1].high, sum(map(len, residuals.residual)) / residuals.rate_hz
    chances = []
    for part in parts:
        width = part.high - part.low
        ratio = part.share / width / max((1 - part.share) / (whole - width), 1e-300)
        freedom = 1.6 * span_s
        chances.append(float(f.sf(ratio, max(freedom * width, 1.0), freedom * (whole - width))) * len(parts))
    best = max((i for i in range(len(parts)) if chances[i] < DOUBT), key=lambda i: parts[i].share,
               default=int(np.argmin(chances)))
    part = parts[best]
    width = (part.high - part.low) / whole
    return ResidualTest("frequency", part.share, "1", None, min(chances[best], 1.0), part.share > 2 * width, False,
                f"{_percent(part.share)} of the residual's power lies {_band_words(part)}, where white noise would "
                f"have {_percent(width)}; the error there is {part.error_text(2)}.")


def _lean(residuals: ModelResiduals) -> ResidualTest:
    """Skewness, with Student's test of the cubes of blocks."""
    scale = rms(residuals.residual)
    if not scale > 0:
        return _nothing("lean", "1")
    mean, error, p_value = mean_of_blocks([(one / scale) ** 3 for one in residuals.residual], residuals, _LONG_BLOCK_S)
    return ResidualTest("lean", mean, "1", error, p_value, abs(mean) > _LEAST_LEAN, True,
                f"The residual has its sharp peaks {'upward' if mean > 0 else 'downward'} (skewness {mean:.1f}): "
                f"something pushes the body {'up' if mean > 0 else 'down'} in short blows.")


def _tone(residuals: ModelResiduals) -> ResidualTest:
    """The frequency that stands out most, of all runs."""
    tones = []
    for run, residual in zip(residuals.runs, residuals.residual, strict=True):
        f_hz = np.fft.rfftfreq(len(residual), 1 / residuals.rate_hz)
        reach = max(NEIGHBOURS, round(_TONE_WIDTH_HZ * len(residual) / residuals.rate_hz))
        found = loudest(periodogram(residual), reach=reach)
        if found is not None:
            tones.append((found[1] * len(residuals.runs), float(f_hz[found[0]]), short_names(residuals.runs)[run.name]))
    if not tones:
        return _nothing("tone", "Hz")
    p_value, at_hz, name = min(tones)
    return ResidualTest("tone", at_hz, "Hz", None, min(p_value, 1.0), True, False,
                f"A single frequency stands out in the residual: {at_hz:.1f} Hz, in {name}. Something hums or rings "
                "there.")


# --- the residual and the road ---


def _follows_road(residuals: ModelResiduals, coherence: Coherence) -> ResidualTest:
    top = _HIGHEST_OF_RATE * residuals.rate_hz
    share, p_value = coherence.explained(0.0, top)
    bands = [(coherence.explained(band.from_hz, min(band.to_hz, top))[0] * _power(coherence, band.from_hz, band.to_hz),
              band) for band in residuals.bands if band.from_hz < top]
    band = max(bands, key=lambda one: one[0])[1]
    return ResidualTest("coherence", share, "1", None, p_value, share > _LEAST_SHARE, True,
                f"At least {_percent(share)} of the residual is coherent with the road, most of it "
                f"{_AROUND[band.name]}. This part is not noise; a linear effect could cause it.")


def _gain(residuals: ModelResiduals) -> ResidualTest:
    size = sum(float(one @ one) for one in residuals.model) / sum(map(len, residuals.model))
    if not size > 0:
        return _nothing("gain", "1")
    excess, error, p_value = mean_of_blocks(
        [residual * model / size for residual, model in zip(residuals.residual, residuals.model, strict=True)],
        residuals, _LONG_BLOCK_S)
    return ResidualTest("gain", 1 + excess, "1", error, p_value, _LEAST_CHANGE < abs(excess) < _ALIKE, True,
                f"Where both agree in shape, the measurement is {1 + excess:.3g} times the model "
                f"(standard error {error:.1g}).")


def _shift(alignment: Lags, drifting: ResidualTest) -> ResidualTest:
    """The same shift all the way; none where it grows on the way."""
    time, length, is_time = constant(alignment)
    ahead = "behind" if time.value > 0 else "ahead of"
    as_time = f"{abs(time.value) * 1000:.0f} ms"
    as_length = f"{abs(length.value):.2f} m"
    if is_time is None:
        words = f"about {as_time} or {as_length}; drives at other speeds would tell which"
    else:
        words = f"{as_time}, whatever the speed" if is_time else f"{as_length} of road, whatever the speed"
    trend = length if is_time is False else time
    return ResidualTest("shift", trend.value, "m" if is_time is False else "s", trend.error, trend.p_value,
                abs(time.value) > _LEAST_SHIFT_S and not drifting.found, True,
                f"The measurement comes {ahead} the model by {words}.")


def _drift(alignment: Lags) -> ResidualTest:
    trend = drift(alignment)
    in_all_m = abs(trend.value) * float(alignment.along_m.max(initial=0.0))
    words = "ahead" if trend.value > 0 else "behind"
    more = " Whatever else is found may come from that alone." if in_all_m > _MUCH_DRIFT_M else ""
    return ResidualTest("drift", trend.value, "m/m", trend.error, trend.p_value, in_all_m > _LEAST_DRIFT_M, True,
                f"The model runs {words} by {abs(trend.value) * 100:.2g} m in each 100 m of the way, {in_all_m:.2g} m "
                f"in the longest run: the recorded speed is off by a factor.{more}")


def _proportion(residuals: ModelResiduals) -> ResidualTest:
    """measured / model where a band is weak and where it is strong, with Welch's test of the difference."""
    best: tuple[float, float, float, float, str] | None = None
    bands = residuals.bands[1:]
    for band in bands:
        found = _two_gains(residuals, band.from_hz, min(band.to_hz, _HIGHEST_OF_RATE * residuals.rate_hz))
        if found is not None and (best is None or found[2] < best[2]):
            best = (*found, band.name)
    if best is None:
        return _nothing("proportion", "1")
    weak, strong, p_value, error, name = best
    return ResidualTest("proportion", strong - weak, "1", error, min(1.0, p_value * len(bands)),
                abs(strong - weak) > 2 * _LEAST_CHANGE, True,
                f"The car does not answer in proportion to the road: {_AROUND[name]} the measurement is "
                f"{weak:.2f} of the model where that moves little and {strong:.2f} where it moves much.")


def _two_gains(residuals: ModelResiduals, low_hz: float, high_hz: float) -> tuple[float, float, float, float] | None:
    """Gain on weak and on strong blocks, the p-value of their difference and its standard error."""
    from scipy.stats import t

    if high_hz <= low_hz:
        return None
    model, residual = ([band_pass(one, low_hz, high_hz, residuals.rate_hz) for one in signals]
                   for signals in (residuals.model, residuals.residual))
    own = block_means(residuals, [one**2 for one in model], _LONG_BLOCK_S)
    cross = block_means(residuals, [a * b for a, b in zip(residual, model, strict=True)], _LONG_BLOCK_S)
    third = len(own) // 3
    if third < 4 or not own.any():
        return None
    order = np.argsort(own)
    gains, errors = [], []
    for chosen in (order[:third], order[-third:]):
        total = float(own[chosen].sum())
        gain = float(cross[chosen].sum()) / total if total > 0 else 0.0
        spread = cross[chosen] - gain * own[chosen]
        gains.append(1 + gain)
        errors.append(float(np.sqrt((spread**2).sum() * third / (third - 1))) / total if total > 0 else np.inf)
    error = float(np.hypot(errors[0], errors[1]))
    if not 0 < error < np.inf:
        return None
    freedom = error**4 / sum(one**4 for one in errors) * (third - 1)
    return gains[0], gains[1], float(2 * t.sf(abs(gains[1] - gains[0]) / error, freedom)), error


# --- the residual and the suspensions ---


def _by_rate(forces: ForceMap) -> ResidualTest:
    curve = forces.by_rate
    bend = "yields at speed" if forces.progression.value < 0 else "stiffens with speed"
    return ResidualTest("force by rate", _size(curve), "N", None, curve.p_value, curve.share > _LEAST_SHARE, True,
                f"A force in the suspensions that depends on their velocity, "
                f"{_side(curve, f'like a damper that {bend}')}, would explain {_percent(curve.share)} of the "
                f"residual. In addition to linear dampers: {_ends(curve, 1, 'm/s')}.")


def _by_travel(forces: ForceMap) -> ResidualTest:
    curve = forces.by_travel
    bend = "softens" if forces.hardening.value < 0 else "hardens"
    return ResidualTest("force by travel", _size(curve), "N", None, curve.p_value, curve.share > _LEAST_SHARE, True,
                f"A force in the suspensions that depends on their travel, "
                f"{_side(curve, f'like a spring that {bend} far from its rest')}, would explain "
                f"{_percent(curve.share)} of the residual. In addition to linear springs: "
                f"{_ends(curve, 1000, 'mm')}.")


def _side(curve: Curve, both: str) -> str:
    """On which side a curve acts; ``both``: what to say where it acts on both in opposite directions."""
    low, high = abs(float(curve.force_n[0])), abs(float(curve.force_n[-1]))
    if min(low, high) < max(low, high) / 3:
        return f"mostly in {'compression' if low > high else 'extension'}"
    return both if curve.force_n[0] * curve.force_n[-1] < 0 else "in the same direction in compression and extension"


def _ends(curve: Curve, factor: float, unit: str) -> str:
    """What a curve does to body and wheel at both its ends."""
    words = []
    for index, way in ((0, "compression"), (-1, "extension")):
        force, error = float(curve.force_n[index]), float(curve.error_n[index])
        size = f"{abs(force):.0f} ± {error:.0f} N {'pulling' if force > 0 else 'pushing'} body and wheel " \
               f"{'together' if force > 0 else 'apart'}"
        words.append(f"{size if abs(force) > 2 * error else 'about zero'} at {abs(curve.at[index]) * factor:.2g} "
                     f"{unit} of {way}")
    return " and ".join(words)


def _direction(forces: ForceMap, residuals: ModelResiduals) -> ResidualTest:
    term: Term = forces.asymmetry
    mean = float(np.mean(residuals.car.structure.dampers))
    more, less = ("rebound", "bump") if term.value > 0 else ("bump", "rebound")
    ratio = f", by {_percent(2 * abs(term.value) / mean)} of the model's damping" if mean > 0 else ""
    return ResidualTest("direction", term.value, "N s/m", term.error, term.p_value, term.share > _LEAST_SHARE, True,
                f"The residual depends on the direction: the suspensions seem to resist {more} more than {less}{ratio} "
                f"(this would explain {_percent(term.share)}).")


# --- the residual and the drive ---


def _excitation(residuals: ModelResiduals, where: Breakdown) -> ResidualTest:
    rho, p_value = rank_correlation(block_means(residuals, [one**2 for one in residuals.residual]),
                          block_means(residuals, [one**2 for one in residuals.model]))
    low, high = where.amplitude[0], where.amplitude[-1]
    grown = max(high.residual_mps2, 1e-300) / max(low.residual_mps2, 1e-300)
    large = len(where.amplitude) > 1 and (grown > _GROWN if rho > 0 else grown < 1 / _GROWN)
    return ResidualTest("excitation", rho, "1", None, p_value, large, True,
                f"The residual {'grows' if rho > 0 else 'shrinks'} as the road moves the car more: "
                f"{low.residual_mps2:.2g} m/s2 where the model has up to {low.high:.2g} m/s2, "
                f"{high.residual_mps2:.2g} where it has {high.low:.2g} and more.")


def _speed(residuals: ModelResiduals) -> ResidualTest:
    """By which factor the residual changes from the slowest to the fastest driving at equal excitation: a regression of
    the logarithms of blocks on speed and excitation, the second bent as it will."""
    from scipy.stats import t

    speed = block_means(residuals, residuals.kept(lambda run: run.speed_mps))
    slow, fast = (float(np.quantile(speed, one)) for one in (0.05, 0.95))
    freedom = len(speed) - 5
    if fast < _SPEED_SPREAD * max(slow, 0.1) or freedom < 6:
        return _nothing("speed", "1")
    residual, model = (np.log(np.maximum(block_means(residuals, [one**2 for one in signals]), 1e-300))
                   for signals in (residuals.residual, residuals.model))
    level = (model - model.mean()) / (float(model.std()) or 1.0)
    columns = np.column_stack([np.ones(len(level)), (speed - slow) / (fast - slow), level, level**2, level**3])
    coefficients, *_ = np.linalg.lstsq(columns, residual, rcond=None)
    rest = residual - columns @ coefficients
    error = float(np.sqrt(rest @ rest / freedom * np.linalg.pinv(columns.T @ columns)[1, 1]))
    factor = float(np.exp(coefficients[1] / 2))
    p_value = float(2 * t.sf(abs(coefficients[1]) / error, freedom)) if error > 0 else _UNKNOWN
    return ResidualTest("speed", factor, "1", factor * error / 2, p_value,
                abs(np.log(factor)) > _LEAST_LOG_FACTOR, False,
                f"On stretches with the same motion of the car, the residual is {factor:.1f} times as large at "
                f"{fast:.0f} m/s as at {slow:.0f} m/s.")


def _place(residuals: ModelResiduals, where: Breakdown) -> ResidualTest:
    """The place with most power for its length, as so many independent samples as its autocorrelation leaves."""
    from scipy.stats import chi2

    usual = float(np.median([part.residual_mps2 for part in where.place]))
    if not usual > 0:
        return _nothing("place", "1")
    worth = 1 / (1 + 2 * float((autocorrelations(residuals.residual, _MEMORY) ** 2).sum()))
    mean = sum(part.residual_mps2**2 * part.samples for part in where.place) / sum(part.samples for part in where.place)
    chances = [float(chi2.sf(worth * part.samples * part.residual_mps2**2 / mean, worth * part.samples))
               for part in where.place]
    worst = worst_places(where, 3)
    names = short_names(residuals.runs)
    named = "; ".join(f"{names[part.name]}, {part.low:g} to {part.high:g} m ({part.residual_mps2 / usual:.1f} times)"
                      for part in worst)
    ratio = max(part.residual_mps2 for part in worst) / usual
    return ResidualTest("place", ratio, "1", None, min(1.0, min(chances) * len(chances)), ratio > 2, False,
                f"At some places the residual is much larger than usual: {named}.")


def worst_places(where: Breakdown, count: int) -> list[Part]:
    """The places that hold most of the residual power."""
    return sorted(where.place, key=lambda part: -part.share)[:count]


# --- arithmetic ---


def _power(coherence: Coherence, low_hz: float, high_hz: float) -> float:
    return float(coherence.power[(coherence.f_hz >= low_hz) & (coherence.f_hz < high_hz)].sum())


def _size(curve: Curve) -> float:
    """The largest force of a curve where it is known to a third of itself, else 0."""
    known = np.abs(curve.force_n) > 3 * curve.error_n
    return float(np.abs(curve.force_n[known]).max(initial=0.0))


def _nothing(name: str, unit: str) -> ResidualTest:
    """A test that these runs do not allow."""
    return ResidualTest(name, _UNKNOWN, unit, None, _UNKNOWN, False, False, "")


# --- words ---


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.095 else f"{100 * share:.1f}%" if share >= 0.001 else "less than 0.1%"


_AROUND = dict(zip(BAND_NAMES, (
    "below the body's bounce", "around the body's bounce", "between body bounce and wheel hop",
    "around the wheels' hop", "above the wheels' hop", "far above the wheels' hop", "beyond the recorder's filter"),
    strict=True))


def _band_words(part: Part) -> str:
    return f"{_AROUND[part.name]} ({part.low:.2g} to {part.high:.2g} Hz)"
