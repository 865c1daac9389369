"""``ridelog diagnose --same-road``: which effect is missing, from drives over one road that nobody measured.

Each RUN is a folder with drive.csv; a profile.csv in it is not read. The runs are drives over the same road at
different speeds, their distances counted from the same place (to about 3 m); drives that are plainly over two roads are
refused. An error is rms(measured - model) / rms(measured) of each drive over the road that the other drives tell.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from logger.commands.lab_model import progress
from logger.errors import EXIT_DONE, BadInput
from logger.report.text_layout import columns, paragraphs

if TYPE_CHECKING:
    from logger.lab.unknown_road.diagnosis import Found
    from logger.runs import Run
    from logger.store.formats.drive_file import Drive

_SHOWN = 8


def run_same_road(args: argparse.Namespace) -> int:
    """Carry out ``ridelog diagnose --same-road``."""
    from logger.api.bench import deviation_of, known_effects
    from logger.lab.likelihood.priors import Tolerance
    from logger.lab.unknown_road.diagnosis import diagnose_same_road
    from logger.lab.unknown_road.likelihood import NotOneRoad, SameRoad
    from logger.report.same_road_text import as_json
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    if args.out is not None:
        raise BadInput("--out: expected a diagnosis with profiles; there is no page of one without")
    tolerance = Tolerance(numbers=deviation_of(args.tolerance))
    runs, model = _drives(args.runs), read_model(vehicle_path(args.vehicle))
    for one in model.effects:
        if one.effect.obstacle(model.vehicle, two_tracks=False) is not None:
            raise BadInput(f"{args.vehicle}: its effect {one.effect.name} needs a road that is known under the right "
                           "wheels too")
    effects, _ = known_effects(model, args.effect_file)
    try:
        problem = SameRoad(runs, model.given or model.vehicle, tolerance, model.vehicle)
        with progress() as tell:
            found = diagnose_same_road(problem, effects, model.effects, tell)
    except NotOneRoad as error:
        raise BadInput(str(error)) from None
    except ValueError as error:
        raise BadInput(f"{args.vehicle}: {error}") from None
    if args.json:
        print(json.dumps(as_json(found), allow_nan=False))
    else:
        print(*_lines(found, [run.name for run in runs], None if args.all else _SHOWN), sep="\n")
    return EXIT_DONE


def _drives(folders: Sequence[Path]) -> list[Run]:
    """The drives in some folders. BadInput for fewer than two, or one that the others cannot be used with."""
    import numpy as np

    from logger.api.run_checks import check_record, thinned_runs
    from logger.profiles.track import Track
    from logger.runs import Run
    from logger.store.formats.drive_file import DRIVE, read_drive

    if len({folder.resolve() for folder in folders}) != len(folders) or len(folders) < 2:
        raise BadInput("--same-road: expected two runs or more, each once")
    drives: list[Drive] = []
    for folder in folders:
        drive = read_drive(folder / DRIVE)
        check_record(drive, drive.path, drives)
        drives.append(drive)
    return thinned_runs([
        Run(str(folder), one.rate_hz, one.accel_z_mps2, one.distance_m, one.speed_mps, Track(1.0, np.zeros(2)))
        for folder, one in zip(folders, drives, strict=True)])


def _lines(found: Found, runs: Sequence[str], most: int | None) -> list[str]:
    """What a person reads."""
    from logger.report.quantities import chance, numbers_of
    from logger.report.same_road_text import cannot_tell, summary

    rows = [("Effect", "Error", "Chance", "Numbers")]
    rows += [(one.name, f"{one.error:.3f}{'' if one.fitted else ', not fitted'}", chance(one.p_value),
              numbers_of(one.one)) for one in found.candidates[:most]]
    by_run = [("Run", "Error before", "after"),
              *((name, f"{before:.3f}", f"{after:.3f}") for name, (before, after) in
                zip(runs, found.by_run, strict=True))]
    return [paragraphs(summary(found)), "", "Each tried by itself, those that are missing first:", *columns(rows), "",
            *columns(by_run), "", "What these drives cannot tell:", paragraphs(cannot_tell(found), "- ")]
