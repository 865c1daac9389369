"""Hardware in the loop: sending and comparing step by step, and the whole with processes on pseudo-terminals."""

from __future__ import annotations

import errno
import json
import os
import select
import signal
import subprocess
import threading
import time
import tty
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.accelerometers.bma220 import Bma220Decoder
from drivers.accelerometers.pasco import PascoConfig
from drivers.disk import FileSystem
from drivers.dump import DumpHeader, Event, open_dump
from drivers.errors import NotPresent
from drivers.wire_profiles import LineLayout, load_profile
from logger.commands import hil as command
from logger.commands import main
from logger.errors import BadInput
from logger.estimation.receiver_delay import CarriedDelay
from logger.records import WindowRecord
from logger.service.config import AccelerometerConfig, Config, load_config
from logger.service.hil.log_comparison import LoggedSession, compare, read_sessions
from logger.service.hil.playback import Sent, expected_rows, send, wired
from logger.service.learning import DELAY
from logger.service.pipeline import longest_wait_us
from logger.shipped import vehicle_file
from logger.store.log import row_format
from logger.store.log.sidecar import Tally, store_sidecar
from logger.units import STANDARD_GRAVITY_MPS2

from ..support.drives.replay import rows_of

PATIENCE_S = 120.0
PIECE_S = 25
BUSY_LOAD = 2 * (os.cpu_count() or 1)  # processes that want to run
BRIDGE_S = Config().gps.bridge_s
BMA220 = DumpHeader(None, {"driver": "bma220", "range_g": 4, "vertical_axis": "-z"}, {"baud": 9600}, "rav4-2009")


class Port:
    """A port that notes when it was given what, and may take some time [us] for it."""

    def __init__(self, clock: list[int], takes_us: int = 0) -> None:
        self.clock, self.takes_us, self.written = clock, takes_us, list[tuple[int, bytes]]()

    def read(self, size: int, timeout_s: float) -> bytes:
        return b""

    def write(self, data: bytes) -> int:
        self.written.append((self.clock[0], data))
        self.clock[0] += self.takes_us
        return len(data)

    def close(self) -> None:
        """Nothing to let go of."""


def play(events: list[Event], takes_us: int, oversleeps_us: int) -> tuple[Sent, Port, Port]:
    clock = [77_000_000]
    pasco, nmea = Port(clock), Port(clock, takes_us)

    def sleep(seconds: float) -> None:
        clock[0] += round(seconds * 1e6) + oversleeps_us

    sent = send(events, {"pasco": pasco, "nmea": nmea}, lambda: clock[0], sleep, lambda _: None)
    return sent, pasco, nmea


def test_each_chunk_goes_out_at_its_time() -> None:
    events = [Event(5_000_000, "pasco", b"a"), Event(5_010_000, "nmea", b"$GP"), Event(5_500_000, "pasco", b"bc")]
    sent, pasco, nmea = play(events, takes_us=0, oversleeps_us=0)
    assert pasco.written == [(77_000_000, b"a"), (77_500_000, b"bc")]
    assert nmea.written == [(77_010_000, b"$GP")]
    assert sent == Sent(0.5, {"pasco": 3, "nmea": 3}, (0.0, 0.0, 0.0))


def test_a_port_that_holds_up_delays_one_chunk_and_not_the_next() -> None:
    events = [Event(0, "nmea", b"$"), Event(10_000, "pasco", b"a"), Event(100_000, "pasco", b"b")]
    sent, pasco, _ = play(events, takes_us=30_000, oversleeps_us=200)
    assert [t_us for t_us, _ in pasco.written] == [77_030_000, 77_100_200]
    assert sent.late_ms[2] == 20.0
    assert sent.late_ms[0] == 0.2


@pytest.mark.parametrize("number", [errno.EIO, errno.EPIPE, errno.ENOSPC, errno.ETIMEDOUT])
def test_a_port_that_goes_is_named_and_is_no_closed_terminal(number: int) -> None:
    class Gone:
        def write(self, data: bytes) -> int:
            raise OSError(number, f"/dev/x has gone: {os.strerror(number)}")

    ports: Any = {"pasco": Gone(), "nmea": Gone()}
    with pytest.raises(NotPresent, match=f"the nmea port has gone: /dev/x has gone: {os.strerror(number)}"):
        send([Event(0, "nmea", b"$")], ports, lambda: 0, lambda _: None, lambda _: None)


def test_nothing_to_send() -> None:
    assert play([], 0, 0)[0].duration_s == 0.0


def test_every_reading_of_the_chip_says_the_same_as_a_line() -> None:
    readings = [bytes((byte, (7 * byte + 3) % 256, 255 - byte)) for byte in range(256)]
    recording = wired(BMA220, [Event(10_000 * n, "bma220", data) for n, data in enumerate(readings)], None, "x")
    lines = list(recording.events)
    assert recording.bridged
    assert recording.header.accelerometer == {"driver": "pasco", "profile": "lines", "vertical_axis": "-z"}
    assert [(line.t_us, line.source) for line in lines] == [(10_000 * n, "pasco") for n in range(256)]
    profile = load_profile("lines")
    assert isinstance(profile.layout, LineLayout)
    assert profile.layout.unit_mps2 == STANDARD_GRAVITY_MPS2
    decoder = Bma220Decoder(4)
    for data in readings:
        decoder.feed(0, data)
    sent_g = np.array([[float(text) for text in line.data.decode("ascii").rstrip("\n").split(",")] for line in lines])
    np.testing.assert_allclose(sent_g * STANDARD_GRAVITY_MPS2, decoder.take().accel_mps2, atol=1e-9)


def test_other_bytes_go_as_they_are_and_only_the_first_seconds_if_asked() -> None:
    header = replace(BMA220, accelerometer={"driver": "pasco", "profile": "ps2119"})
    events = [Event(3_000_000 + 400_000 * n, source, bytes((n,))) for n, source in enumerate(["nmea", "pasco"] * 4)]
    assert list(wired(header, events, None, "x").events) == events
    assert list(wired(header, events, 1.2, "x").events) == events[:3]


def test_a_chip_read_more_often_is_refused() -> None:
    header = replace(BMA220, accelerometer=BMA220.accelerometer | {"oversample": 4})
    with pytest.raises(BadInput, match=r"^drive\.dump:1: expected .* oversample 4"):
        wired(header, [], None, "drive.dump:1")


@pytest.mark.parametrize(("sensor", "said"), [
    (AccelerometerConfig(), "driver pasco"),
    (AccelerometerConfig(driver="pasco", sections={"pasco": PascoConfig(profile="lines_mps2")}), "lines"),
])
def test_a_service_that_would_not_hear_it_is_refused(sensor: AccelerometerConfig, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        expected_rows(wired(BMA220, [], None, "x"), Config(accelerometer=sensor), "x")


@pytest.fixture(scope="module")
def rows(short_dump: Path) -> list[WindowRecord]:
    """What is expected of the short drive, all with UTC."""
    serial = Config(vehicle=vehicle_file("rav4-2009"), accelerometer=AccelerometerConfig(driver="pasco"))
    with open_dump(short_dump) as reader:
        return expected_rows(wired(reader.header, reader, None, "x"), serial, "x")


@pytest.mark.slow
def test_what_is_expected_is_what_a_replay_of_the_lines_gives(short_dump: Path, rows: list[WindowRecord]) -> None:
    with open_dump(short_dump) as reader:
        recording = wired(reader.header, reader, None, "x")
        replayed = rows_of(recording.header, recording.events).records
    assert [replace(row, utc_us=None) for row in rows] == [replace(row, utc_us=None) for row in replayed]
    assert all(row.utc_us is not None for row in rows)


def ended_us(row: WindowRecord) -> int:
    return row.t_us + round(row.duration_s * 1e6)


def logged(rows: list[WindowRecord], change: Callable[[int, WindowRecord], WindowRecord | None] = lambda _, row: row,
           shift_us: int = 9_876_543, is_open: bool = False) -> LoggedSession:
    """The rows as a service on a clock of its own would have them, changed (None: left out)."""
    kept = [changed for number, row in enumerate(rows) if (changed := change(number, row)) is not None]
    return LoggedSession(4, tuple(replace(row, t_us=row.t_us + shift_us) for row in kept), is_open)


def test_the_same_rows_agree_on_any_clock(rows: list[WindowRecord]) -> None:
    found = compare(rows, [LoggedSession(3, (), False), logged(rows)], BRIDGE_S)
    assert found.ok
    assert (found.session, found.matched, found.expected) == (4, len(rows), len(rows))
    assert found.clock_shift_s == 9.876543
    assert not found.missing + found.surplus
    assert all(difference.largest == 0.0 and difference.compared > 40 for difference in found.differences)


def test_a_missing_row_and_one_too_many(rows: list[WindowRecord]) -> None:
    found = compare(rows, [logged(rows, lambda n, row: None if n == 30 else row)], BRIDGE_S)
    assert found.missing == (rows[30].segment,)
    assert not found.ok
    found = compare(rows[:30] + rows[31:], [logged(rows)], BRIDGE_S)
    assert found.surplus == (rows[30].segment,)
    assert not found.ok


def test_the_last_rows_are_waited_for_only_while_the_log_is_open(rows: list[WindowRecord]) -> None:
    late = [row for row in rows if ended_us(row) >= ended_us(rows[-1]) - longest_wait_us(BRIDGE_S)]
    assert 5 < len(late) < len(rows) - 10
    for count, is_open, pending in [(len(late), True, len(late)), (len(late), False, 0), (len(late) + 1, True, None)]:
        held = len(rows) - count
        log = logged(rows, lambda n, row, held=held: row if n < held else None, is_open=is_open)
        found = compare(rows, [log], BRIDGE_S)
        assert found.ok == bool(pending)
        assert found.pending == (len(late) if pending is None else pending)


@pytest.mark.parametrize(("quantity", "attribute", "by"), [
    ("start", "t_us", 40_000), ("place", "lat_deg", 2e-5), ("place", "lon_deg", -2e-5), ("speed", "speed_mps", 0.2),
    ("a_w", "a_w_mps2", 0.5), ("IRI", "iri_m_per_km", 40.0), ("IRI", "iri_m_per_km", None), ("distance",
                                                                                             "distance_start_m", 0.9)])
def test_one_row_may_lie_outside_and_two_of_these_not(rows: list[WindowRecord], quantity: str, attribute: str,
                                                      by: float | None) -> None:
    known = [n for n, row in enumerate(rows) if getattr(row, attribute) is not None and row.iri_m_per_km is not None]

    def wrong(count: int) -> LoggedSession:
        return logged(rows, lambda n, row: row if n not in known[5:5 + count] else replace(
            row, **{attribute: None if by is None else getattr(row, attribute) + by}))

    one, two = compare(rows, [wrong(1)], BRIDGE_S), compare(rows, [wrong(2)], BRIDGE_S)
    assert one.ok
    assert not two.ok
    assert [each.outside for each in two.differences if each.tolerance.quantity == quantity] == [2]


COLUMNS = {column.attribute for column in row_format.COLUMNS} - {"flags", "comfort", "iri_class"}


@pytest.mark.parametrize("attribute", sorted(COLUMNS))
def test_every_number_of_the_log_is_compared(rows: list[WindowRecord], attribute: str) -> None:
    def wrong(number: int, row: WindowRecord) -> WindowRecord:
        value = getattr(row, attribute)
        return row if value is None or number % 10 else replace(row, **{attribute: 3 * value + 1_000_000})

    assert not compare(rows, [logged(rows, wrong)], BRIDGE_S).ok


@pytest.mark.parametrize(("attribute", "word"), [("comfort", "extremely_uncomfortable"), ("iri_class", "H")])
def test_words_that_are_not_those_of_the_rows_own_figure_are_seen(
        rows: list[WindowRecord], attribute: str, word: str) -> None:
    found = compare(rows, [logged(rows, lambda _, row: replace(row, **{attribute: word}))], BRIDGE_S)
    assert not found.ok
    assert len([each for each in found.differences if each.outside]) == 1


def test_drives_are_counted_from_where_the_service_was(rows: list[WindowRecord]) -> None:
    later = logged(rows, lambda _, row: replace(row, drive=row.drive + 8, segment=row.segment + 500))
    assert compare(rows, [later], BRIDGE_S).ok
    assert not compare(rows, [logged(rows, lambda _, row: replace(row, drive=9))], BRIDGE_S).ok


def test_a_row_that_stands_twice_is_seen(rows: list[WindowRecord], tmp_path: Path) -> None:
    texts = [row_format.format_row(row) for row in rows]
    log = tmp_path / "00004-001.csv"
    for repeated, agrees in (([], True), (texts[30:31], False)):
        log.write_text("".join(f"{line}\n" for line in [row_format.HEADER, *texts[:31], *repeated, *texts[31:]]))
        assert compare(rows, read_sessions(tmp_path), BRIDGE_S).ok is agrees
    # In another finished file; but not in an open one, which a disk that failed has left behind.
    log.write_text("".join(f"{line}\n" for line in [row_format.HEADER, *texts[:31]]))
    for name, repeated_rows in (("00004-002.csv", 1), ("00004-002.csv.part", 0)):
        (tmp_path / name).write_text("".join(f"{line}\n" for line in [row_format.HEADER, *texts[30:]]))
        assert read_sessions(tmp_path)[0].repeated == repeated_rows
        (tmp_path / name).unlink()


def test_other_flags_count_but_not_that_utc_was_still_unknown(rows: list[WindowRecord]) -> None:
    unset = logged(rows, lambda n, row: replace(row, flags=(*row.flags, "time_unset")) if n < 5 else row)
    assert compare(rows, [unset], BRIDGE_S).flags_differ == 0
    gaps = logged(rows, lambda n, row: replace(row, flags=(*row.flags, "gap")) if n in (20, 21) else row)
    assert compare(rows, [gaps], BRIDGE_S).flags_differ == 2
    assert not compare(rows, [gaps], BRIDGE_S).ok


def test_rows_written_before_utc_was_known_have_none_only_while_the_log_is_open(rows: list[WindowRecord]) -> None:
    def undated(first: int, last: int, is_open: bool) -> LoggedSession:
        return logged(rows, lambda n, row: replace(row, utc_us=None, flags=(*row.flags, "time_unset"))
                      if first <= n < last else row, is_open=is_open)

    assert compare(rows, [undated(0, 5, is_open=True)], BRIDGE_S).ok
    assert not compare(rows, [undated(0, 5, is_open=False)], BRIDGE_S).ok
    assert not compare(rows, [undated(10, 15, is_open=True)], BRIDGE_S).ok


def test_of_a_drive_sent_twice_the_second_time_counts(rows: list[WindowRecord]) -> None:
    first = logged(rows).rows
    travelled_m = max(row.distance_end_m or 0.0 for row in rows)
    second = [replace(row, segment=row.segment + len(rows), t_us=row.t_us + 90_000_000,
                      distance_start_m=row.distance_start_m + travelled_m if row.distance_start_m is not None else None)
              for row in rows]
    found = compare(rows, [LoggedSession(1, (*first, *second), True)], BRIDGE_S)
    assert not found.ok
    assert found.clock_shift_s == 90.0
    assert found.moved_before_m == pytest.approx(travelled_m)


def test_a_log_of_another_day_holds_none_of_it(rows: list[WindowRecord]) -> None:
    other = logged(rows, lambda _, row: replace(row, utc_us=(row.utc_us or 0) + 86_400_000_000))
    for sessions in ([], [other]):
        found = compare(rows, sessions, BRIDGE_S)
        assert not found.ok
        assert found.session is None
        assert "TX is on RX" in command.PlayedDrive(False, None, found).text()


@pytest.mark.slow
def test_what_the_session_knew_of_the_receiver_counts_and_not_what_was_learned_since(
        short_dump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("ridelog.yaml").write_text("accelerometer: {driver: pasco}\n")
    knew = CarriedDelay(0.40, 0.02, 3)
    with open_dump(short_dump) as reader:
        rows = expected_rows(wired(reader.header, reader, None, "x"), load_config(Path("ridelog.yaml")), "x", knew)
    log = tmp_path / "00004-001.csv"
    log.write_text("".join(f"{line}\n" for line in [row_format.HEADER, *map(row_format.format_row, rows)]))
    learned = tmp_path / DELAY.file_name
    learned.write_text(json.dumps(DELAY.fields(CarriedDelay(0.05, 0.02, 9))))
    compared = ["hil", str(short_dump), "--log", ".", "--config", "ridelog.yaml"]
    store_sidecar(FileSystem(), log, {"receiver": DELAY.fields(knew)}, "finished", Tally(len(rows)), None)
    assert main.main(compared) == 0
    log.with_suffix(".json").unlink()  # nothing but what was learned since is left
    assert main.main(compared) == 1
    learned.write_text(json.dumps(DELAY.fields(knew)))
    assert main.main(compared) == 0


def test_late_bytes_fail_the_run_and_say_so() -> None:
    late = command.PlayedDrive(False, Sent(1.0, {"nmea": 3}, (1.0, 51.0, 60.0)), None)
    assert not late.ok
    assert "TOO LATE" in late.text()
    assert command.PlayedDrive(False, Sent(1.0, {"nmea": 3}, (1.0, 49.0, 600.0)), None).ok


@pytest.mark.parametrize(("arguments", "said"), [
    ((), "two ports"), (("--nmea-port", "/dev/x"), "or neither"), (("--log", "none"), "none: expected the folder"),
    (("--log", ".", "--seconds", "0"), "more than 0"), (("--log", "."), "driver pasco"),
    (("--log", ".", "--nmea-port", "/dev/x", "--accelerometer-port", "/dev/y"), "ridelog run"),
])
def test_wrong_use_is_refused(short_dump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                              arguments: tuple[str, ...], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ridelog.yaml").write_text("vehicle: rav4-2009\n")
    with pytest.raises(BadInput, match=said):
        main.main(["hil", str(short_dump), "--config", "ridelog.yaml", *arguments])


class NullModem:
    """Two serial ports wired to each other, as pseudo-terminals with names; bytes go from the first to the second."""

    def __init__(self, near: Path, far: Path) -> None:
        self._ends = [os.openpty() for _ in range(2)]
        for (_, end), name in zip(self._ends, (near, far), strict=True):
            tty.setraw(end)
            name.symlink_to(os.ttyname(end))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        (source, _), (sink, _) = self._ends
        while not self._stop.is_set():
            if select.select([source], [], [], 0.2)[0]:
                os.write(sink, os.read(source, 4096))

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        for end in self._ends:
            for descriptor in end:
                os.close(descriptor)


@pytest.fixture
def wires(tmp_path: Path) -> Iterator[None]:
    modems = [NullModem(tmp_path / f"{name}-out", tmp_path / name) for name in ("gps", "accelerometer")]
    yield
    for modem in modems:
        modem.close()


def wait_until(holds: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(0.05)


@pytest.mark.slow
def test_a_drive_through_serial_ports_and_the_running_service(
    ridelog: Path, wires: None, short_dump: Path, tmp_path: Path
) -> None:
    config, status = tmp_path / "ridelog.yaml", tmp_path / "status.json"
    config.write_text(
        f"accelerometer: {{driver: pasco, pasco: {{port: {tmp_path / 'accelerometer'}, profile: lines}}}}\n"
        f"gps: {{port: {tmp_path / 'gps'}}}\nlog: {{directory: {tmp_path / 'log'}}}\nstatus_file: {status}\n"
    )
    compared = [ridelog, "hil", short_dump, "--log", tmp_path / "log", "--config", config, "--seconds", str(PIECE_S)]
    ports = ["--nmea-port", tmp_path / "gps-out", "--accelerometer-port", tmp_path / "accelerometer-out"]
    with (tmp_path / "stderr.txt").open("wb") as errors, subprocess.Popen(
        [ridelog, "run", "--config", config], stderr=errors
    ) as service:
        try:
            wait_until(lambda: (tmp_path / "stderr.txt").read_text().count(": open") == 2)
            played = subprocess.run([*compared, *ports, "--json"], capture_output=True, text=True, timeout=PATIENCE_S)
        finally:
            service.send_signal(signal.SIGTERM)
    found = json.loads(played.stdout)
    if played.returncode and os.getloadavg()[0] > BUSY_LOAD:
        pytest.skip("other work keeps this machine from playing and logging in real time")
    assert played.returncode == 0, (found, (tmp_path / "stderr.txt").read_text())
    assert found["bridged_to_lines"] is True
    assert found["sent"]["duration_s"] == pytest.approx(PIECE_S, abs=0.1)
    assert found["agreement"]["matched"] >= 8
    assert found["agreement"]["pending"] > 0
    # The service has been stopped: now every row has to be there.
    later = subprocess.run(compared, capture_output=True, text=True, timeout=PATIENCE_S)
    assert later.returncode == 0, later.stdout
    assert "0 missing, 0 not written yet, 0 not expected" in later.stdout
    assert "AGREES" in later.stdout
    # A row that is lost is noticed.
    (log,) = (tmp_path / "log").glob("*.csv")
    lines = log.read_text().splitlines(keepends=True)
    log.write_text("".join(lines[:10] + lines[11:]))
    assert len(read_sessions(tmp_path / "log")[0].rows) == len(lines) - 2
    assert subprocess.run(compared, capture_output=True, timeout=PATIENCE_S).returncode == 1
