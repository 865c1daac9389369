"""Drives that the studies stand on, their windows, and the dissertation's way of fitting beside ours.

The car of Table 4.2 goes over one obstacle. It is stepped through time by ``logger.vehicle.simulate``, which the fits
know nothing of. The profile that goes with a record is what the driver believes the road to be: the obstacle alone, of
the size that was taken for its own, while the road that was driven may be rough and its obstacle of another size
(4.4.1: the roughness is left out of the input, as it would not be known).

In windows of distance, as 6.3.1 and 6.5 cut theirs, there is roughness in two ways, and comfort. Their way is the
r.m.s. acceleration of a window times the factor of its speed (Fig 6.6). Ours is what ``ridelog estimate`` gives. The
exact IRI is that of the road itself.

The dissertation's way of fitting is output error: what the model leaves is taken for white noise. Ours is the
innovations form: of white noise, autoregressive noise and a road that the profile does not contain, the likeliest.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from logger.arrays import Array
from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.dsp.resample import GRID_RATE_HZ
from logger.dsp.weightings.wk import WEIGHTING
from logger.dsp.whole_record import in_band
from logger.estimation.batch import estimated, exact_iri
from logger.estimation.rms_calibration import rms_relation
from logger.estimation.sensor_noise import Sensor
from logger.identification.drive_model import DriveModel
from logger.identification.prediction_error_fit import Fit, fit
from logger.identification.session import fit_options
from logger.identification.unknown_inputs import SPEED_SCALE, Bump, RoadInput, free_input, is_input
from logger.profiles.track import Track
from logger.roads.elevation_spectrum import iri_per_root_gd
from logger.roads.iso8608 import STANDARD_WAVINESS, gd_n0_from_iri, generate
from logger.roads.obstacles import speed_bump, step
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import SensorErrors, as_sensed
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import STANDARD_GRAVITY_MPS2, WINDOW_M
from logger.vehicle.compose import compose
from logger.vehicle.compose import recorded as simulated
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.named_parameters import free
from logger.vehicle.simulate import Passage
from logger.vehicle.vehicle import Vehicle

Shape = Callable[[Array], Array]

RATE_HZ = GRID_RATE_HZ
BUMP_MPS, BRIDGE_MPS = 16.1 / 3.6, 48.3 / 3.6
BUMP_HEIGHT_M, BUMP_WIDTH_M, STEP_M = 0.150, 2.60, 0.0381
SPACING_M = 0.02
_BEFORE_M, _BEHIND_M = 80.0, 80.0


@dataclass(frozen=True)
class Conditions:
    """Of a drive: the sensor's noise and its step [m/s2], and the IRI of the road around the obstacle [m/km]."""

    noise_mps2: float = 0.05
    step_mps2: float = 0.0
    iri_m_per_km: float = 0.0
    seed: int = 0

    def on(self, iri_m_per_km: float, seed: int) -> "Conditions":
        """The same sensor on another road; another seed, another noise and road."""
        return replace(self, iri_m_per_km=iri_m_per_km, seed=seed)


PS_2119 = Conditions(noise_mps2=0.03, step_mps2=0.01 * STANDARD_GRAVITY_MPS2)
"""The sensor of 5.2: steps of 0.01 g; its noise is taken for a third of a step."""


@cache
def rav4() -> Vehicle:
    """The half car of Table 4.2."""
    return read_vehicle(vehicle_file("rav4-2009"))


def bump(start_m: float, height_m: float = BUMP_HEIGHT_M, width_m: float = BUMP_WIDTH_M) -> Shape:
    """Eq 4.41, of the size that 5.5.2 measured unless another is given."""
    return lambda place_m: speed_bump(place_m, start_m, height_m, width_m)


def bridge(start_m: float, height_m: float = STEP_M) -> Shape:
    """The step of 4.4.5."""
    return lambda place_m: step(place_m, start_m, height_m)


def record_of(obstacle: Shape, speed_mps: float, seconds: float, conditions: Conditions, vehicle: Vehicle | None = None,
              spacing_m: float = SPACING_M) -> Run:
    """A drive over an obstacle at a steady speed, with the obstacle as its known profile. None: that of Table 4.2."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    distance_m = speed_mps * time_s
    place_m = np.arange(-_BEFORE_M, distance_m[-1] + _BEHIND_M, spacing_m)
    known = obstacle(place_m)
    road = known
    if conditions.iri_m_per_km:
        length_m = spacing_m * (len(place_m) + 1)
        road = known + generate(gd_n0_from_iri(conditions.iri_m_per_km), length_m, spacing_m,
                                conditions.seed)[: len(place_m)]
    sensed = _recorded(vehicle, Track(spacing_m, road, float(place_m[0])), distance_m, conditions)
    track = Track(spacing_m, known, float(place_m[0]))
    return Run("simulated", RATE_HZ, sensed, distance_m, np.full(len(time_s), speed_mps), track, skip_s=0.0)


def drive_over(road: Track, speed_mps: float, conditions: Conditions, vehicle: Vehicle | None = None) -> Run:
    """A drive at a steady speed from 0 m to the end of a road that is known. None: the vehicle of Table 4.2."""
    distance_m = np.arange(0.0, road.end_m - _BEHIND_M, speed_mps / RATE_HZ)
    sensed = _recorded(vehicle, road, distance_m, conditions)
    return Run("simulated", RATE_HZ, sensed, distance_m, np.full(len(distance_m), speed_mps), road, skip_s=0.0)


def random_road(iri_m_per_km: float, length_m: float, seed: int, waviness: float = STANDARD_WAVINESS) -> Track:
    """A random road from 0 m to its length, with some more on either side, of this IRI on average."""
    road_spacing_m = 0.05
    whole_m = _BEFORE_M + length_m + _BEHIND_M
    gd_n0_cm3 = (iri_m_per_km / iri_per_root_gd(waviness)) ** 2
    return Track(road_spacing_m, generate(gd_n0_cm3, whole_m, road_spacing_m, seed, waviness), -_BEFORE_M)


def places_m(road: Track) -> Array:
    """Where the samples of a road lie (n,) [m]."""
    return np.asarray(road.start_m + road.spacing_m * np.arange(len(road.elevation_m)), float)


def without_profile(record: Run, speed_scale: float = 1.0) -> Run:
    """The same readings, nothing known of the road; recorded speed and distance are so many times the true ones."""
    return replace(record, track=Track(1.0, np.zeros(2)), distance_m=speed_scale * record.distance_m,
                   speed_mps=speed_scale * record.speed_mps)


def until(record: Run, distance_m: float) -> Run:
    """The part of a record up to where the front tires are at a place."""
    return record.part(slice(int(np.searchsorted(record.distance_m, distance_m))))


def _recorded(vehicle: Vehicle | None, track: Track, distance_m: Array, conditions: Conditions) -> Array:
    return recorded(vehicle or rav4(), track, distance_m, conditions.noise_mps2, conditions.seed, conditions.step_mps2)


def recorded(vehicle: Vehicle, track: Track, distance_m: Array, noise_mps2: float, seed: int,
             step_mps2: float = 0.0) -> Array:
    """What the sensor records; the car has come to the start as fast as it goes there."""
    clean = simulated(compose(vehicle), Passage(track, RATE_HZ, distance_m))
    return as_sensed(clean, SensorErrors(noise_mps2, step_mps2, seed))


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


MASS = "sprung_mass_kg"
FRONT, REAR = "front.suspension_stiffness_n_per_m", "rear.suspension_stiffness_n_per_m"
TRUTH = {MASS: 875.0, FRONT: 23_088.0, REAR: 23_088.0}  # Table 4.2


def fitted(record: Run, start: Mapping[str, float], ours: bool, road: RoadInput | None = None,
           low_pass_hz: float | None = None, vehicle: Vehicle | None = None) -> Fit:
    """The numbers in ``start``, of the car (None: that of Table 4.2) or of ``road``, from one record, starting there.

    NotIdentifiable where the record cannot identify them.
    """
    road = road or RoadInput()
    car = vehicle or rav4()
    numbers = [free_input(road, name, value) if is_input(name) else free(car, name, value)
               for name, value in start.items()]
    model = DriveModel(car, numbers, [record], road)
    return fit(model, model.measured, fit_options(model, "auto" if ours else "white", low_pass_hz, 0))


def mass_and_bump(record: Run, taken: Bump, low_pass_hz: float | None = None) -> Fit:
    """Our way where the bump is not known for certain: mass, bump and speed together, beginning with what is taken."""
    start = {MASS: TRUTH[MASS], "bump.start_m": taken.start_m, "bump.height_m": taken.height_m,
             "bump.width_m": taken.width_m, SPEED_SCALE: 1.0}
    return fitted(record, start, True, RoadInput(bump=taken), low_pass_hz)


def error_percent(found: Fit, name: str) -> float:
    """Of an estimate, against Table 4.2, with its sign [%]."""
    return 100 * (found.parameters[name] / TRUTH[name] - 1)


def standard_error_percent(found: Fit, name: str) -> float:
    """Of an estimate, as the fit itself gives it [% of Table 4.2]."""
    return 100 * found.standard_errors[name] / TRUTH[name]
