"""The dissertation's way of fitting, and ours, so that a study can set one beside the other.

Theirs is output error: what the model leaves is taken for white noise. Ours is the innovations form: of white noise,
autoregressive noise and a road that the profile does not contain, the likeliest.
"""

from __future__ import annotations

from collections.abc import Mapping

from logger.identification.fit import Fit, Options, fit
from logger.identification.noise import Autoregressive, Noise, RoadNoise, White
from logger.identification.parameters import free
from logger.identification.prediction import VehicleModel
from logger.identification.record import Record
from logger.studies.drives import RATE_HZ, rav4

MASS = "sprung_mass_kg"
FRONT, REAR = "front.suspension_stiffness_n_per_m", "rear.suspension_stiffness_n_per_m"
TRUTH = {MASS: 875.0, FRONT: 23_088.0, REAR: 23_088.0}
"""Table 4.2."""


def fitted(record: Record, start: Mapping[str, float], ours: bool, low_pass_hz: float | None = None) -> Fit:
    """The numbers in ``start`` from one record, starting there; NotIdentifiable where the record cannot tell them."""
    model = VehicleModel(rav4(), [free(rav4(), name, value) for name, value in start.items()], [record])
    noise: list[Noise] = [White()]
    if ours:
        noise += [Autoregressive(), RoadNoise(model.road_spectra)]
    return fit(model, model.measured, Options(rate_hz=RATE_HZ, noise=noise, low_pass_hz=low_pass_hz))


def error_percent(found: Fit, name: str) -> float:
    """Of an estimate, against Table 4.2, with its sign [%]."""
    return 100 * (found.parameters[name] / TRUTH[name] - 1)


def standard_error_percent(found: Fit, name: str) -> float:
    """Of an estimate, as the fit itself gives it [% of Table 4.2]."""
    return 100 * found.standard_errors[name] / TRUTH[name]
