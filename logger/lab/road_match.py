"""A test whether a run was driven over its profile, and a search for where and in which direction it fits.

Problem: with a profile of another street, or one that is reversed or begins elsewhere, some effect always explains some
of the residuals: wrong input is no physics. Solution: around the body's bounce, where a place that is a metre off does
no harm, the measurement is correlated with a model's prediction. With the right road the correlation is high near lag
0, whatever effect is missing; with any other it is no higher there than at large lags, where it is chance and its
variance shows how large chance is (the correlogram of unrelated series: M. S. Bartlett, Journal of the Royal
Statistical Society 98, 1935).
"""

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from logger.arrays import Array, Complex
from logger.lab.likelihood.whittle import Bands
from logger.lab.selection.evidence import FALSE_ALARM
from logger.runs import Run

_MOST_LAG_S = 1.0
"""The right road correlates within this lag: a late clock, or a place that is metres off. A judgement."""


@dataclass(frozen=True)
class RoadMatch:
    """Correlation of a run with a prediction, around the body's bounce.

    correlation    the largest within the lags that a run may have
    turned         the same of the run with its sign reversed
    gain           measured / model at the larger of these, above 0
    chance         quantile of the largest correlation by chance, exceeded in one case of a thousand
    mean_chance    mean of the largest correlation by chance
    expected       the least with the right road, given the sensor's noise
    """

    correlation: float
    turned: float
    gain: float
    chance: float
    mean_chance: float
    expected: float

    @property
    def is_refuted(self) -> bool:
        """Whether the road is another one: its correlation would have been significant, and the run's is not, with
        either sign; or in a short run, whose chance is large, the run's is below what chance gives in the mean, and
        that below the right road's."""
        found = max(self.correlation, self.turned)
        return found < self.chance < self.expected or found < self.mean_chance < self.expected

    @property
    def is_clear(self) -> bool:
        """Whether the road is this one: the correlation is significant and as high as with the right road."""
        return max(self.correlation, self.turned) > max(self.chance, self.expected)

    @property
    def is_upside_down(self) -> bool:
        """Whether the run clearly correlates with reversed sign, by much more than as it is: a bounce half a period
        later correlates with reversed sign as well. On the scale on which correlations scatter alike, however large
        they are (R. A. Fisher, Metron 1, 1921)."""
        turned, correlation, chance, mean_chance = np.arctanh(np.clip(
            [self.turned, self.correlation, self.chance, self.mean_chance], -1 + 1e-9, 1 - 1e-9))
        return bool(self.is_clear and turned - correlation > chance - mean_chance)


def pool(matches: Sequence[RoadMatch]) -> RoadMatch:
    """Means over several runs, which may be significant together: the mean of maxima has a smaller variance than
    one."""
    upright, turned, gain, chance, mean_chance, expected = map(
        float, np.mean([astuple(one) for one in matches], axis=0))
    of_all = mean_chance + (chance - mean_chance) / float(np.sqrt(len(matches)))
    return RoadMatch(upright, turned, gain, of_all, mean_chance, expected)


@dataclass(frozen=True)
class Placement:
    """A better place of a run: so much farther along the profile [m], reversed or not."""

    farther_m: float
    backwards: bool
    match: RoadMatch


def bounce_band_hz(body_hz: Array) -> tuple[float, float]:
    """Frequency band around the bounce and pitch of a body, by its natural frequencies (b,) [Hz]: where it moves most,
    and waves are longest."""
    return 0.4 * float(body_hz.min()), 3.0 * float(body_hz.max())


def below_bounce_band_hz(body_hz: Array) -> tuple[float, float]:
    """Frequency band below the bounce of a body, by its natural frequencies (b,) [Hz]."""
    return bounce_band_hz(body_hz)[0], float(body_hz.min())


def match_below_bounce(run: Run, prediction: Array, body_hz: Array) -> RoadMatch:
    """Correlation of a run with a prediction (n,) below the bounce of a body, by its natural frequencies (b,) [Hz].

    The lag is at most a quarter of the bounce's period: farther off, the sign is that of another half wave.

    The body moves with the road there, even if dry friction blocks the suspension, or the sensor is far from where the
    model has it: either may reverse and multiply the motion around the bounce.
    """
    band_hz = below_bounce_band_hz(body_hz)
    return road_match(run, prediction, band_hz, most_lag_s=0.25 / band_hz[1])


def road_match(run: Run, prediction: Array, band_hz: tuple[float, float], most_lag_s: float = _MOST_LAG_S) -> RoadMatch:
    """Correlation of a run with a prediction (n,) between two frequencies [Hz]: of all of it, or where its distance
    error grows along the way, of its parts, each at a lag of its own: ten bounces of a body, 8 s, in which a speed that
    is off by 0.1 m/s moves it by no more than a tenth of the wave that bounces it at 6 m/s."""
    expected = _expected(run, band_hz)

    def of(part: slice) -> RoadMatch:
        return _match(run.measured_mps2[part], prediction[part], run.rate_hz, band_hz, expected, most_lag_s)

    whole = of(slice(run.first, None))
    size = round(8.0 * run.rate_hz)
    starts = range(run.first, run.count - size + 1, size)
    if not whole.is_refuted or len(starts) < 2:
        return whole
    parts = pool([of(slice(at, at + size)) for at in starts])
    return parts if max(parts.correlation, parts.turned) > parts.chance else whole


def _match(measured_mps2: Array, model_mps2: Array, rate_hz: float, band_hz: tuple[float, float],
           expected: float, most_lag_s: float) -> RoadMatch:
    """Correlation of samples (n,) of a measurement with a model's."""
    measured, model = (_spectrum(one, rate_hz, band_hz) for one in (measured_mps2, model_mps2))
    count = len(measured_mps2)
    power = float(np.sqrt((np.abs(measured) ** 2).sum() * (np.abs(model) ** 2).sum()))
    if not power > 0:
        return RoadMatch(0.0, 0.0, 1.0, 1.0, 1.0, 0.0)
    padded = 2 * count
    correlation = np.fft.irfft(measured * model.conj(), padded) * padded / (2 * power)
    lag = np.abs(np.fft.fftfreq(padded, 1 / padded))
    reach = most_lag_s * rate_hz
    upright, turned = (float((sign * correlation[lag <= reach]).max()) for sign in (1, -1))
    gain = max(upright, turned) * float(np.sqrt((np.abs(measured) ** 2).sum() / (np.abs(model) ** 2).sum()))
    far = (lag > reach) & (lag < 0.5 * count)
    if not far.any():
        return RoadMatch(upright, turned, gain, 1.0, 1.0, 0.0)
    deviation = float(np.sqrt(np.mean(correlation[far] ** 2 * count / (count - lag[far]))))
    # Maxima of as many independent values as a band of this width has within these lags.
    values = max(1.0, 4 * most_lag_s * (band_hz[1] - band_hz[0]))
    chance, mean_chance = (deviation * float(np.sqrt(2 * np.log(one))) for one in (values / FALSE_ALARM, values))
    return RoadMatch(upright, turned, gain, chance, mean_chance, expected)


def better_placement(run: Run, predict: Callable[[Array, bool], Array], band_hz: tuple[float, float],
                     ends_m: tuple[float, float]) -> Placement | None:
    """The place along a profile at which a run clearly fits, of the nearest 200 either way (some kilometres, in
    seconds); None: nowhere.

    predict    prediction (n,) with a distance error (n,) [m], on the profile or on the reversed one
    ends_m     beginning and end of the profile [m]
    """
    usual_mps = float(np.median(run.speed_mps[run.first:]))
    step_m = max(1.6 * _MOST_LAG_S * usual_mps, 1.0)  # lags on either side of each place overlap by a fifth
    low_m, high_m = ends_m[0] - float(run.distance_m.min()), ends_m[1] - float(run.distance_m.max())
    places_m = step_m * np.arange(np.floor(min(low_m, 0.0) / step_m), np.ceil(max(high_m, 0.0) / step_m) + 1)
    found = [Placement(float(at), backwards,
                       road_match(run, predict(np.full(run.count, at), backwards), band_hz))
             for backwards in (False, True) for at in sorted(places_m, key=abs)[:200]]
    best = max(found, key=lambda one: one.match.correlation - one.match.chance)
    return best if best.match.is_clear and not best.match.is_upside_down else None


def _spectrum(samples: Array, rate_hz: float, band_hz: tuple[float, float]) -> Complex:
    """Spectrum of samples (n,), padded to twice their number, 0 outside of a band."""
    padded = 2 * len(samples)
    spectrum = np.fft.rfft(samples - samples.mean(), padded)
    f_hz = np.fft.rfftfreq(padded, 1 / rate_hz)
    spectrum[(f_hz < band_hz[0]) | (f_hz > band_hz[1])] = 0
    return np.asarray(spectrum)


def _expected(run: Run, band_hz: tuple[float, float]) -> float:
    """The least correlation with the right road, where noise of the level at the highest frequencies is a share of what
    was measured. Without noise the right road gave 0.63 and more in 200 runs of 56 simulated cars with one, two or
    unlisted effects missing, wrong roads at most 0.36: half."""
    noise, _ = Bands(run).noise_band_power(run.measured_mps2)
    kept = run.kept_mps2 - run.kept_mps2.mean()
    power = np.abs(np.fft.rfft(kept)) ** 2 / len(kept)
    f_hz = np.fft.rfftfreq(len(kept), 1 / run.rate_hz)
    inside = (f_hz >= band_hz[0]) & (f_hz <= band_hz[1])
    road = max(0.0, 1 - noise / float(power[inside].mean()))
    return 0.5 * float(np.sqrt(road))
