"""The lab without a profile: which physical effect a model lacks, from drives over one road that nobody measured."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from logger.api.bench import Notify, among, known_effects, silent, tolerance_of
from logger.api.lab import Diagnosis, Runs, diagnosis_fields, given_runs, word_of
from logger.api.run_checks import check_distances, check_record, driven_parts, thinned_runs
from logger.api.vehicles import Model, model_of
from logger.errors import BadInput
from logger.runs import BY_RECEIVER, UNKNOWN
from logger.runs import Run as Record
from logger.store.formats import drive_file, vehicle_file

if TYPE_CHECKING:
    from logger.lab.unknown_road.diagnosis import UnknownRoadDiagnosis

Array = npt.NDArray[np.float64]

_PLACES_EVERY_M = 10.0
_LEAST_SHARED_M = 50.0
"""Some seconds of a drive: less road says nothing (``lab.unknown_road.likelihood``)."""


@dataclass(frozen=True, eq=False, repr=False)
class SameRoadDiagnosis(Diagnosis):
    """Which physical effects a model lacks, as far as drives over an unmeasured road show it.

    An error is rms(measured - model) / rms(measured) of each drive over the road estimated from the other drives.

    run_errors       by name of the run: error before, and with the effects that were found
    taken_by_road    effects that another road would imitate, and the share of their information that remains with it
    not_tried        effects that could not be tried, and why
    undecided        effects that explain a little, but may only imitate something else that is missing
    cannot_tell      sentences: what these drives do not show
    """

    run_errors: Mapping[str, tuple[float, float]]
    taken_by_road: Mapping[str, float]
    not_tried: Mapping[str, str]
    undecided: tuple[str, ...]
    cannot_tell: tuple[str, ...]


def diagnose_same_road(
    vehicle: Model | Path | str, runs: Runs, *, candidates: Collection[str] | None = None,
    effect_files: Sequence[Path | str] = (), tolerance: float | None = None, progress: Notify = silent,
) -> SameRoadDiagnosis:
    """Which physical effect a model lacks, where no profile is known: from two drives or more over one road, at
    different speeds. Effects that bend the car's laws are tried by linear ones that stand in for them; profiles are
    not read. It takes from seconds to minutes.

    vehicle, tolerance    as in ``compare``
    runs                  as in ``compare``, without profiles; their distances count from the same place, to about 3 m,
                          or they were extracted without a profile and have positions
    candidates, effect_files, progress    as in ``diagnose``

    Raises BadInput for fewer than two runs, drives that are plainly over two roads, and as ``diagnose``. Source: the
    road is random as ISO 8608 lets expect it, and its waves are found with the car (``logger.lab.unknown_road``).

    >>> found = diagnose_same_road(car, runs, candidates=["sensor_offset", "sensor_gain"])
    >>> found.verdict, list(found.taken_by_road)
    ((), ['sensor_gain'])
    """
    from logger.report.same_road_text import as_json, cannot_tell, same_road_lines

    model, drives = model_of(vehicle), given_runs(runs)
    names = [str(one.path) for one in drives]
    records = records_of(list(zip(drives, names, strict=True)))
    found = diagnosed(word_of(vehicle, model), model, records, list(map(str, effect_files)), tolerance, candidates,
                      progress)
    summary = as_json(found)
    return SameRoadDiagnosis(
        "\n".join(same_road_lines(found, names, None)), summary, **diagnosis_fields(summary),
        run_errors=dict(zip(names, found.by_run, strict=True)), taken_by_road=summary["taken_by_road"],
        not_tried=summary["not_tried"], undecided=tuple(summary["undecided"]), cannot_tell=tuple(cannot_tell(found)))


def records_of(drives: Sequence[tuple[drive_file.Drive, str]]) -> list[Record]:
    """Drives and their names, checked together; on a flat road, for none is known. BadInput for fewer than two, or one
    that the others cannot be used with."""
    from logger.profiles.track import Track

    if len(drives) < 2:
        raise BadInput("expected two runs or more over one road, found one")
    flat = Track(1.0, np.zeros(2))
    for number, (drive, _) in enumerate(drives):
        file = drive.path / drive_file.DRIVE if drive.path.is_dir() else drive.path
        check_record(drive, file, [one for one, _ in drives[:number]])
        check_distances(drive, file)
    by_receiver = any(one.facts.places_by == BY_RECEIVER for one, _ in drives)
    if any(_counts_for_itself(one) for one, _ in drives) and all(_was_extracted(one) for one, _ in drives):
        drives, by_receiver = _on_one_distance(drives), True
    facts = replace(UNKNOWN, places_by=BY_RECEIVER) if by_receiver else UNKNOWN
    return thinned_runs([Record(name, one.rate_hz, one.accel_z_mps2, one.distance_m, one.speed_mps, flat, facts=facts)
                         for one, name in drives])


def _was_extracted(drive: drive_file.Drive) -> bool:
    """Whether a drive was extracted, and has positions."""
    return drive.facts.source is not None and drive.lat_deg is not None and bool(np.isfinite(drive.lat_deg).all())


def _counts_for_itself(drive: drive_file.Drive) -> bool:
    """Whether that was without a profile, so that its distance begins where it did."""
    return _was_extracted(drive) and drive.facts.places_by is None


def _on_one_distance(drives: Sequence[tuple[drive_file.Drive, str]]) -> list[tuple[drive_file.Drive, str]]:
    """The longest part of each drive in which the car moved, on the distance of the one that goes farthest, by the
    start that comes nearest to their positions: what these wander by, over a minute or so, is no motion, and ways by a
    receiver's speeds have no factor.

    BadInput for a drive that goes elsewhere.
    """
    from logger.extraction.measured_line import ASIDE_M, MeasuredLine

    driven = [(_longest_part(one), name) for one, name in drives]
    along, _ = max(driven, key=lambda pair: float(np.ptp(pair[0].distance_m)))
    metres = np.arange(along.distance_m[0], along.distance_m[-1], _PLACES_EVERY_M)
    line = MeasuredLine.of(metres, *(np.interp(metres, along.distance_m, one) for one in _places(along)))
    found = []
    for drive, name in driven:
        along_m, aside_m = line.passed(*_places(drive))
        near = (aside_m < ASIDE_M) & (along_m > metres[0]) & (along_m < metres[-1])
        if np.ptp(drive.distance_m[near]) < _LEAST_SHARED_M if near.any() else True:
            raise BadInput(f"{name}: expected a drive over the road of {along.path}, found none of its positions there "
                           f"for {_LEAST_SHARED_M:g} m")
        farther_m = float(np.median((along_m - drive.distance_m)[near]))
        found.append((replace(drive, distance_m=drive.distance_m + farther_m), name))
    return found


def _places(drive: drive_file.Drive) -> tuple[Array, Array]:
    assert drive.lat_deg is not None and drive.lon_deg is not None
    return drive.lat_deg, drive.lon_deg


def _longest_part(drive: drive_file.Drive) -> drive_file.Drive:
    """BadInput where the car hardly moved."""
    part = max(driven_parts(drive), key=lambda one: one.stop - one.start)
    rows = ("time_s", "accel_z_mps2", "speed_mps", "distance_m", "lat_deg", "lon_deg")
    return replace(drive, usable=None if drive.usable is None else drive.usable[part],
                   **{name: getattr(drive, name)[part] for name in rows})


def diagnosed(
    word: str, model: vehicle_file.Model, records: Sequence[Record], effect_files: Sequence[str],
    tolerance: float | None, candidates: Collection[str] | None = None, notify: Notify = silent,
) -> UnknownRoadDiagnosis:
    """Which effects the model lacks. BadInput as ``diagnose_same_road``.

    word    by which the user knows the vehicle
    """
    from logger.lab.unknown_road import diagnosis
    from logger.lab.unknown_road.likelihood import NotOneRoad, SameRoad
    from logger.lab.unknown_road.placement import placed_by_road

    off, given = tolerance_of(tolerance), model.given or model.vehicle
    for one in model.effects:
        if one.effect.obstacle(model.vehicle, two_tracks=False) is not None:
            raise BadInput(f"{word}: its effect {one.effect.name} needs a road that is known under the right wheels "
                           "too")
    effects, _ = known_effects(model, effect_files)
    try:
        if by_receiver := any(one.facts.places_by == BY_RECEIVER for one in records):
            notify("laying the drives on one distance by the road that they felt")
            records = placed_by_road(records, given, off, model.effects, model.vehicle)
        problem = SameRoad(records, given, off, model.vehicle, exact_places=not by_receiver)
        return diagnosis.diagnose_same_road(problem, among(effects, candidates), model.effects, notify)
    except NotOneRoad as error:
        raise BadInput(str(error)) from None
    except ValueError as error:
        raise BadInput(f"{word}: {error}") from None
