"""``ridelog diagnose --same-road``: which effect is missing, from drives over one road that nobody measured.

Each RUN is a drive.csv, or a folder with one; a profile.csv in it is not read. The runs are drives over the same road
at different speeds, their distances counted from the same place (to about 3 m); those that were extracted without a
profile count from where each began, and are laid on one distance by their positions. Drives that are plainly over two
roads are refused. An error is rms(measured - model) / rms(measured) of each drive over the road that the other drives
tell.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from logger.commands.lab_model import progress
from logger.errors import EXIT_DONE, BadInput

if TYPE_CHECKING:
    from logger.store.formats.drive_file import Drive

_SHOWN = 8


def run_same_road(args: argparse.Namespace) -> int:
    """Carry out ``ridelog diagnose --same-road``."""
    from logger.api.same_road import diagnosed, records_of
    from logger.report.same_road_text import as_json, same_road_lines
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    if args.out is not None:
        raise BadInput("--out: expected a diagnosis with profiles; there is no page of one without")
    records, model = records_of(_drives(args.runs)), read_model(vehicle_path(args.vehicle))
    with progress() as notify:
        found = diagnosed(args.vehicle, model, records, args.effect_file, args.tolerance, notify=notify)
    if args.json:
        print(json.dumps(as_json(found), allow_nan=False))
    else:
        print(*same_road_lines(found, [record.name for record in records], None if args.all else _SHOWN), sep="\n")
    return EXIT_DONE


def _drives(runs: Sequence[Path]) -> list[tuple[Drive, str]]:
    """The drives of folders and files, and their names. BadInput for one that is named twice."""
    from logger.store.formats.drive_file import DRIVE, read_drive

    files = [run / DRIVE if run.is_dir() else run for run in runs]
    if len({file.resolve() for file in files}) != len(files) or len(files) < 2:
        raise BadInput("--same-road: expected two runs or more, each once")
    return [(read_drive(file), str(run)) for run, file in zip(runs, files, strict=True)]
