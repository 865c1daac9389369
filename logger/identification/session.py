"""A fit from records to numbers: starts that are looked for, and the right way up.

Problem: before and after a fit there are questions that no optimiser answers. Where does a bump lie of which only the
kind is known? Is the sensor upside down? Solution: each is a function of arrays here.

An obstacle is "easily located" (4.4.5 of Blum 2015). A fit goes downhill, and an obstacle that is laid a car's length
away from the real one has the real one behind a hill. Solution: it is laid at every place in turn, with the height that
fits best there, and the place that leaves the least is taken; near enough for a fit to begin.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from logger.arrays import Array
from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import WEAK, NotIdentifiable, upside_down
from logger.identification.noise_models import Autoregressive, NoiseModel, RoadNoise, White
from logger.identification.prediction_error_fit import Fit, FitOptions, fit, spread_starts
from logger.identification.unknown_inputs import EACH, RoadInput, expanded
from logger.identification.unknown_road.road_operator import RoadDrive
from logger.profiles.track import Track
from logger.runs import Run, normalised_rms
from logger.vehicle.models import structure_of
from logger.vehicle.vehicle import Vehicle

# Places are so much of a bump's width apart, and so many seconds of the way at most.
_OF_WIDTH, _OF_TIME_S = 0.15, 0.05
_MOST_PLACES = 4000
_REFINED = 9
_AFTER_S = 3.0  # a car that has passed an obstacle has come to rest


def located(vehicle: Vehicle, record: Run, road: RoadInput, part: str) -> float:
    """Where the ``part`` ("bump" or "step") of a road begins in a record, as true distance [m].

    Everything else is as ``vehicle`` and ``road`` have it; the height only has to have the right sign. ValueError for a
    record whose way is so long that there are too many places to try, or that has none.
    """
    obstacle = road.obstacles[part]
    way_m = record.distance_m[record.first:] / road.speed_scale
    pace_m = float(np.median(np.abs(np.diff(way_m)))) * record.rate_hz * _OF_TIME_S
    apart_m = min(pace_m, _OF_WIDTH * obstacle.length_m) if obstacle.length_m else pace_m
    first_m, last_m = float(way_m.min()) - obstacle.length_m, float(way_m.max())
    count = int((last_m - first_m) / max(apart_m, 1e-6)) + 1
    if not np.ptp(way_m) > 0:
        raise ValueError(f"{part}: expected a drive over it, found a car that stands")
    if count > _MOST_PLACES:
        raise ValueError(f"{part}: expected a start_m, as {last_m - first_m:g} m is too long to search for it")
    without: dict[str, Any] = {part: None}
    bare = DriveModel(vehicle, [], [record], replace(road, **without)).predict(np.empty(0))[0]
    left = np.concatenate([np.zeros(record.first), record.kept_mps2 - bare])
    flat = replace(record, track=Track(1.0, np.zeros(2)), usable=None, skip_s=0.0)
    find = partial(_best_place, vehicle, flat, left, road, part)
    return find(find(np.linspace(first_m, last_m, max(count, 2))) + apart_m * np.linspace(-1, 1, _REFINED))


def _best_place(vehicle: Vehicle, flat: Run, left: Array, road: RoadInput, part: str, places: Array) -> float:
    """The place whose response, times the best factor above 0, leaves the least of what is ``left`` (n,) of the
    measurement without the obstacle. A linear car answers an obstacle as on a ``flat`` road, from where it comes near
    until some time after it has passed."""
    way_m = flat.distance_m / road.speed_scale
    structure, obstacle = structure_of(vehicle), road.obstacles[part]
    around_m = structure.contact_patch_m + float(np.abs(np.diff(way_m)).max())
    reach_m = around_m + obstacle.length_m + float(np.max(structure.behind_m))
    gains = []
    for place in places:
        beyond_m = way_m - place
        near = np.flatnonzero((beyond_m > -around_m) & (beyond_m < reach_m))
        if not len(near):
            gains.append(0.0)
            continue
        passed = slice(max(near[0] - 1, 0), near[-1] + round(_AFTER_S * flat.rate_hz))
        there: dict[str, Any] = {part: replace(obstacle, start_m=place)}
        felt = DriveModel(vehicle, [], [flat.part(passed)], RoadInput(speed_scale=road.speed_scale, **there)).predict(
            np.empty(0))[0]
        power = float(felt @ felt)
        gains.append(max(float(felt @ left[passed]), 0.0) ** 2 / power if power > 0 else 0.0)
    return float(places[int(np.argmax(gains))])


LEAST_SAMPLES = 50
# A fit that leaves more than this share is tried with the record turned over.
_POOR = 0.3
# How much of a road that was not measured is enough, and not too much, for one fit [m].
_LEAST_WAY_M, _MOST_WAY_M = 20.0, 20_000.0


def drives_of(records: Sequence[Run]) -> list[RoadDrive]:
    """The records without their roads. ValueError for a way that is too short or too long."""
    drives = [RoadDrive(one.rate_hz, one.kept_mps2, one.distance_m[one.first:]) for one in records]
    for drive, record in zip(drives, records, strict=True):
        length_m = float(np.ptp(drive.distance_m))
        if not _LEAST_WAY_M <= length_m <= _MOST_WAY_M:
            raise ValueError(f"{record.name}: expected {_LEAST_WAY_M:g} to {_MOST_WAY_M:g} m of driving, found "
                             f"{length_m:g} m")
    return drives


def obstacle_starts(
    vehicle: Vehicle, records: Sequence[Run], road: RoadInput, unplaced: Sequence[str]
) -> dict[str, float]:
    """Where obstacles that were given no start ("bump", "step") begin in each run [m], by the names of these numbers.

    ValueError as ``located``.
    """
    return {name: located(vehicle, record, road, part) for part in unplaced
            for name, record in zip(expanded(f"{EACH}.{part}.start_m", len(records)), records, strict=True)}


def fit_options(model: DriveModel, noise: str, low_pass_hz: float | None, tries: int) -> FitOptions:
    """How to fit a model of records at one rate.

    noise          noise model: white, ar, road, or auto, the likeliest of them
    low_pass_hz    what lies above is left out [Hz]; None: nothing is
    tries          so many further starts
    """
    kinds: dict[str, NoiseModel] = {"white": White(), "ar": Autoregressive(), "road": RoadNoise(model.road_spectra)}
    if any(record.timed for record in model.records):
        del kinds["road"]
    trials = model.trials()
    return FitOptions(rate_hz=model.records[0].rate_hz, low_pass_hz=low_pass_hz,
                   noise=list(kinds.values()) if noise == "auto" else [kinds[noise]],
                   starts=[*trials, *(likely_starts(model) if trials else ()),
                           *spread_starts(model.parameters, tries)])


def likely_starts(model: DriveModel) -> list[dict[str, float]]:
    """The best two by squares of sixty cars, spread around. A car that was fitted without an effect is biased, and
    downhill from there the effect may vanish: cars in which other numbers differ as well lead to where it does not."""
    def error(start: dict[str, float]) -> float:
        with np.errstate(all="ignore"):
            found = error_before(model, start)
        return found if np.isfinite(found) else np.inf

    return sorted(spread_starts(model.parameters, 60), key=error)[:2]


def fit_down_to_0(model: DriveModel, options: FitOptions) -> Fit:
    """The fit of a model, where a damper that is hardly there is fitted once more by differences, as there may be none.
    NotIdentifiable and ValueError as ``fit``."""
    try:
        found = fit(model, model.measured, options)
        if not (near_0 := found.near_0):
            return found
        ends = [found.parameters]
    except NotIdentifiable as refusal:
        weak = {name for one in refusal.findings if one.kind == WEAK for name in one.direction}
        if not (near_0 := [one.name for one in model.parameters if one.may_be_0 and one.name in weak]):
            raise
        ends = []
    model.parameters = [one.as_strength() if one.name in near_0 else one for one in model.parameters]
    return fit(model, model.measured, replace(options, starts=ends))


def upright_fit(
    model_of: Callable[[list[Run]], DriveModel], records: list[Run], options: Callable[[DriveModel], FitOptions]
) -> Fit:
    """The fit of the model of records. NotIdentifiable for what they do not determine, or determine only when they are
    turned over; ValueError as ``fit``."""
    def fitted(of: list[Run]) -> Fit:
        model = model_of(of)
        return fit_down_to_0(model, options(model))

    try:
        found: Fit | NotIdentifiable = fitted(records)
    except NotIdentifiable as refusal:
        found = refusal
    error = 1.0 if isinstance(found, NotIdentifiable) else found.error_after
    if error > _POOR:
        turned = [replace(record, measured_mps2=-record.measured_mps2) for record in records]
        try:
            findings = upside_down(error, fitted(turned).error_after, records[0].facts.main.measures,
                                   any(one.pushed for one in records))
        except NotIdentifiable:
            findings = []
        if findings:
            raise NotIdentifiable(findings)
    if isinstance(found, NotIdentifiable):
        raise found
    return found


def error_before(model: DriveModel, start: Mapping[str, float] | None = None) -> float:
    """rms(measured - model) / rms(measured) with every free number where it starts, or at another ``start``."""
    predictions = model.predict(np.array([one.start if start is None else start[one.name] for one in model.parameters]))
    return normalised_rms([measured - one for measured, one in zip(model.measured, predictions, strict=True)],
                          model.measured)
