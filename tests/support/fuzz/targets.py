"""The readers that take bytes from outside, each with valid examples and with what may be accepted.

What was accepted is checked by plain code that shares nothing with the reader: sentences split by hand, check values
by loops, samples looked up among all places where the bytes hold one.
"""

from __future__ import annotations

import gzip
import io
import os
import random
import re
import shutil
import tempfile
import zlib
from collections.abc import Callable, Hashable
from dataclasses import replace
from math import isfinite
from pathlib import Path

import numpy as np

from drivers.accelerometers.bma220 import Bma220Decoder
from drivers.accelerometers.pasco import PascoDecoder
from drivers.dump import open_dump
from drivers.nmea import NmeaDecoder
from drivers.wire_profiles import FrameLayout, LineLayout, WireProfile, load_profile, shipped_profiles
from logger.api.inputs import run_on_road as read_run
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.service.config import load_config
from logger.service.wiring import config_for_dump
from logger.store.formats.profile_file import read_profile
from logger.store.formats.record_checks import read_channels
from logger.store.formats.record_file import read_record
from logger.store.formats.vehicle_file import CarModel, read_vehicle, write_model
from logger.store.integrity import verify
from logger.store.log.row_format import COLUMNS, HEADER, format_row, read_log, scan

from .mutation import Target, ViolationError

Reader = Callable[[bytes, random.Random], Hashable]


def promise(holds: bool, words: str) -> None:
    """Complain about a reader that does not do what it should."""
    if not holds:
        raise ViolationError(words)


def folder_for_files() -> Path:
    """A folder in memory, so that a million small files wear out no disk."""
    return Path(tempfile.mkdtemp(prefix="fuzz-", dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))


def pieces(data: bytes, rng: random.Random) -> list[bytes]:
    """The bytes cut anywhere."""
    cuts = sorted(rng.randrange(len(data) + 1) for _ in range(rng.choice((0, 1, 3))))
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


# --- NMEA


def exclusive_or(data: bytes) -> int:
    total = 0
    for byte in data:
        total ^= byte
    return total


def sentence(text: str) -> bytes:
    return f"${text}*{exclusive_or(text.encode()):02X}\r\n".encode()


_ANY_SENTENCE = re.compile(rb"\$([^$]*)\*([0-9A-Fa-f]{2})")


def mend_sentences(data: bytes) -> bytes:
    return _ANY_SENTENCE.sub(lambda found: b"$%s*%02X" % (found[1], exclusive_or(found[1])), data)


class _Said:
    """What the sentences with a right checksum say, as numbers."""

    def __init__(self, data: bytes) -> None:
        self.places: set[tuple[float, float]] = set()
        self.numbers: set[float] = {0.0}
        self.clocks: set[int] = set()
        for start in (place for place, byte in enumerate(data) if byte == ord("$")):
            end = start + 1
            while end < len(data) and 0x20 <= data[end] < 0x7F and data[end] != ord("$"):
                end += 1
            body, star, check = data[start + 1 : end].rpartition(b"*")
            if star and re.fullmatch(rb"[0-9a-fA-F]{2} *", check) and exclusive_or(body) == int(check, 16):
                self._take(body.decode().split(","))

    def _take(self, fields: list[str]) -> None:
        kind = fields[0][2:]
        at = {"RMC": 3, "GGA": 2}.get(kind)
        for text in fields[1:]:
            if re.fullmatch(r"-?[0-9]*(\.[0-9]*)?", text) and re.search("[0-9]", text):
                self.numbers.add(round(float(text), 9))
        if at is not None and len(fields) > at + 3:
            self.clocks.add(_clock_us(fields[1]))
            lat, north, lon, east = fields[at : at + 4]
            if lat and lon:
                self.places.add((_degrees(lat, north == "S"), _degrees(lon, east == "W")))


def _degrees(text: str, negative: bool) -> float:
    whole, _, fraction = text.partition(".")
    if not whole[-2:].isdigit() or not whole[:-2].isdigit():
        return float("inf")
    if fraction and not fraction.isdigit():
        return float("inf")
    size = float(whole[:-2]) + float(f"{whole[-2:]}.{fraction or 0}") / 60
    return round(-size if negative else size, 9)


def _clock_us(text: str) -> int:
    if not re.fullmatch(r"[0-9]{6}(\.[0-9]*)?", text):
        return -1
    micros = int((text[7:] + "000000")[:6])
    return ((int(text[:2]) * 60 + int(text[2:4])) * 60 + int(text[4:6])) * 1_000_000 + micros


def read_nmea(data: bytes, rng: random.Random) -> Hashable:
    decoder = NmeaDecoder()
    fixes, arrivals = [], []
    for number, piece in enumerate(pieces(data, rng)):
        arrivals.append(1_000_000 * number)
        fixes += decoder.feed(arrivals[-1], piece)
    fixes += decoder.flush()
    whole = NmeaDecoder()
    again = whole.feed(0, data) + whole.flush()
    promise([f.lat_deg for f in again] == [f.lat_deg for f in fixes], "other fixes when the bytes are cut elsewhere")
    if not fixes:
        return ("nothing", decoder.counts["sentences"] > 0, decoder.counts["malformed"] > 0)
    said = _Said(data)
    for fix in fixes:
        promise(fix.t_us in arrivals, "a fix that arrived at no time at which bytes did")
        if not fix.valid:
            promise(fix.lat_deg is fix.speed_mps is fix.utc_us is None, "an invalid fix that says something")
            continue
        place = (round(fix.lat_deg, 9), round(fix.lon_deg, 9))
        promise(place in said.places, f"a place that stands in no intact sentence: {place}")
        promise(abs(fix.lat_deg) <= 90 and abs(fix.lon_deg) <= 180, "a place not on the earth")
        promise(fix.time_of_day_us is None or fix.time_of_day_us in said.clocks, "a time that nobody gave")
        if fix.speed_mps is not None:
            known = {round(fix.speed_mps * 3600 / 1852, 6), round(fix.speed_mps * 3.6, 6)}
            reported = bool(known & {round(number, 6) for number in said.numbers})
            promise(reported and 0 <= fix.speed_mps <= 150, "an invented speed")
        for value in (fix.course_deg, fix.altitude_m, fix.hdop, fix.satellites):
            promise(value is None or round(float(value), 9) in said.numbers, f"an invented number {value}")
        if fix.utc_us is not None:
            promise((fix.utc_us - fix.time_of_day_us) % 86_400_000_000 == 0, "a UTC that is not of its time of day")
    counters = decoder.counts
    return (min(len(fixes), 3), fixes[-1].valid, fixes[-1].utc_us is None, fixes[-1].speed_mps is None,
            counters["ubx_frames"] > 0, counters["malformed"] > 0, counters["refused_dates"] > 0)


def nmea() -> Target:
    epoch = (sentence("GNRMC,120000.00,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A,V")
             + sentence("GNGGA,120000.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,"))
    full = (epoch + sentence("GNVTG,84.4,T,77.8,M,22.4,N,41.5,K,A") + sentence("GNZDA,120000.00,15,06,2026,00,00")
            + sentence("GNGSA,A,3,10,07,05,02,29,04,08,13,,,,,1.72,1.03,1.38,1"))
    later = epoch.replace(b"120000.00", b"120001.00")
    ubx = bytes.fromhex("b56201070400010203041e5a")
    lost = sentence("GPRMC,,V,,,,,,,,,,N") + sentence("GPGGA,,,,,,0,00,99.99,,,,,,")
    odd = (sentence("GPRMC,235959.999,A,0000.000,S,17959.999,W,0.0,,311299,,") + sentence("GPVTG,84.4,77.8,22.4,41.5")
           + sentence("GPGGA,235960,0000.000,S,17959.999,W,2,12,0.5,-5,M,,M,,"))
    tokens = (b"$", b"*00", b"\r\n", b"GPRMC,", b"GNGGA,", b"GPVTG,", b"GPGSA,", b"GPZDA,", b",A,", b",V,", b",N,",
              b"9000.0", b"18000.0", b"9000.00001", b"235960", b"290226", b"000000", b"\xb5\x62", b"\xb5", ubx,
              b"\xb5\x62\x01\x07\xff\xff", b",,,,", b"-0", b"361.0", b"99.99", b"E", b"S", b",8,")
    examples = [mend_sentences(text) for text in (epoch + later, full + mend_sentences(later), lost + epoch, odd,
                                                  ubx + epoch + ubx, epoch[:40] + epoch)]
    return Target("nmea", examples, read_nmea, tokens, mend_sentences)


# --- PASCO


def pasco_reader(profile: WireProfile) -> Reader:
    def read(data: bytes, rng: random.Random) -> Hashable:
        decoder = PascoDecoder(profile)
        t_us = 0
        times, samples = [np.empty(0, np.int64)], [np.empty((0, 3))]
        for piece in [*pieces(data, rng), b"", b""]:
            t_us += rng.choice((0, 10_000, 10_000, 400_000, 5_000_000))
            decoder.feed(t_us, piece)
            if rng.random() < 0.5:
                block = decoder.take()
                times.append(block.t_us)
                samples.append(block.accel_mps2)
        block = decoder.take()
        found_us = np.concatenate([*times, block.t_us])
        accel = np.concatenate([*samples, block.accel_mps2])
        promise(bool((np.diff(found_us) > 0).all()), "times that do not grow")
        promise(bool(np.isfinite(accel).all()), "accelerations that are no numbers")
        promise(len(found_us) == len(accel), "samples without times")
        ahead_us = int(found_us[-1]) - t_us if len(found_us) else 0
        counters = decoder.counts
        # Times grow by 1 us where they must, also over frames that were refused.
        promise(ahead_us <= counters["frames"] + counters["bad_frames"], f"a sample {ahead_us} us ahead")
        held = _frames_in(data, profile.layout) if isinstance(profile.layout, FrameLayout) else _lines_in(
            data, profile.layout)
        promise({tuple(row) for row in accel.tolist()} <= held, "a sample that the bytes do not hold")
        return (len(accel) > 0, len(accel) > 40, counters["bad_frames"] > 0, counters["resyncs"] > 0,
                counters["dropped_bytes"] > 0)
    return read


def _frames_in(data: bytes, layout: FrameLayout) -> set[tuple[float, ...]]:
    """The samples at every place of the bytes, whether a frame begins there or not."""
    places = len(data) - layout.length_bytes + 1
    if places <= 0:
        return set()
    raw = np.frombuffer(data, np.uint8).astype(np.int64)
    first, second = (0, 1) if layout.word.endswith("le") else (1, 0)
    axes = []
    for offset, zero, scale in zip(layout.offsets, layout.calibration.zero_g_raw, layout.calibration.mps2_per_count,
                                   strict=True):
        word = raw[offset + first :][:places] + 256 * raw[offset + second :][:places]
        if layout.word.startswith("i"):
            word = np.where(word >= 32768, word - 65536, word)
        axes.append((word - zero) * scale)
    return {tuple(row) for row in np.stack(axes, axis=1).tolist()}


def _lines_in(data: bytes, layout: LineLayout) -> set[tuple[float, ...]]:
    found = set()
    for line in re.split(rb"[\r\n]", data):
        text, star, check = line.partition(b"*")
        if star and (not re.fullmatch(rb"[0-9a-fA-F]{2} *", check) or exclusive_or(text) != int(check, 16)):
            continue
        try:
            found.add(tuple(float(word) * layout.unit_mps2 for word in text.split(b",")))
        except ValueError:
            continue
    return found


def pasco(name: str) -> Target:
    profile = load_profile(name)
    rng = np.random.default_rng(7)
    if isinstance(profile.layout, FrameLayout):
        counts = np.clip(rng.normal([4096, 4096, 4424], 40, (60, 3)), 800, 7400).astype("<u2")
        examples = [counts.tobytes(), b"\x01" + counts.tobytes(), counts[:20].tobytes() + b"\x00" * 7
                    + counts[20:].tobytes()]
        tokens = (b"\x20\x03\x20\x03\xe8\x1c", b"\x00\x10\x00\x10\x48\x11", b"\xff\xff", b"\x00\x10" * 48)
    else:
        rows = rng.normal([0, 0, profile.layout.range_units / 16], 0.1, (50, 3))
        plain = "".join(f"{x:.3f},{y:.3f},{z:.3f}\r\n" for x, y, z in rows).encode()
        checked = b"".join(b"%s*%02X\n" % (line, exclusive_or(line)) for line in plain.split())
        examples = [plain, checked, b"junk" + plain]
        tokens = (b"*00", b"\r\n", b"0,0,1\r\n", b",,", b"999999", b"1e5", b"-.5", b"+1.", b"0.0000000000001")
    return Target(f"pasco {name}", examples, pasco_reader(profile), tokens)


def bma220() -> Target:
    def read(data: bytes, rng: random.Random) -> Hashable:
        decoder = Bma220Decoder(2)
        whole = data[: len(data) // 3 * 3]
        for at in range(0, len(whole), 3):
            decoder.feed(at, whole[at : at + 3])
        block = decoder.take()
        counts = [[(byte - 256 if byte > 127 else byte) >> 2 for byte in whole[at : at + 3]]
                  for at in range(0, len(whole), 3)]
        promise(np.allclose(block.accel_mps2, np.array(counts).reshape(-1, 3) * 9.80665 / 16), "another sample")
        return len(block) > 0, decoder.anomalies > 0, bool(block.clipped.any())
    return Target("bma220 samples", [bytes((0, 4, 64)) * 30, bytes(range(255))], read)


# --- files


class _File:
    """One small file that is rewritten for every input."""

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / name

    def hold(self, data: bytes) -> Path:
        self.path.write_bytes(data)
        return self.path


def _dump_text() -> bytes:
    head = b'# ridelog-dump 1 {"start_utc": "2026-06-15T12:00:00+00:00", "accelerometer": {"driver": "bma220", '
    lines = [head + b'"range_g": 2}, "gps": {"baud": 9600}, "vehicle": "rav4-2009"}']
    lines += [b"%d.%06d bma220 0004%02x" % (5 + k // 100, k % 100 * 10_000, 60 + k % 3 * 4) for k in range(12)]
    return b"\n".join([*lines, b"5.200000 nmea 2447505a44412c", b"5.210000 pasco 0010001048110d0a"]) + b"\n"


def dump_reader(file: _File) -> Reader:
    def read(data: bytes, rng: random.Random) -> Hashable:
        packed = rng.random() < 0.3
        text, data = (data, gzip.compress(data, 1)) if packed else (data, data)
        if not packed and data[:2] == b"\x1f\x8b":
            text = b""
        with open_dump(file.hold(data)) as reader:
            header = reader.header
            lines = text.split(b"\n")[1:]
            count, last_us = 0, 0
            for count, event in enumerate(reader, start=1):
                promise(event.t_us >= last_us and len(event.data) > 0, "an event out of order or without bytes")
                last_us = event.t_us
                if text:
                    stamp, source, digits = lines[count - 1].split(b" ")
                    promise(bytes.fromhex(digits.decode()) == event.data and source.decode() == event.source
                            and int(stamp.replace(b".", b"")) == event.t_us, "an event that is not in its line")
            shape = (count > 0, count > 12, reader.torn_tail, packed)
        try:
            config_for_dump(header, None, None, str(file.path) + ":1")
        except BadInput as error:
            promise(str(error).startswith(f"{file.path}:1: ") and str(error).isprintable() and len(str(error)) < 1000,
                    f"a bad complaint {error}")
            return (*shape, "no settings")
        return shape
    return read


def dump(folder: Path) -> Target:
    text = _dump_text()
    other = text.replace(b'"bma220", "range_g": 2', b'"pasco", "profile": "lines", "vertical_axis": "-x"').replace(
        b'"2026-06-15T12:00:00+00:00"', b"null")
    packed = gzip.compress(text)
    tokens = (b" bma220 ", b" nmea ", b" pasco ", b"000000", b"0.000000", b"999999999.999999", b"# ridelog-dump 1 ",
              b"# ridelog-dump 2 ", b'{"', b"null", b"true", b"1e400", b'"\\ud800"', b'"\\u0000"', b"00", b"zz",
              b"\x1f\x8b", packed, b'"range_g": ', b'"oversample": 9', b'"profile": "', b'"driver": []', b'/x.yaml"',
              b'"calibrated": 1', b'"vehicle": "', b"\\n")
    file = _File(folder, "fuzz.dump")
    return Target("dump", [text, other, packed, packed + packed, text[:-4]], dump_reader(file), tokens,
                  file=str(file.path))


_RECORD = WindowRecord(
    segment=7, drive=1, t_us=12_000_000, utc_us=1_781_000_000_250_000, duration_s=0.4, distance_start_m=45.72,
    distance_end_m=53.34, lat_deg=46.5, lon_deg=6.6, speed_mps=20.0, iri_m_per_km=3.21, iri_std_m_per_km=1.1,
    iri_rms_m_per_km=3.21, a_w_mps2=0.4, mtvv_mps2=0.5, vdv_mps175=0.6, crest_factor=3.0, iri_class="B",
    comfort="a_little_uncomfortable", accel_rms_mps2=0.7, samples=40, clipped_samples=0, flags=("clipped", "gap"))


def mend_rows(data: bytes) -> bytes:
    """Every line with the check value that it should have."""
    head, *rows = data.split(b"\n")
    bodies = [row.rpartition(b",")[0] for row in rows]
    return b"\n".join([head, *(b"%s,%08x" % (body, zlib.crc32(body)) if body else row
                               for row, body in zip(rows, bodies, strict=True))])


def segment_log_reader(file: _File) -> Reader:
    def read(data: bytes, rng: random.Random) -> Hashable:
        good = bad = 0
        for row in scan(io.BytesIO(data)):
            if row.record is None:
                bad += 1
                promise(row.problem.isprintable() and len(row.problem) < 400, f"a bad complaint {row.problem[:300]!r}")
                continue
            good += 1
            body, _, check = row.text.rpartition(",")
            promise(f"{zlib.crc32(body.encode()):08x}" == check, "a row that does not fit its check value")
            promise(row.text.encode() in data, "a row that is not in the file")
            older = "," * (len(COLUMNS) - 1 - body.count(","))
            promise(format_row(row.record).rpartition(",")[0] == body + older,
                    "a row that is written otherwise than it was read")
        if rng.random() < 0.05:
            path = file.hold(data)
            content = read_log(path)
            promise((len(content.records), content.damaged_lines) == (good, bad), "another count")
            check, = verify([path])
            promise(check.records_good == good, "another count by verify")
            promise(all(problem.isprintable() and len(problem) < 500 for problem in check.problems), "a bad complaint")
        return min(good, 3), min(bad, 3)
    return read


def segment_log(folder: Path) -> Target:
    blind = replace(
        _RECORD, segment=8, utc_us=None, distance_start_m=None, distance_end_m=None, lat_deg=None, lon_deg=None,
        speed_mps=None, iri_m_per_km=None, iri_std_m_per_km=None, iri_rms_m_per_km=None, iri_class="", t_us=-1,
        flags=("blind", "gps_lost", "time_unset"))
    rows = [format_row(row) for row in (_RECORD, blind, replace(_RECORD, segment=9, t_us=13_000_000))]
    text = ("\n".join([HEADER, *rows]) + "\n").encode()
    tokens = (HEADER.encode(), rows[0].encode(), b",00000000", b",,", b"|", b"gap|", b"2026-02-30T10:15:00.250Z",
              b"9999-12-31T23:59:59.999Z", b"0000-01-01T00:00:00.000Z", b"1_0", b" 1", b"+1", b"-0.000", b"00.400",
              b"0.4000001", b"1.5e1")
    return Target("segment log", [text, text[:-20], text.replace(b"\n", b"", 2)],
                  segment_log_reader(_File(folder, "00001-000.csv")), tokens, mend_rows)


_YAML_TOKENS = (
    b"&a ", b"*a", b"<<: *a", b"!!int ", b"!!python/object/apply:os.system ", b"!<tag:x%0Ay> ", b"!!binary ", b"? ",
    b"- ", b": ", b"{}", b"[]", b"~", b"|\n  x", b">\n", b"---\n", b"...\n", b"%YAML 9.9\n---\n", b"%TAG ! x:\n", b"# ",
    b"'", b'"\\0"', b'"\\ud800"', b'"\\UFFFFFFFF"', b'"\\x0a"', b"010", b"1:30", b"0x1F", b"1_000", b".inf", b".nan",
    b"yes", b"2001-01-01", b"2001-99-99", b"1:" * 200 + b"1.5", b"- " * 50, b"? " * 50, b"a: " * 30, b"&a [*a]",
    b"\n" + b" " * 40, b"!!float ''", b"!!bool x", b"!!timestamp x", b"<<: {a: 1}", b"0b_", b"=",
)


def vehicle(folder: Path) -> Target:
    axle = (b"{cg_distance_m: 1.4, unsprung_mass_kg: 55, suspension_stiffness_n_per_m: 23088, "
            b"suspension_damping_n_s_per_m: 1776, tire_stiffness_n_per_m: 238180}")
    half = (b"name: x\nmodel: half_car\nsprung_mass_kg: 875\npitch_inertia_kg_m2: 1100\nfront: " + axle
            + b"\nrear: " + axle + b"\ncontact_patch_m: 0.25\neffects: []\n")
    block = half.replace(b"front: " + axle, b"front:\n  " + axle[1:-1].replace(b", ", b"\n  "))
    quarter = (b"name: q\nmodel: quarter_car\nsprung_mass_kg: 400\nfront: {" + axle[20:]
               + b"\ncontact_patch_m: 0\nsensor: {ahead_m: 0}\n")
    full = half.replace(b"half_car", b"full_car") + b"roll_inertia_kg_m2: 3\ntrack_width_m: 1.5\n"
    file, copy = _File(folder, "car.yaml"), folder / "copy.yaml"

    def read(data: bytes, rng: random.Random) -> Hashable:
        car = read_vehicle(file.hold(data))
        write_model(copy, CarModel(car))
        promise(read_vehicle(copy) == car, "another car when written and read again")
        return car.model, car.name == "x"
    tokens = (*_YAML_TOKENS, b"quarter_car", b"full_car", b"half_car", b"effects: [x]", b"sensor: {left_m: 1}")
    return Target("vehicle yaml", [half, quarter, full, block], read, tokens, file=str(file.path))


def config(folder: Path) -> Target:
    small = (b"accelerometer: {driver: bma220, bma220: {range_g: 4, bandwidth_hz: auto}}\n"
             b"gps: {port: /dev/x, baud: 9600}\nvehicle: golden-car\npipeline: {window_m: 10}\n"
             b"log: {directory: logs}\n")
    serial = (b"accelerometer:\n  driver: pasco\n  vertical_axis: -x\n  pasco:\n    profile: ps2119\n"
              b"    accept_unverified: true\n"
              b"    calibration: {x: [1, 0, 9, 1], y: [1, 0, 9, 1], z: [4096, 0, 4424, 1]}\n")
    other = b"status_file: s.json\nlog: {sync_s: 0.5, record_dump: true, max_file_bytes: 20000}\nvehicle: ./none.yaml\n"
    file = _File(folder, "ridelog.yaml")

    def read(data: bytes, rng: random.Random) -> Hashable:
        settings = load_config(file.hold(data))
        calibration = settings.accelerometer.sections["pasco"].calibration
        if calibration is not None:
            promise(all(map(isfinite, calibration.mps2_per_count)), "a scale that is no number")
        for path in (settings.log.directory, settings.status_file):
            promise("\0" not in str(path), "a path that can be none")
            str(path).encode()
        settings.gps.port.encode()
        return settings.accelerometer.driver, calibration is None
    tokens = (*_YAML_TOKENS, b"dump:", b"dump:fuzz.dump", b"profile: x.yaml", b"/" * 300, b"[1, 0, 1.0000001, 1e9]",
              b"1e-300", b"vehicle: ", b"low_pass_hz: null", b"bandwidth_hz: 32", b"../../x.yaml", b"i2c_bus: ")
    return Target("config yaml", [small, serial, other], read, tokens, file=str(file.path))


def pasco_profile(folder: Path) -> Target:
    package = Path(load_profile.__code__.co_filename).with_name("profiles")
    examples = [re.sub(rb" *#.*|source: >\n( .*\n)+", b"", (package / f"{name}.yaml").read_bytes())
                + b"source: x\n" for name in shipped_profiles()]
    file = _File(folder, "own.yaml")

    def read(data: bytes, rng: random.Random) -> Hashable:
        profile = load_profile(file.hold(data))
        promise(all(map(isfinite, profile.scale)), "a scale that is no number")
        decoder = PascoDecoder(profile)
        decoder.feed(0, data)
        decoder.take()
        return type(profile.layout).__name__, profile.verified
    tokens = (*_YAML_TOKENS, b"framing: lines", b"framing: frames", b"1e-320", b"sync: a5 5a", b"i16be", b"none")
    return Target("pasco profile yaml", examples, read, tokens, file=str(file.path))


def profile(folder: Path) -> Target:
    lines = b"".join(b"%.2f,%.4f\n" % (0.25 * k, 0.01 * (k % 3)) for k in range(12))
    one = b"distance_m,elevation_m\n" + lines
    two = b"distance_m,elevation_m,elevation_right_m\n" + lines.replace(b"\n", b",0.5\n")
    file = _File(folder, "profile.csv")

    def read(data: bytes, rng: random.Random) -> Hashable:
        found = read_profile(file.hold(data), resample_m=0.1 if rng.random() < 0.2 else None)
        promise(0 < found.spacing_m < float("inf") and isfinite(found.start_m), "no spacing")
        promise(bool(np.isfinite(found.elevation_m).all()), "an elevation that is no number")
        return found.elevation_right_m is None, len(found.elevation_m) > 12, found.widest_step_m is None
    return Target("profile csv", [one, two, b"\xef\xbb\xbf" + one.replace(b"\n", b"\r\n")], read,
                  (b"elevation_right_m", b"1e300", b"-1e300", b"1e-300", b",,,", b"0.25,0.1\n"), file=str(file.path))


def erd(folder: Path) -> Target:
    numbers = b"".join(b" %.4f %.4f\n" % (0.1 * (k % 4), 0.2) for k in range(6))
    head = (b"ERDFILEV2.00\n 2, 6, 1, 48, 5, 0.25,\nSHORTNAMLElev.  RElev.  \nUNITSNAMin      in      \n"
            b"XUNITS  ft\nEND\n")
    binary = (head.replace(b" 5,", b" 1,") + np.arange(12, dtype="<f4").tobytes())
    integers = (head.replace(b" 5,", b" 0,").replace(b"END", b"GAIN    0.1 0.1\nOFFSET  1, 2\nEND")
                + np.arange(12, dtype="<i2").tobytes())
    beside = head.replace(b" 5,", b" 2,")
    single = b"ERDFILEV2.00\n1,-1,1,1,5,0.1\nXUNITS m\nUNITSNAMm\n&       x\nEND\n1 2 3\n"
    (folder / "profile.erd.bin").write_bytes(np.arange(12, dtype="<f8").tobytes())
    file = _File(folder, "profile.erd")

    def read(data: bytes, rng: random.Random) -> Hashable:
        if not data.lstrip().startswith(b"ERDFILEV"):
            data = b"ERDFILEV" + data
        found = read_profile(file.hold(data))
        promise(0 < found.spacing_m < float("inf"), "no spacing")
        promise(bool(np.isfinite(found.elevation_m).all()), "an elevation that is no number")
        return found.elevation_right_m is None, len(found.elevation_m) > 3
    tokens = (b"END\n", b"&       ", b"XUNITS  m\n", b"UNITSNAM", b"SHORTNAM", b"LONGNAME", b"GAIN    ", b"OFFSET  ",
              b"ERDFILEV2.00\n", b"-1", b"50000000", b"1000", b"1e-300", b"1_0", b"infinity", b", 2,", b", 0,")
    return Target("erd", [head + numbers, binary, integers, beside, single], read, tokens, file=str(file.path))


def record(folder: Path) -> Target:
    rows = [b"%.3f,%.2f" % (0.01 * k, k % 3) for k in range(12)]
    plain = b"t_s,accel_z_mps2\n" + b"\n".join(rows) + b"\n"
    more = (b"n,accel_x_mps2,t_s,accel_y_mps2,accel_z_mps2\n"
            + b"".join(b"a,1,%.2f,2,%d\n" % (0.01 * k, k) for k in range(9)))
    file = _File(folder, "record.csv")

    def read(data: bytes, rng: random.Random) -> Hashable:
        found = read_record(file.hold(data))
        promise(0 < found.rate_hz < float("inf") and isfinite(found.start_s), "no rate")
        promise(bool(np.isfinite(found.accel_z_mps2).all()), "an acceleration that is no number")
        return found.accel_x_mps2 is None, len(found.accel_z_mps2) > 12
    return Target("record csv", [plain, more], read, (b"t_s", b"accel_z_mps2,", b"1e300", b"1e-300", b"-1e300"),
                  file=str(file.path))


def drive(folder: Path) -> Target:
    rows = b"".join(b"%.2f,%.2f,10,%.1f\n" % (0.01 * k, k % 3, 0.1 * k) for k in range(12))
    plain = b"t_s,accel_z_mps2,speed_mps,distance_m\n" + rows
    placed = b"t_s,accel_z_mps2,speed_mps,distance_m,lat_deg,lon_deg\n" + rows.replace(b"\n", b",46.5,6.6\n")
    file = _File(folder, "drive.csv")
    (folder / "profile.csv").write_text("distance_m,elevation_m\n0,0\n1,0\n2,0\n")

    def read(data: bytes, rng: random.Random) -> Hashable:
        file.hold(data)
        run = read_run(folder)
        for column in (run.time_s, run.accel_z_mps2, run.speed_mps, run.distance_m):
            promise(bool(np.isfinite(column).all()) and len(column) == len(run.time_s), "a number that is none")
        return run.lat_deg is None, len(run.time_s) > 12
    return Target("drive csv", [plain, placed], read, (b"lat_deg", b"lon_deg,", b"1e300", b"1e-300", b"distance_m"),
                  file=str(file.path))


def channels(folder: Path) -> Target:
    rows = b"".join(b"%.2f,%d,%.1f\n" % (0.01 * k, k % 3, 0.1 * (k % 5)) for k in range(12))
    plain = b"t_s,first,second\n" + rows
    text = b"n,second,t_s,first\n" + b"".join(b"a,%d,%.2f,%d\n" % (k % 2, 0.01 * k, k % 4) for k in range(9))
    file = _File(folder, "channels.csv")

    def read(data: bytes, rng: random.Random) -> Hashable:
        only = ("first", "second") if rng.random() < 0.5 else ()
        found = read_channels(file.hold(data), only)
        promise(0 < found.rate_hz < float("inf") and isfinite(found.start_s), "no rate")
        promise(found.samples.shape[1] == len(found.names) and found.names == (only or found.names), "other channels")
        promise(bool(np.isfinite(found.samples).all()), "a sample that is no number")
        reported = {word.strip() for word in re.split(r"[,\n]", data.decode("utf-8-sig", "replace").partition("\n")[0])}
        promise(set(found.names) <= reported, "a channel that the header does not name")
        return len(found.names), len(found.samples) > 12, bool(only)
    return Target("channel csv", [plain, text], read,
                  (b"t_s", b"first,", b"second", b"1e12", b"1e300", b"1e-300", b"t_s,t_s", b",c" * 64, b"0.01,1,1\n"),
                  file=str(file.path))


TARGETS: dict[str, Callable[[Path], Target]] = {
    "nmea": lambda folder: nmea(),
    **{f"pasco_{name}": lambda folder, name=name: pasco(name) for name in shipped_profiles()},
    "bma220": lambda folder: bma220(),
    "dump": dump,
    "segment_log": segment_log,
    "vehicle_yaml": vehicle,
    "config_yaml": config,
    "pasco_profile_yaml": pasco_profile,
    "profile_csv": profile,
    "erd": erd,
    "record_csv": record,
    "drive_csv": drive,
    "channel_csv": channels,
}


class Workshop:
    """A folder of its own for the files of one target, removed at the end."""

    def __enter__(self) -> Path:
        self.folder = folder_for_files()
        return self.folder

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.folder)
