"""Whole commands on valid files in which fields were changed: an answer without a number that is none, or one line.

The command runs in the process, as a person calls it, and NumPy's warnings are faults: none may reach a person. What is
tried here is what the readers of ``field_targets`` let through.
"""

from __future__ import annotations

import gzip
import json
import random
from collections.abc import Callable, Hashable
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivers.dump import open_dump
from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.store.log.row_format import HEADER, format_row

from ..command import called
from ..drives.logged_rows import repeated_drives
from ..drives.short_drive import SHORT_PLAN
from ..drives.simulated_drive import record, simulate_drive
from . import fields
from .field_targets import dump_lines, table
from .mutation import Target
from .targets import mend_rows, promise

LIMIT_S = 60.0


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _answer(command: str, done: object) -> Hashable:
    """The shape of an answer; BadInput for a refusal, ViolationError for anything else."""
    status, out, complaint = done.returncode, done.stdout, done.stderr  # type: ignore[attr-defined]
    promise(status in (0, 1, 2), f"exit status {status}")
    promise("Warning" not in complaint and "Traceback" not in complaint, complaint[:300])
    promise("not enough memory" not in complaint, complaint[:200])
    if status == 2 or (status == 1 and not out.strip()):
        promise(complaint.count("\n") == 1 and complaint.startswith("ridelog"), f"no single line: {complaint[:300]!r}")
        raise BadInput(complaint.rstrip("\n"))
    try:
        content = json.loads(out, parse_constant=_no_number)
    except ValueError as error:
        promise(False, f"{command}: {error}: {out[:100]!r}")
    return status, tuple(sorted(content))


def _command(name: str, files: dict[str, bytes], damages: dict[str, fields.Damage], *words: str,
             mend: Callable[[bytes], bytes] | None = None) -> Callable[[Path], Target]:
    """A command whose words name files by {name}; the fields of one of those with a damage are changed at a time."""
    def target(folder: Path) -> Target:
        def damage(rng: random.Random, data: bytes) -> bytes:
            file = rng.choice(list(damages))
            changed = damages[file](rng, files[file])
            return file.encode() + b"\0" + (mend(changed) if mend is not None and rng.random() < 0.9 else changed)

        def read(data: bytes, rng: random.Random) -> Hashable:
            file, between, content = data.partition(b"\0")
            for one, whole in files.items():
                path = folder / one
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content if between and one == file.decode() else whole)
            said = [word.replace("{}", str(folder)) for word in words]
            return file, _answer(name, called(name.split()[0], *name.split()[1:], *said, "--json"))
        return Target(name, [b""], read, damage=damage, limit_s=LIMIT_S)
    return target


_RNG = np.random.default_rng(5)
_T = np.arange(800) / 100
_SHAKEN = np.convolve(_RNG.standard_normal(830), np.hanning(31) / 8, "valid")
_AXIS = table("distance_m,elevation_m", 0.1 * np.arange(1400), 0.004 * np.cumsum(0.3 * _RNG.standard_normal(1400)),
              form="%.7g")
_DRIVE = table("t_s,accel_z_mps2,speed_mps,distance_m", _T, _SHAKEN, 12 + 0 * _T, 12 * _T)
_SHAKE = table("t_s,elevation_m", _T, 0.01 * _SHAKEN)
_CHANNELS = table("t_s,a,b", _T, _SHAKEN, _SHAKEN[::-1] + 0.5 * _SHAKEN)
_FACTS = b"sensor: {step_mps2: 0.01, range_mps2: 19.6, noise_mps2: 0.05}\nplace_std_m: 0.1\n"
_CAR = Path(vehicle_file("rav4-2009")).read_bytes()
_TABLES: fields.Damage = fields.tables()
_LOG = "\n".join([HEADER, *map(format_row, repeated_drives(2, 60, (2.0, 3.0)))]).encode() + b"\n"
_LOGS = {"logs/00001-000.csv": _LOG}
_RUN = {"run/drive.csv": _DRIVE, "run/profile.csv": _AXIS, "run/run.yaml": _FACTS, "car.yaml": _CAR}
_RUN_DAMAGES = {"run/drive.csv": _TABLES, "run/profile.csv": _TABLES, "run/run.yaml": fields.numbers,
                "car.yaml": fields.numbers}


def _dumped(name: str, *words: str) -> Callable[[Path], Target]:
    """A command on a dump of a short simulated drive."""
    def target(folder: Path) -> Target:
        record(simulate_drive(replace(SHORT_PLAN, speed_knots=((0, 0), (2, 0), (7, 12), (20, 12))),
                              read_vehicle(vehicle_file("rav4-2009"))), folder / "whole.dump.gz")
        with gzip.open(folder / "whole.dump.gz") as file:
            text = file.read()
        with open_dump(folder / "whole.dump.gz") as reader:
            promise(reader.header is not None, "no header")
        return _command(name, {"a.dump": text}, {"a.dump": dump_lines}, *words)(folder)
    return target


def _phone(name: str, *words: str) -> Callable[[Path], Target]:
    t = np.sort(np.arange(900) / 100 + 0.001 * _RNG.random(900))
    force = 0.5 * _RNG.standard_normal((900, 3)) + [0, 0, 9.81]
    ride = table("t_s,accel_x_mps2,accel_y_mps2,accel_z_mps2", t, *force.T)
    k = np.arange(10.0)
    fixes = table("t_s,lat_deg,lon_deg,speed_mps", k, 46.5 + 1e-4 * k, 6.5 + 0 * k, 11.1 + 0 * k, form="%.9g")
    return _command(name, {"ride.csv": ride, "fixes.csv": fixes}, {"ride.csv": _TABLES, "fixes.csv": _TABLES}, *words)


COMMAND_TARGETS: dict[str, Callable[[Path], Target]] = {
    "command:iri": _command("iri", {"p.csv": _AXIS}, {"p.csv": _TABLES}, "{}/p.csv", "--window", "20"),
    "command:iri_resample": _command("iri", {"p.csv": _AXIS}, {"p.csv": _TABLES}, "{}/p.csv", "--resample", "0.05"),
    "command:road_classify": _command("road classify", {"p.csv": _AXIS}, {"p.csv": _TABLES}, "{}/p.csv"),
    "command:comfort": _command("comfort", {"r.csv": _DRIVE}, {"r.csv": _TABLES}, "{}/r.csv"),
    "command:comfort_resample": _command("comfort", {"r.csv": _DRIVE}, {"r.csv": _TABLES}, "{}/r.csv", "--resample"),
    "command:estimate": _command("estimate", _RUN, _RUN_DAMAGES, "{}/run", "--vehicle", "{}/car.yaml"),
    "command:estimate_resample": _command("estimate", _RUN, _RUN_DAMAGES, "{}/run", "--vehicle", "{}/car.yaml",
                                          "--resample", "--noise", "auto"),
    "command:simulate": _command("simulate", _RUN, {"run/profile.csv": _TABLES, "car.yaml": fields.numbers},
                                 "--vehicle", "{}/car.yaml", "--profile", "{}/run/profile.csv", "--speed", "12",
                                 "--out", "{}/out.csv"),
    "command:simulate_rig": _command("simulate", {"e.csv": _SHAKE, "car.yaml": _CAR},
                                     {"e.csv": _TABLES, "car.yaml": fields.numbers}, "--vehicle", "{}/car.yaml",
                                     "--excitation", "{}/e.csv", "--out", "{}/out.csv"),
    "command:compare": _command("compare", _RUN, _RUN_DAMAGES, "--vehicle", "{}/car.yaml", "{}/run"),
    "command:identify": _command("identify", _RUN, _RUN_DAMAGES, "--vehicle", "{}/car.yaml", "--free", "sprung_mass_kg",
                                 "{}/run"),
    "command:modes": _command("modes", {"c.csv": _CHANNELS}, {"c.csv": _TABLES}, "{}/c.csv"),
    "command:extract": _dumped("extract", "{}/a.dump", "--out", "{}/runs"),
    "command:extract_csv": _phone("extract", "--csv", "{}/ride.csv", "--location", "{}/fixes.csv", "--out", "{}/runs"),
    "command:replay": _dumped("replay", "{}/a.dump", "--out", "{}/out"),
    "command:verify": _command("verify", _LOGS, {"logs/00001-000.csv": _TABLES}, "{}/logs", mend=mend_rows),
    "command:report": _command("report", _LOGS, {"logs/00001-000.csv": _TABLES}, "{}/logs", "--out", "{}/r.html",
                               mend=mend_rows),
    "command:sections": _command("sections", _LOGS, {"logs/00001-000.csv": _TABLES}, "{}/logs", mend=mend_rows),
    "command:passes": _command("passes", _LOGS, {"logs/00001-000.csv": _TABLES}, "{}/logs", mend=mend_rows),
    "command:convert": _command("convert", _LOGS, {"logs/00001-000.csv": _TABLES}, "{}/logs", "--to", "{}/r.geojson",
                                mend=mend_rows),
}
