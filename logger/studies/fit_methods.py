"""The dissertation's way of fitting, and ours, so that a study can compare them.

Theirs is output error: what the model leaves is taken for white noise. Ours is the innovations form: of white noise,
autoregressive noise and a road that the profile does not contain, the likeliest.
"""

from __future__ import annotations

from collections.abc import Mapping

from logger.identification.frequency_domain_model import VehicleModel
from logger.identification.noise_models import Autoregressive, Noise, RoadNoise, White
from logger.identification.obstacle_paths import Bump
from logger.identification.prediction_error_fit import Fit, FitOptions, fit
from logger.identification.unknown_inputs import SPEED_SCALE, RoadInput, free_input, is_input
from logger.runs import Run
from logger.studies.drives import RATE_HZ, rav4
from logger.vehicle.named_parameters import free
from logger.vehicle.vehicle import Vehicle

MASS = "sprung_mass_kg"
FRONT, REAR = "front.suspension_stiffness_n_per_m", "rear.suspension_stiffness_n_per_m"
TRUTH = {MASS: 875.0, FRONT: 23_088.0, REAR: 23_088.0}
"""Table 4.2."""


def fitted(record: Run, start: Mapping[str, float], ours: bool, road: RoadInput | None = None,
           low_pass_hz: float | None = None, vehicle: Vehicle | None = None) -> Fit:
    """The numbers in ``start``, of the car (None: that of Table 4.2) or of ``road``, from one record, starting there.

    NotIdentifiable where the record cannot identify them.
    """
    road = road or RoadInput()
    car = vehicle or rav4()
    numbers = [free_input(road, name, value) if is_input(name) else free(car, name, value)
               for name, value in start.items()]
    model = VehicleModel(car, numbers, [record], road)
    noise: list[Noise] = [White()]
    if ours:
        noise += [Autoregressive(), RoadNoise(model.road_spectra)]
    return fit(model, model.measured, FitOptions(rate_hz=RATE_HZ, noise=noise, low_pass_hz=low_pass_hz))


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
