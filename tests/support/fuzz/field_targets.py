"""Every reader of files, given valid files in which fields were changed (``fields``); those of ``targets`` as well.

A reader may take what was changed where it is still a file: then its numbers must be numbers. What is computed with
them afterwards is run by ``command_targets``.
"""

from __future__ import annotations

import io
import json
import random
from collections.abc import Callable, Hashable
from dataclasses import replace
from math import isfinite
from pathlib import Path

import numpy as np

from logger.api.csv_recording import CsvSettings, recorded_csv
from logger.api.datasets.lira_map import ProfilerPass
from logger.api.inputs import run_on_road as read_run
from logger.errors import BadInput
from logger.files import json_sha256
from logger.fleet.dataset import Dataset
from logger.service import learning
from logger.service.config import Config
from logger.service.status import read_status
from logger.store.export.manifest import Manifest, list_blocks, manifest_blocks, read_manifest
from logger.store.export.sticks import read_note
from logger.store.formats import calibration_file, record_checks
from logger.store.formats.csv_table import columns_of
from logger.store.formats.drive_file import read_columns, read_run_facts, read_speeds
from logger.store.formats.mat_file import read_arrays, read_geopoint
from logger.store.formats.profile_file import read_excitation, read_places, read_profile
from logger.store.formats.record_file import read_columns as read_record_columns
from logger.store.formats.road_lines import read_map_ways, read_road_lines, read_route
from logger.store.formats.vehicle_file import read_model
from logger.store.log.sidecar import read_sidecar

from . import fields, targets
from .mutation import Target
from .targets import _File, promise

Reader = Callable[[bytes, random.Random], Hashable]


def _finite(*arrays: object) -> None:
    for one in arrays:
        promise(one is None or bool(np.isfinite(np.asarray(one, dtype=float)).all()), "a number that is none")


def table(header: str, *columns: np.ndarray, form: str = "%.6g", delimiter: str = ",") -> bytes:
    rows = [delimiter.join(form % one for one in row) for row in zip(*columns, strict=True)]
    return ("\n".join([header, *rows]) + "\n").encode()


_T = np.arange(150) / 100
_RNG = np.random.default_rng(3)
_NOISE = _RNG.standard_normal(150)


def checked_record(folder: Path) -> Target:
    """Records and drives, judged and laid on an even grid, as commands ask for it."""
    file = _File(folder, "record.csv")
    plain = table("t_s,accel_z_mps2,accel_x_mps2,speed_mps,distance_m", _T, _NOISE, 0.3 * _NOISE[::-1], 15 + 0 * _T,
                   15 * _T)
    uneven = table("t_s,accel_z_mps2", np.sort(_T + 0.004 * _RNG.random(150)), 9.81 + _NOISE)
    held = table("t_s,accel_z_mps2", _T, np.repeat(_NOISE[::2], 2))

    def read(data: bytes, rng: random.Random) -> Hashable:
        path = file.hold(data)
        asked = record_checks.RecordRules(rng.choice((None, "g", "mps2")), rng.choice((None, 0.0, 100.0, 1000.0)))
        if b"speed_mps" in data[:100] and rng.random() < 0.5:
            name, columns = read_columns(path)
            found = record_checks.even_columns(columns, name, asked)
        else:
            name, t_s, accel, _ = read_record_columns(path)
            found = record_checks.even_record(t_s, accel, {}, name, asked)
        promise(0 < found.rate_hz < float("inf") and isfinite(found.start_s), "no rate")
        _finite(*found.accel_mps2.values(), *found.others.values())
        return len(found.doubts), found.resampled is None
    return Target("record checks", [plain, uneven, held], read, damage=fields.tables(), file=str(file.path))


def run_folder(folder: Path) -> Target:
    """A run's folder, in each file of which fields are changed."""
    road = table("distance_m,elevation_m,elevation_right_m,lat_deg,lon_deg", 0.25 * np.arange(60), 0.01 * _NOISE[:60],
                  0.01 * _NOISE[60:120], 46.5 + 1e-6 * np.arange(60), 6.5 + 0 * _T[:60], form="%.9g")
    drive = table("t_s,accel_z_mps2,speed_mps,distance_m,lat_deg,lon_deg,usable,pitch_rad_per_s", _T[:60], _NOISE[:60],
                   15 + 0 * _T[:60], 15 * _T[:60], 46.5 + 0 * _T[:60], 6.5 + 0 * _T[:60], np.ones(60), _NOISE[60:120])
    facts = (b"sensor: {step_mps2: 0.6129, range_mps2: 19.6, noise_mps2: 0.05}\nplace_std_m: 0.1\n"
             b"pass_band_hz: [0, 38]\nsource: x.dump\nreceiver: {delay_s: 0.2, delay_std_s: 0.01, speed_scale: 1.01,\n"
             b"  speed_scale_std: 0.001}\nplaces: {by: road, vehicle: rav4-2009}\n"
             b"signals:\n  pitch_rad_per_s: {measures: pitch_rate, of: body}\n")
    names = {b"distance_m": "profile.csv", b"t_s": "drive.csv", b"sensor": "run.yaml"}
    whole = {"profile.csv": road, "drive.csv": drive, "run.yaml": facts}
    damages = {"profile.csv": fields.tables(), "drive.csv": fields.tables(), "run.yaml": fields.numbers}

    def damage(rng: random.Random, data: bytes) -> bytes:
        name = next(name for start, name in names.items() if data.startswith(start))
        return name.encode() + b"\0" + damages[name](rng, data)

    def read(data: bytes, rng: random.Random) -> Hashable:
        name, between, content = data.partition(b"\0")
        changed = {name.decode(): content} if between and name.decode() in whole else {}
        for file, text in {**whole, **changed}.items():
            (folder / file).write_bytes(text)
        read_run_facts(folder)
        if rng.random() < 0.2:
            _finite(*read_places(folder / "profile.csv"))
        run = read_run(folder)
        _finite(run.time_s, run.accel_z_mps2, run.speed_mps, run.distance_m, run.lat_deg, run.lon_deg, run.usable,
                *run.more.values())
        return name, run.lat_deg is None, run.usable is None
    return Target("run folder", [road, drive, facts], read, damage=damage, file=str(folder))


def profile(folder: Path) -> Target:
    """Profiles, also resampled."""
    file = _File(folder, "profile.csv")
    x = 0.25 * np.arange(60)
    examples = [table("distance_m,elevation_m", x, 0.01 * _NOISE[:60]),
                table("distance_m,elevation_m,elevation_right_m", x, 0.01 * _NOISE[:60], 0.02 * _NOISE[:60])]

    def read(data: bytes, rng: random.Random) -> Hashable:
        found = read_profile(file.hold(data), rng.choice((None, None, 0.1, 0.001, 1.0)))
        promise(0 < found.spacing_m < float("inf") and isfinite(found.start_m), "no spacing")
        _finite(found.elevation_m, found.elevation_right_m)
        return found.elevation_right_m is None, found.widest_step_m is None
    return Target("profile", examples, read, damage=fields.tables(), file=str(file.path))


def timed(folder: Path) -> Target:
    """Excitations and speed files."""
    file = _File(folder, "excitation.csv")
    both = table("t_s,elevation_m,elevation_rear_m", _T, 0.01 * _NOISE, 0.02 * _NOISE)
    speeds = table("t_s,speed_mps", np.arange(20.0), 10 + np.arange(20.0))

    def read(data: bytes, rng: random.Random) -> Hashable:
        path = file.hold(data)
        if b"speed" in data[:40]:
            _finite(*read_speeds(path))
            return "speeds"
        found = read_excitation(path)
        promise(0 < found.rate_hz < float("inf"), "no rate")
        _finite(found.elevation_m)
        return found.elevation_m.ndim
    return Target("excitation", [both, speeds], read, damage=fields.tables(), file=str(file.path))


def phone(folder: Path) -> Target:
    """A phone's recording up to readings and fixes on the grid of a run."""
    file, place = _File(folder, "ride.csv"), folder / "place.csv"
    t = np.sort(np.arange(1200) / 104 + 0.001 * _RNG.random(1200))
    force = 0.5 * _RNG.standard_normal((1200, 3)) + [0, 0, 9.81]
    k = np.arange(12.0)
    one = table("time,ax,ay,az", t, *force.T)
    ridelog = table("t_s,accel_x_mps2,accel_y_mps2,accel_z_mps2,lat_deg,lon_deg,speed_mps", t, *force.T,
                     46.5 + 1e-4 * np.floor(t), 6.5 + 0 * t, 11.1 + 0 * t, form="%.9g")
    semicolons = table("Time (s);Acceleration x (m/s^2);Acceleration y (m/s^2);Acceleration z (m/s^2)", t, *force.T,
                        delimiter=";").replace(b".", b",")
    fixes = table("t_s,lat_deg,lon_deg,speed_mps", k, 46.5 + 1e-4 * k, 6.5 + 0 * k, 11.1 + 0 * k, form="%.9g")
    columns = "t=time:s,x=ax:m/s2,y=ay:m/s2,z=az:m/s2"

    def read(data: bytes, rng: random.Random) -> Hashable:
        from logger.store.formats.logger_csv import named_columns

        place.write_bytes(fields.tables()(rng, fixes) if data == one else fixes)
        alone = b"lat_deg" in data[:200]
        asked = CsvSettings(named_columns(columns) if data.startswith(b"time") else None,
                      None if alone else place, speed_mps=12.0 if rng.random() < 0.1 else None)
        found = recorded_csv(file.hold(data), asked, Config(), lambda words: None)
        _finite(found.readings.time_s, found.readings.accel_mps2, found.fixes.time_s, found.fixes.speed_mps)
        return len(found.notes), found.torn_tail
    return Target("phone csv", [one, ridelog, semicolons], read, damage=fields.tables(), limit_s=10.0)


def vehicle(folder: Path) -> Target:
    """Vehicles with effects and numbers that say how well they are known."""
    axle = ("  cg_distance_m: 1.4\n  unsprung_mass_kg: 55 +- 5%\n  suspension_stiffness_n_per_m: 23088 +- 400\n"
            "  suspension_damping_n_s_per_m: [1500, 2000]\n  tire_stiffness_n_per_m: 238180\n")
    text = (f"name: x\nmodel: half_car\nsprung_mass_kg: 875\npitch_inertia_kg_m2: 1100\nfront:\n{axle}rear:\n{axle}"
            "contact_patch_m: 0.25\nsensor: {ahead_m: 0.3}\neffects:\n"
            "- {name: tire_damping, tire_damping_n_s_per_m: 150, standard_errors: {tire_damping_n_s_per_m: 20}}\n"
            "- {name: dry_friction, friction_force_n: 80}\n- {name: bump_stop, clearance_m: 0.05, "
            "stop_stiffness_n_per_m: 200000}\n- {name: occupant, mass_kg: 70, frequency_hz: 4, damping_ratio: 0.3}\n")
    plain = text.replace(" +- 5%", "").replace(" +- 400", "").replace("[1500, 2000]", "1776")
    file = _File(folder, "car.yaml")

    def read(data: bytes, rng: random.Random) -> Hashable:
        model = read_model(file.hold(data))
        return len(model.effects), model.vehicle.model
    return Target("vehicle", [plain.encode(), text.encode()], read, damage=fields.numbers, file=str(file.path))


def geojson(folder: Path) -> Target:
    """Routes, roads and ways of a map."""
    line = {"type": "LineString", "coordinates": [[6.5, 46.5], [6.51, 46.5], [6.52, 46.51]]}
    post = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [6.505, 46.5]}, "properties": {"km": 0.4}}
    route = {"type": "FeatureCollection", "features": [
        {"type": "Feature", "geometry": line, "properties": {"begin_km": 0.0, "end_km": 1.9}}, post]}
    ways = {"type": "FeatureCollection", "features": [
        {"type": "Feature", "id": "way/4711", "geometry": line, "properties": {"highway": "primary", "lanes": "2"}}]}
    file = _File(folder, "route.geojson")

    def read(data: bytes, rng: random.Random) -> Hashable:
        path = file.hold(data)
        if b"highway" in data:
            return "ways", len(read_map_ways(path))
        if rng.random() < 0.3:
            return "lines", len(read_road_lines(path))
        found = read_route(path)
        _finite(found.lat_deg, found.lon_deg, found.post_m, found.begin_m or 0.0, found.end_m or 0.0)
        return "route", len(found.post_m)
    return Target("geojson", [json.dumps(route).encode(), json.dumps(ways).encode()], read, damage=fields.objects,
                  file=str(file.path))


def small_json(folder: Path) -> Target:
    """What the service keeps for itself: what is learned, sidecars, status, notes of sticks, calibrations; and the
    manifest of a fleet. Of these a damaged one is as none, or refused; it never ends anything."""
    learned = {"latency_s": 0.2, "latency_std_s": 0.01, "latency_drives": 3}
    noise = {"noise_mps2": 0.05, "noise_std_mps2": 0.01, "noise_drives": 2, "of": {"driver": "bma220"}}
    fleet = {"ridelog_fleet": 1, "roads": "x", "trim_m": 100.0, "commits": [
        {"name": "00001", "ledger": "ledger/1.parquet", "rows": 10, "files": [
            {"path": "month=1/cell=2/1.parquet", "rows": 10, "first_day": 20000, "last_day": 20001}]}]}
    row = {"slope": 1.0, "intercept": 0.0, "spread": 0.1}
    stored = {"a" * 64: [{"speed_mps": 15.0, "iri": row, "comfort": row}]}
    calibration = {"format": 1, "calibrations": stored}
    point = {"pos": {"lat": 55.5, "lng": 12.5}, "timestamp": 0.0, "value": 1.5}
    lira = {"path": {"data": [point, {**point, "timestamp": 10.0, "pos": {"lat": 55.501, "lng": 12.5}}]}}
    status = {"pid": 1, "version": "1", "started_t_us": 1, "written_t_us": 2, "accelerometer": {"words": "x"}}
    sidecar = {"format": 1, "config": {"x": 1.0}, "clock_map": {"offset_us": 5}, "log": {"session": 1, "rows": 3}}
    note = {"name": "sda1", "state": "done", "finished": True, "words": "x"}
    kinds = {"receiver-delay": learned, "sensor-noise": noise, "fleet.json": fleet, "car.calibration.json": calibration,
             "trip_iri_1.json": lira, "status.json": status, "00001-001.json": sidecar, "sda1.1.json": note}

    def damage(rng: random.Random, data: bytes) -> bytes:
        name, _, text = data.partition(b"\0")
        return name + b"\0" + (fields.objects(rng, text) if rng.random() < 0.9 else fields.numbers(rng, text))

    def read(data: bytes, rng: random.Random) -> Hashable:
        name, _, text = data.decode("utf-8", "replace").partition("\0")
        path = folder / name
        path.write_text(_sealed(name, text) if rng.random() < 0.8 else text)
        try:
            return name, _small(name, path)
        finally:
            path.unlink()
    return Target("small json", [f"{name}\0{json.dumps(one)}".encode() for name, one in kinds.items()], read,
                  damage=damage, file="")


def _sealed(name: str, text: str) -> str:
    """With the checksum that it should have, where it has one."""
    try:
        content = json.loads(text)
        if name == "car.calibration.json":
            return json.dumps(content | {"sha256": json_sha256(content["calibrations"])})
        if name == "00001-001.json":
            return json.dumps(content | {"sha256": json_sha256(content)})
    except (ValueError, TypeError, KeyError):
        pass
    return text


def _small(name: str, path: Path) -> Hashable:
    match name:
        case "receiver-delay":
            found = learning.read_delay(path.parent)
            promise(found is None or (isfinite(found.delay_s) and isfinite(found.std_s)), "a delay that is none")
            return found is None
        case "sensor-noise":
            try:
                known = learning.NOISE.from_fields(json.loads(path.read_text()))
            except ValueError:
                return "refused"
            return known is None or isfinite(known.belief.noise_rms_mps2)
        case "fleet.json":
            dataset = Dataset.__new__(Dataset)
            dataset.folder = path.parent
            manifest = Dataset._read(dataset)
            promise(isfinite(manifest.trim_m), "a length that is none")
            return len(manifest.commits)
        case "car.calibration.json":
            return calibration_file.find([path], "a" * 64) is None
        case "trip_iri_1.json":
            _finite(ProfilerPass(path).iri_m_per_km)
            return 1
        case "status.json":
            return read_status(path) is None
        case "sda1.1.json":
            return read_note(path) is None
        case _:
            try:
                return read_sidecar(path.with_suffix(".csv")) is None
            except ValueError:
                return "refused"


def semicolons(folder: Path) -> Target:
    """Tables of a road authority."""
    file = _File(folder, "road.csv")
    text = table("Meter;IRI h;IRI v;Rut", 20.0 * np.arange(12), 2 + 0 * _T[:12], 2.5 + 0 * _T[:12], _NOISE[:12],
                  delimiter=";")

    def read(data: bytes, rng: random.Random) -> Hashable:
        found = columns_of(data, str(file.path), ("Meter", "IRI h"))
        promise(not any(np.isinf(one).any() for one in found), "a number that is none")
        return len(found)
    return Target("semicolons", [text, text.replace(b".", b",")], read, damage=fields.tables(";"), file=str(file.path))


def mat(folder: Path) -> Target:
    """Files of MATLAB: bytes of tags and sizes changed."""
    from scipy.io import savemat

    file = _File(folder, "place.mat")
    examples = []
    for packed in (False, True):
        held = io.BytesIO()
        savemat(held, {"lat": np.linspace(55, 56, 9), "lon": np.linspace(12, 13, 9), "iri": np.arange(9)},
                do_compression=packed)
        examples.append(held.getvalue())

    def damage(rng: random.Random, data: bytes) -> bytes:
        out = bytearray(data)
        for _ in range(rng.choice((1, 1, 2, 4))):
            at = rng.randrange(0, len(out) - 4, 4) if rng.random() < 0.8 else rng.randrange(len(out) - 8)
            word = rng.choice((b"\0\0\0\0", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\xf0\x7f", b"\1\0\0\0",
                               b"\0\0\0\x40", b"\0\xff\xff\0", rng.randbytes(4)))
            out[at : at + 4] = word
        return bytes(out[: rng.randrange(len(out))] if rng.random() < 0.05 else out)

    def read(data: bytes, rng: random.Random) -> Hashable:
        path = file.hold(data)
        try:
            return len(read_arrays(path, ("lat", "iri"))) if rng.random() < 0.5 else len(read_geopoint(path)[0])
        except BadInput as error:
            promise("allocate" not in str(error), f"memory that was asked for: {error}")
            raise
    return Target("mat", examples, read, damage=damage, file=str(file.path))


def manifests(folder: Path) -> Target:
    """The list of an export and the marks of what was exported, with the checksum that they should have."""
    digest = "ab" * 32
    text = b"".join(manifest_blocks(Manifest("0123456789ab", {"00001-000.csv": digest, "00001-000.json": digest})))

    def damage(rng: random.Random, data: bytes) -> bytes:
        return fields.numbers(rng, b"\n".join(data.split(b"\n")[:-2]))

    def mend(data: bytes) -> bytes:
        head, *lines = data.decode("utf-8", "surrogateescape").split("\n")
        try:
            return b"".join(list_blocks(head, lines))
        except UnicodeEncodeError:
            return data

    def read(data: bytes, rng: random.Random) -> Hashable:
        try:
            return len(read_manifest([data]).files)
        except ValueError as error:
            raise BadInput(str(error)) from error
    return Target("manifest", [text], read, mend=mend, damage=damage)


def _also(make: Callable[[Path], Target], name: str, damage: fields.Damage) -> Callable[[Path], Target]:
    """A reader of ``targets`` on fields that were changed."""
    return lambda folder: replace(make(folder), name=name, damage=damage)


def dump_lines(rng: random.Random, data: bytes) -> bytes:
    """Times, sources and bytes of a dump, and the words of its header."""
    if data[:2] == b"\x1f\x8b":
        return data
    head, _, rest = data.partition(b"\n")
    if rng.random() < 0.3:
        start, _, words = head.partition(b" {")
        try:
            head = start + b" " + fields.objects(rng, b"{" + words)
        except ValueError:
            head = fields.numbers(rng, head)
        return head + b"\n" + rest
    return fields.tables(" ")(rng, data)


FIELD_TARGETS: dict[str, Callable[[Path], Target]] = {
    "fields:record_checks": checked_record,
    "fields:run_folder": run_folder,
    "fields:profile": profile,
    "fields:erd": _also(targets.erd, "erd fields", fields.numbers),
    "fields:excitation": timed,
    "fields:channels": _also(targets.channels, "channel fields", fields.tables()),
    "fields:phone_csv": phone,
    "fields:vehicle": vehicle,
    "fields:config": _also(targets.config, "config fields", fields.numbers),
    "fields:wire_profile": _also(targets.pasco_profile, "wire profile fields", fields.numbers),
    "fields:geojson": geojson,
    "fields:small_json": small_json,
    "fields:semicolons": semicolons,
    "fields:mat": mat,
    "fields:manifest": manifests,
    "fields:nmea": _also(lambda folder: targets.nmea(), "nmea fields", fields.tables(",")),
    "fields:dump": _also(targets.dump, "dump fields", dump_lines),
    "fields:segment_log": _also(targets.segment_log, "log fields", fields.tables()),
}
