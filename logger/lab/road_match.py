"""Whether a run was driven over the road that it comes with, and if not, where and which way it fits.

Problem: a profile of another street, one that was read backwards or that begins elsewhere, leaves residuals that some
effect explains better than none: wrong input is no physics. Solution: around the body's bounce, where a place that is
a metre off does no harm, what was measured is correlated with what a model of the car predicts. Of the right road the
correlation is high at about no lag, whatever effect is missing; of any other one it is no higher there than at all the
lags at which it can only be chance, whose spread says how far chance goes (the correlogram of unrelated series:
M. S. Bartlett, Journal of the Royal Statistical Society 98, 1935).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.whittle import Bands
from logger.lab.selection.evidence import FALSE_ALARM
from logger.runs import Run

Array = npt.NDArray[np.float64]

_REACH_S = 1.0
"""The right road is found within this lag: a late clock, or a place that is metres off."""


@dataclass(frozen=True)
class RoadMatch:
    """How well a run goes with a prediction, around the body's bounce.

    correlation    the highest one within a second of lag
    turned         the same of the run turned over
    gain           measured / model where the higher one of these is, above 0
    chance         how high one by chance may be there: one in a thousand is higher
    mean_chance    how high one by chance is on average
    expected       the least that the right road would give, given the sensor's noise
    """

    correlation: float
    turned: float
    gain: float
    chance: float
    mean_chance: float
    expected: float

    @property
    def is_refuted(self) -> bool:
        """Whether the road is another one: the run could have shown it, and correlates with it no better than by
        chance, either way up."""
        return max(self.correlation, self.turned) < self.chance < self.expected

    @property
    def is_clear(self) -> bool:
        """Whether it is this road: no chance, and as high as the right one gives."""
        return max(self.correlation, self.turned) > max(self.chance, self.expected)

    @property
    def is_upside_down(self) -> bool:
        """Whether the run clearly follows this road when it is turned over, and not much less as it is: a bounce half a
        swing later looks turned over as well."""
        return self.is_clear and self.turned - self.correlation > self.chance - self.mean_chance


def pool(matches: Sequence[RoadMatch]) -> RoadMatch:
    """Several runs together, their means: what none of them could show by itself, all may, as the mean of maxima
    scatters less around its own mean than one of them."""
    upright, turned, gain, chance, mean_chance, expected = map(
        float, np.mean([astuple(one) for one in matches], axis=0))
    of_all = mean_chance + (chance - mean_chance) / float(np.sqrt(len(matches)))
    return RoadMatch(upright, turned, gain, of_all, mean_chance, expected)


@dataclass(frozen=True)
class Placement:
    """Where a run fits better: so much farther along the profile [m], read backwards or not."""

    farther_m: float
    backwards: bool
    match: RoadMatch


def bounce_band_hz(body_hz: Array) -> tuple[float, float]:
    """The frequencies around the bounce and pitch of a body, by those of its vibrations (b,) [Hz]: where it moves most,
    and a wave is longest."""
    return 0.4 * float(body_hz.min()), 3.0 * float(body_hz.max())


def below_bounce_band_hz(body_hz: Array) -> tuple[float, float]:
    """The frequencies below the bounce of a body, by its vibrations (b,) [Hz]: it moves with the road there, whether
    its suspension is free or sticks; around the bounce one that sticks may move it the other way, and far more."""
    return bounce_band_hz(body_hz)[0], float(body_hz.min())


def road_match(run: Run, prediction: Array, band_hz: tuple[float, float], part_s: float = 8.0) -> RoadMatch:
    """How well a run goes with a prediction (n,) between two frequencies [Hz]: all of it, or where its distances are
    off by more and more along the way, its parts, each at a lag of its own.

    part_s    ten bounces of a body, in which a speed that is off by 0.1 m/s moves it by no more than a tenth of the
              wave that bounces it at 6 m/s
    """
    expected = _expected(run, band_hz)

    def of(part: slice) -> RoadMatch:
        return _match(run.measured_mps2[part], prediction[part], run.rate_hz, band_hz, expected)

    whole = of(slice(run.first, None))
    size = round(part_s * run.rate_hz)
    starts = range(run.first, run.count - size + 1, size)
    if not whole.is_refuted or len(starts) < 2:
        return whole
    parts = pool([of(slice(at, at + size)) for at in starts])
    return parts if max(parts.correlation, parts.turned) > parts.chance else whole


def _match(measured_mps2: Array, model_mps2: Array, rate_hz: float, band_hz: tuple[float, float],
           expected: float, false_alarm: float = FALSE_ALARM) -> RoadMatch:
    measured, model = (_spectrum(one, rate_hz, band_hz) for one in (measured_mps2, model_mps2))
    count = len(measured_mps2)
    power = float(np.sqrt((np.abs(measured) ** 2).sum() * (np.abs(model) ** 2).sum()))
    if not power > 0:
        return RoadMatch(0.0, 0.0, 1.0, 1.0, 1.0, 0.0)
    padded = 2 * count
    correlation = np.fft.irfft(measured * model.conj(), padded) * padded / (2 * power)
    lag = np.abs(np.fft.fftfreq(padded, 1 / padded))
    reach = _REACH_S * rate_hz
    upright, turned = (float((sign * correlation[lag <= reach]).max()) for sign in (1, -1))
    gain = max(upright, turned) * float(np.sqrt((np.abs(measured) ** 2).sum() / (np.abs(model) ** 2).sum()))
    far = (lag > reach) & (lag < 0.5 * count)
    if not far.any():
        return RoadMatch(upright, turned, gain, 1.0, 1.0, 0.0)
    spread = float(np.sqrt(np.mean(correlation[far] ** 2 * count / (count - lag[far]))))
    # Maxima of so many independent values on either side of no lag, as a band so wide has them.
    values = max(1.0, 4 * _REACH_S * (band_hz[1] - band_hz[0]))
    chance, mean_chance = (spread * float(np.sqrt(2 * np.log(one))) for one in (values / false_alarm, values))
    return RoadMatch(upright, turned, gain, chance, mean_chance, expected)


def better_placement(run: Run, predict: Callable[[Array, bool], Array], band_hz: tuple[float, float],
                     ends_m: tuple[float, float], most_places: int = 200) -> Placement | None:
    """Where along a profile a run fits clearly; None: nowhere.

    predict    the prediction (n,) for a run that was farther by this (n,) [m], on the profile or on it read backwards
    ends_m     where the profile begins and ends [m]
    most_places    that are tried, the nearest first: some kilometres, in seconds
    """
    usual_mps = float(np.median(run.speed_mps[run.first:]))
    step_m = max(1.6 * _REACH_S * usual_mps, 1.0)  # lags on either side of each place overlap by a fifth
    low_m, high_m = ends_m[0] - float(run.distance_m.min()), ends_m[1] - float(run.distance_m.max())
    places_m = step_m * np.arange(np.floor(min(low_m, 0.0) / step_m), np.ceil(max(high_m, 0.0) / step_m) + 1)
    found = [Placement(float(at), backwards,
                       road_match(run, predict(np.full(run.count, at), backwards), band_hz))
             for backwards in (False, True) for at in sorted(places_m, key=abs)[:most_places]]
    best = max(found, key=lambda one: one.match.correlation - one.match.chance)
    return best if best.match.is_clear and not best.match.is_upside_down else None


def _spectrum(samples: Array, rate_hz: float, band_hz: tuple[float, float]) -> npt.NDArray[np.complex128]:
    """Of samples (n,), padded to twice their number, without what lies outside of a band."""
    padded = 2 * len(samples)
    spectrum = np.fft.rfft(samples - samples.mean(), padded)
    f_hz = np.fft.rfftfreq(padded, 1 / rate_hz)
    spectrum[(f_hz < band_hz[0]) | (f_hz > band_hz[1])] = 0
    return np.asarray(spectrum)


def _expected(run: Run, band_hz: tuple[float, float], without_noise: float = 0.5) -> float:
    """The least correlation of the right road, where the sensor's own noise, as loud as at the highest frequencies, is
    a share of what was measured.

    without_noise    measured: the right road gave 0.63 and more in 200 runs of 56 simulated cars with one, two or
                     unlisted effects missing, each far stronger than the noise; wrong roads at most 0.36
    """
    noise, _ = Bands(run).noise_band_power(run.measured_mps2)
    kept = run.kept_mps2 - run.kept_mps2.mean()
    power = np.abs(np.fft.rfft(kept)) ** 2 / len(kept)
    f_hz = np.fft.rfftfreq(len(kept), 1 / run.rate_hz)
    inside = (f_hz >= band_hz[0]) & (f_hz <= band_hz[1])
    road = max(0.0, 1 - noise / float(power[inside].mean()))
    return without_noise * float(np.sqrt(road))
