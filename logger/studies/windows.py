"""A simulated drive in windows of distance, as 6.3.1 and 6.5 cut theirs: roughness in two ways, and comfort.

Their way is the r.m.s. acceleration of a window times the factor of its speed (Fig 6.6). Ours is what ``ridelog
estimate`` gives. The exact IRI is that of the road itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.dsp.pass_band import in_band
from logger.dsp.weightings.wk import WEIGHTING
from logger.estimation.batch import estimated, exact_iri
from logger.estimation.rms_relation import rms_relation
from logger.estimation.sensor_noise import Sensor
from logger.profiles.track import Track
from logger.runs import Run
from logger.studies.drives import RATE_HZ, Array, Conditions, rav4
from logger.units import WINDOW_M
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class Figures:
    """Windows one after the other, w of them.

    edges_m           (w + 1,) [m]
    exact_m_per_km    (w,) IRI of the road
    by_rms_m_per_km   (w,) IRI by the dissertation's relation
    iri_m_per_km      (w,) IRI as ridelog estimates it, and ``iri_std_m_per_km`` its standard error
    a_w_mps2          (w,) acceleration weighted with Wk, r.m.s.
    """

    edges_m: Array
    exact_m_per_km: Array
    by_rms_m_per_km: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    a_w_mps2: Array

    @property
    def middle_m(self) -> Array:
        """(w,) [m]"""
        return (self.edges_m[1:] + self.edges_m[:-1]) / 2


def per_window(record: Run, conditions: Conditions, window_m: float = WINDOW_M, low_pass_hz: float | None = None,
               vehicle: Vehicle | None = None) -> Figures:
    """Of a drive at one speed over a road that the run has as its track; whole windows only.

    low_pass_hz    of the record, for all but our estimate (6.5) [Hz]; None: none
    vehicle        that the estimates take it for; None: that of Table 4.2
    """
    speed_mps, vehicle = float(record.speed_mps[0]), vehicle or rav4()
    sensor = Sensor(conditions.noise_mps2, conditions.step_mps2)
    found, _ = estimated(known_vehicle(vehicle), sensor, window_m, record.measured_mps2, record.distance_m)
    track = record.track
    assert isinstance(track, Track)
    count = int((record.distance_m[-1] - record.distance_m[0]) / window_m)
    edges_m = found.edges_m[: count + 1]
    sensed = record.measured_mps2
    if low_pass_hz is not None:
        sensed = in_band(sensed, RATE_HZ, 0.0, low_pass_hz)
    rms, a_w = (_rms(one, record.distance_m, edges_m) for one in (sensed, WEIGHTING.weigh(sensed, RATE_HZ)))
    return Figures(edges_m, exact_iri(edges_m, track.elevation_m, track.spacing_m, track.start_m),
                   _factor(vehicle, speed_mps) * rms, found.iri_m_per_km[:count], found.iri_std_m_per_km[:count], a_w)


def comfort_shares(a_w_mps2: Array) -> dict[str, float]:
    """By the word of Table 2.5, from the least severe on: the share of windows (w,) [%]."""
    words = [comfort_word(float(one)) for one in a_w_mps2.ravel()]
    return {word: 100 * words.count(word) / len(words) for _, word in reversed(COMFORT_WORDS)}


@cache
def _factor(vehicle: Vehicle, speed_mps: float) -> float:
    return float(rms_relation(known_vehicle(vehicle), None, [speed_mps]).iri_per_accel_rms[0])


def _rms(values: Array, distance_m: Array, edges_m: Array) -> Array:
    sums = np.concatenate([[0.0], np.cumsum(values**2)])
    at = np.searchsorted(distance_m, edges_m - 1e-9)
    return np.sqrt(np.diff(sums[at]) / np.diff(at))


def whole_road_by_rms(record: Run, vehicle: Vehicle | None = None) -> float:
    """IRI of a whole drive at one speed by the dissertation's relation [m/km]."""
    return _factor(vehicle or rav4(), float(record.speed_mps[0])) * float(np.sqrt(np.mean(record.measured_mps2**2)))


def mean_window_by_rms(record: Run, edges_m: Array, low_pass_hz: float) -> float:
    """IRI of windows between edges (w + 1,) by the dissertation's relation, the record low-passed: their mean [m/km].

    Windows of one road differ, and the mean of roots is below the root of the mean: less than ``whole_road_by_rms``.
    """
    sensed = in_band(record.measured_mps2, RATE_HZ, 0.0, low_pass_hz)
    return _factor(rav4(), float(record.speed_mps[0])) * float(_rms(sensed, record.distance_m, edges_m).mean())


def rms_error(estimate: Array, exact: Array) -> float:
    """R.m.s. difference of two rows of windows."""
    return float(np.sqrt(np.mean((estimate - exact) ** 2)))
