"""Log files under cuts: of the process and of the power, before, inside and after every step; of the repair too."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivers.disk import FileSystem
from logger.files import STATE_BYTES
from logger.records import WindowRecord
from logger.store.integrity import verify
from logger.store.log import row_format, sidecar
from logger.store.log.log_name import COUNTER_NAME, next_session
from logger.store.log.log_writer import SegmentLog
from logger.store.log.recovery import repair
from logger.store.log.row_format import HEADER, format_row, parse_row, read_log
from logger.store.log.sidecar import ClockMap, read_sidecar, sealed

from ...support.slow import slow

SIDECAR = {"ridelog_version": "0.1.0", "sensor": {"driver": "bma220", "verified": True}}
OFFSET_US = 1_783_160_000_000_000
NEVER = 10**9


def row(segment: int, utc: bool = True) -> WindowRecord:
    """A row; those of segments 1 to 9 are equally long."""
    t_us = 20_000_000 + segment * 500_000
    return WindowRecord(
        segment=segment, drive=1, t_us=t_us, utc_us=t_us + OFFSET_US if utc else None, duration_s=0.5,
        distance_start_m=100 + 7.62 * segment, distance_end_m=107.62 + 7.62 * segment, lat_deg=50.0, lon_deg=14.0,
        speed_mps=15.24, iri_m_per_km=2.0, iri_std_m_per_km=0.5, iri_rms_m_per_km=2.0, a_w_mps2=0.4, mtvv_mps2=0.5,
        vdv_mps175=0.6, crest_factor=3.0, comfort="a_little_uncomfortable", iri_class="A", accel_rms_mps2=0.5,
        samples=50, clipped_samples=0, flags=() if utc else ("slow", "time_unset"),
    )


def filled(record: WindowRecord) -> WindowRecord:
    return replace(record, utc_us=record.t_us + OFFSET_US, flags=tuple(f for f in record.flags if f != "time_unset"))


def kept(record: WindowRecord) -> WindowRecord:
    """What a log keeps of a record."""
    return parse_row(format_row(record))


ROW_BYTES = len(format_row(row(1))) + 1


class Cut(BaseException):
    """The process is gone."""


class CutFiles(FileSystem):
    """A disk that stops at the n-th change; a write that is cut leaves its first half.

    With ``power`` it then forgets, as a disk may, what was not synced: data back to the last sync of the file,
    names back to the last sync of the folder.
    """

    def __init__(self, cut_at: int = NEVER, power: bool = False) -> None:
        self.changes = 0
        self._cut_at = cut_at
        self._power = power
        self._open: dict[int, Path] = {}
        self._unsynced: dict[Path, int] = {}
        self._undo: list[Callable[[], None]] = []

    def _step(self, half: Callable[[], None] = lambda: None) -> None:
        self.changes += 1
        if self.changes <= self._cut_at:
            return
        half()
        for descriptor in self._open:
            super().close(descriptor)
        self._open.clear()
        if self._power:
            for path, size in self._unsynced.items():
                path.write_bytes(path.read_bytes()[:size])
            for undo in reversed(self._undo):
                undo()
        raise Cut

    def _restorer(self, path: Path) -> Callable[[], None]:
        before = path.read_bytes() if path.exists() else None
        return lambda: path.unlink(missing_ok=True) if before is None else path.write_bytes(before) and None

    def create(self, path: Path) -> int:
        self._step()
        self._undo.append(self._restorer(path))
        descriptor = super().create(path)
        self._open[descriptor] = path
        self._unsynced[path] = 0
        return descriptor

    def write(self, descriptor: int, data: bytes) -> None:
        self._step(lambda: FileSystem.write(self, descriptor, data[:len(data) // 2]))
        path = self._open[descriptor]
        self._unsynced.setdefault(path, path.stat().st_size)
        super().write(descriptor, data)

    def sync(self, descriptor: int) -> None:
        self._step()
        self._unsynced.pop(self._open[descriptor], None)

    def close(self, descriptor: int) -> None:
        if descriptor in self._open:  # after a cut everything is closed already
            self._step()
            del self._open[descriptor]
            super().close(descriptor)

    def rename(self, source: Path, target: Path) -> None:
        self._step()
        self._undo += [self._restorer(target), self._restorer(source)]
        super().rename(source, target)
        if source in self._unsynced:
            self._unsynced[target] = self._unsynced.pop(source)

    def remove(self, path: Path) -> None:
        self._step()
        self._undo.append(self._restorer(path))
        self._unsynced.pop(path, None)
        super().remove(path)

    def sync_directory(self, directory: Path) -> None:
        self._step()
        self._undo.clear()


class Drive:
    """A session with everything that can happen to its files; counts what it was promised."""

    def __init__(self) -> None:
        self.written = 0
        self.safe = 0
        self.clock_safe = False

    def run(self, folder: Path, files: FileSystem) -> None:
        log = SegmentLog(folder, 7, SIDECAR, 3 * ROW_BYTES, files)
        for segment in (1, 2):
            self._append(log, row(segment, utc=False))
        log.rotate()  # a drive ends before UTC is known
        self.safe = self.written
        self._append(log, row(3, utc=False))
        log.sync()
        self.safe = self.written
        log.set_clock_map(ClockMap(OFFSET_US))
        self.clock_safe = True
        for segment in (4, 5, 6, 7, 8):  # one of them rotates by size
            self._append(log, row(segment))
        log.sync()
        self.safe = self.written
        log.rotate()
        log.rotate()
        log.close()

    def _append(self, log: SegmentLog, record: WindowRecord) -> None:
        log.append(record)
        self.written += 1


def texts(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in sorted(folder.iterdir())}


def rows_of(folder: Path) -> list[WindowRecord]:
    return [record for path in sorted(folder.glob("*.csv")) for record in read_log(path).records]


def check_repaired(folder: Path, drive: Drive, power: bool) -> None:
    """Only finished files are left; they hold the rows from the first on, once each, as many as were promised."""
    logs = sorted(folder.glob("*.csv"))
    assert {path.name for path in folder.iterdir()} == {f"{log.stem}.{end}" for log in logs for end in ("csv", "json")}
    records = rows_of(folder)
    assert [record.segment for record in records] == list(range(1, len(records) + 1))
    assert len(records) >= drive.safe
    if not power:
        assert len(records) in (drive.written, drive.written + 1)
    for record in records:
        expected = row(record.segment, utc=record.segment > 3)
        if drive.clock_safe or record.utc_us is not None:
            expected = filled(expected)
        assert record == kept(expected)
    for log in logs:
        sidecar = read_sidecar(log)
        assert sidecar is not None
        assert sidecar["sensor"] == SIDECAR["sensor"]
        assert (sidecar["log"]["state"], sidecar["log"]["rows"]) == ("finished", len(read_log(log).records))
        if drive.clock_safe:
            assert sidecar["log"]["rows_without_utc"] == 0
    if logs:
        assert all(check.ok for check in verify([folder]))


def changes_of(action: Callable[[FileSystem], Any]) -> int:
    files = CutFiles()
    action(files)
    return files.changes


def test_names_and_contents(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 42, SIDECAR, 10 * ROW_BYTES)
    assert log.path == tmp_path / "00042-001.csv.part"
    for segment in (1, 2):
        log.append(row(segment))
    assert sorted(texts(tmp_path)) == ["00042-001.csv.part", "00042-001.json"]
    assert json.loads(texts(tmp_path)["00042-001.json"])["log"]["state"] == "open"
    log.close()
    log.close()
    assert sorted(texts(tmp_path)) == ["00042-001.csv", "00042-001.json"]
    assert texts(tmp_path)["00042-001.csv"] == f"{HEADER}\n{format_row(row(1))}\n{format_row(row(2))}\n"
    assert read_sidecar(tmp_path / "00042-001.csv") == SIDECAR | {
        "clock_map": None,
        "log": {"session": 42, "part": 1, "state": "finished", "rows": 2, "rows_without_utc": 0,
                "damaged_lines_left_out": 0, "torn_tail_repaired": False},
    }


def test_a_row_is_in_the_file_at_once(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 10 * ROW_BYTES)
    log.append(row(1))
    assert log.path.read_text() == f"{HEADER}\n{format_row(row(1))}\n"
    log.close()


def test_rotation_by_size_fills_each_part_as_far_as_it_goes(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 3 * ROW_BYTES)
    for segment in range(1, 9):
        log.append(row(segment))
    log.close()
    parts = [[record.segment for record in read_log(path).records] for path in sorted(tmp_path.glob("*.csv"))]
    assert parts == [[1, 2, 3], [4, 5, 6], [7, 8]]


def test_a_row_longer_than_a_part_gets_one_of_its_own(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 1)
    log.append(row(1))
    log.append(row(2))
    log.close()
    assert [len(read_log(path).records) for path in sorted(tmp_path.glob("*.csv"))] == [1, 1]


def test_an_empty_part_is_removed(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 100)
    log.rotate()
    assert log.path.name == "00001-001.csv.part"
    log.close()
    assert texts(tmp_path) == {}


def test_a_session_is_not_logged_twice(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 100)
    with pytest.raises(FileExistsError, match="logged before"):
        SegmentLog(tmp_path, 1, SIDECAR, 100)
    log.append(row(1))
    log.close()
    with pytest.raises(FileExistsError, match="logged before"):
        SegmentLog(tmp_path, 1, SIDECAR, 100)


def test_utc_reaches_back_also_into_finished_files(tmp_path: Path) -> None:
    drive = Drive()
    drive.run(tmp_path, FileSystem())
    check_repaired(tmp_path, drive, power=False)
    assert all(record.utc_us == record.t_us + OFFSET_US for record in rows_of(tmp_path))
    assert "time_unset" not in "".join(texts(tmp_path).values())
    sidecars = [read_sidecar(path) for path in sorted(tmp_path.glob("*.csv"))]
    assert [sidecar and sidecar["clock_map"] for sidecar in sidecars] == [{"offset_us": OFFSET_US}] * len(sidecars)


def test_without_a_fix_rows_stay_without_utc(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 10 * ROW_BYTES)
    log.append(row(1, utc=False))
    log.close()
    assert rows_of(tmp_path) == [kept(row(1, utc=False))]
    sidecar = read_sidecar(tmp_path / "00001-001.csv")
    assert sidecar is not None
    assert sidecar["log"]["rows_without_utc"] == 1


def test_the_last_clock_map_fills_and_small_corrections_wait_for_the_end(tmp_path: Path) -> None:
    files = CutFiles()
    log = SegmentLog(tmp_path, 1, SIDECAR, 10 * ROW_BYTES, files)
    log.append(row(1, utc=False))
    log.set_clock_map(ClockMap(OFFSET_US + 50_000))
    changes = files.changes
    log.set_clock_map(ClockMap(OFFSET_US))
    assert files.changes == changes
    log.set_clock_map(ClockMap(OFFSET_US - 10**9))
    assert files.changes > changes
    log.set_clock_map(ClockMap(OFFSET_US))
    log.close()
    assert rows_of(tmp_path) == [kept(filled(row(1, utc=False)))]


@pytest.mark.parametrize("power", [*slow(False), True])
def test_cut_at_every_change_then_repair(tmp_path: Path, power: bool) -> None:
    total = changes_of(lambda files: Drive().run(_fresh(tmp_path, "whole"), files))
    assert total > 80
    for cut_at in range(total):
        folder = _fresh(tmp_path, f"{cut_at}")
        drive = Drive()
        with pytest.raises(Cut):
            drive.run(folder, CutFiles(cut_at, power))
        assert not any(read_log(path).damaged_lines for path in folder.glob("*.csv"))
        repair(folder, CutFiles())
        check_repaired(folder, drive, power)
        before = texts(folder)
        assert repair(folder, CutFiles()) == []
        assert texts(folder) == before


@pytest.mark.parametrize(("power", "each"), [(True, 36), *slow((True, 3), (False, 3))])
def test_cut_of_the_repair_at_every_change(tmp_path: Path, power: bool, each: int) -> None:
    total = changes_of(lambda files: Drive().run(_fresh(tmp_path, "whole"), files))
    for cut_at in range(0, total, each):
        again = 0
        while True:
            folder = _fresh(tmp_path, f"{cut_at}-{again}")
            drive = Drive()
            with pytest.raises(Cut):
                drive.run(folder, CutFiles(cut_at, power))
            try:
                repair(folder, CutFiles(again, power))
                break
            except Cut:
                repair(folder, CutFiles())
                check_repaired(folder, drive, power)
                again += 1


def test_part_cut_at_every_byte_keeps_its_whole_rows(tmp_path: Path) -> None:
    rows = [format_row(row(segment)) for segment in (1, 2, 3)]
    whole = "".join(f"{line}\n" for line in [HEADER, *rows]).encode()
    for cut in range(len(whole) + 1):
        folder = _fresh(tmp_path, f"{cut}")
        (folder / "00001-001.csv.part").write_bytes(whole[:cut])
        found, = repair(folder, CutFiles())
        complete = sum(len(HEADER) + 1 + n * ROW_BYTES - 1 <= cut for n in (1, 2, 3))
        assert found.tally.rows == complete
        if complete:
            assert texts(folder)["00001-001.csv"] == "".join(f"{line}\n" for line in [HEADER, *rows[:complete]])
        else:
            assert texts(folder) == {}


def test_damaged_rows_are_left_out_and_counted(tmp_path: Path) -> None:
    rows = [format_row(row(segment)) for segment in (1, 2, 3)]
    lines = [HEADER, rows[0], rows[1].replace("15.240", "15.241"), rows[2], rows[2][:30]]
    (tmp_path / "00001-001.csv.part").write_text("\n".join(lines))
    found, = repair(tmp_path)
    assert (found.tally.rows, found.tally.damaged_lines, found.tally.torn_tail) == (2, 1, True)
    assert found.finished == tmp_path / "00001-001.csv"
    assert texts(tmp_path)["00001-001.csv"] == "".join(f"{line}\n" for line in [HEADER, rows[0], rows[2]])
    sidecar = read_sidecar(tmp_path / "00001-001.csv")
    assert sidecar is not None
    assert (sidecar["log"]["damaged_lines_left_out"], sidecar["log"]["torn_tail_repaired"]) == (1, True)


def test_damaged_sidecar_costs_no_row(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 10 * ROW_BYTES)
    log.append(row(1))
    for damage in (b"", b"{", b"[]", b"\xff\xfe"):
        (tmp_path / "00001-001.json").write_bytes(damage)
        folder = _fresh(tmp_path, damage.hex() or "empty")
        for path in (log.path, tmp_path / "00001-001.json"):
            (folder / path.name).write_bytes(path.read_bytes())
        repair(folder)
        assert rows_of(folder) == [kept(row(1))]
    log.close()


def test_better_of_part_and_finished_file_is_kept(tmp_path: Path) -> None:
    rows = [format_row(row(segment)) for segment in (1, 2)]
    whole = "".join(f"{line}\n" for line in [HEADER, *rows])
    for damaged in ("csv", "csv.part"):
        folder = _fresh(tmp_path, damaged)
        for end in ("csv", "csv.part"):
            (folder / f"00001-001.{end}").write_text(whole.replace("15.240", "15.241") if end == damaged else whole)
        repair(folder)
        assert texts(folder)["00001-001.csv"] == whole
        assert not (folder / "00001-001.csv.part").exists()


def test_a_part_goes_only_after_the_finished_name_is_on_the_disk(tmp_path: Path) -> None:
    """A repair that was killed after its rename leaves both, and the rename may not have reached the disk."""
    class Told(FileSystem):
        def __init__(self) -> None:
            self.done: list[str] = []

        def sync_directory(self, directory: Path) -> None:
            self.done.append("synced")
            super().sync_directory(directory)

        def remove(self, path: Path) -> None:
            self.done.append(path.name)
            super().remove(path)

    for end in ("csv", "csv.part"):
        (tmp_path / f"00001-001.{end}").write_text(f"{HEADER}\n{format_row(row(1))}\n")
    files = Told()
    repair(tmp_path, files)
    assert files.done[:2] == ["synced", "00001-001.csv.part"]


def test_repair_leaves_other_files_alone(tmp_path: Path) -> None:
    for name in ("notes.tmp", "notes.csv.part", "00001.dump.gz"):
        (tmp_path / name).write_text("mine")
    for name in ("00001-001.csv.tmp", "00001-001.json.tmp", f"{COUNTER_NAME}.tmp"):
        (tmp_path / name).write_text("left over")
    assert repair(tmp_path) == []
    assert sorted(texts(tmp_path)) == ["00001.dump.gz", "notes.csv.part", "notes.tmp"]


def test_sessions_count_on(tmp_path: Path) -> None:
    assert [next_session(tmp_path) for _ in range(3)] == [1, 2, 3]
    (tmp_path / "00041-002.csv").write_text("")
    assert next_session(tmp_path) == 42
    (tmp_path / "00041-002.csv").unlink()
    assert next_session(tmp_path) == 43


@pytest.mark.parametrize("damage", [None, b"", b"7", b"\xff\xff", b"999 00000000\n", b"-5 00000000", b"\x00" * 12])
def test_a_lost_counter_is_made_up_from_the_names(tmp_path: Path, damage: bytes | None) -> None:
    for _ in range(3):
        next_session(tmp_path)
    if damage is None:
        (tmp_path / COUNTER_NAME).unlink()
    else:
        (tmp_path / COUNTER_NAME).write_bytes(damage)
    for name in ("00012-001.csv", "00013-001.json", "00015.dump.gz", "99-001.csv", "drive.csv", "123456-001.csv"):
        (tmp_path / name).write_text("")
    assert next_session(tmp_path) == 123457


@pytest.mark.parametrize("power", [False, True])
def test_no_session_number_is_given_twice_whatever_is_cut(tmp_path: Path, power: bool) -> None:
    given = {next_session(tmp_path)}
    for cut_at in range(changes_of(lambda files: given.add(next_session(tmp_path, files)))):
        with pytest.raises(Cut):
            next_session(tmp_path, CutFiles(cut_at, power))
        number = next_session(tmp_path)
        assert number not in given
        given.add(number)


def _fresh(parent: Path, name: str) -> Path:
    folder = parent / f"folder-{name}"
    folder.mkdir()
    return folder


@pytest.mark.parametrize(("content", "reason"), [
    (b"[" * 100_000, "nesting"),
    (b'{"a":' * 100_000, "nesting"),
    (b"{}" + b" " * STATE_BYTES, "at most"),
    (b"\xff", "JSON object"),
    (b"{", "JSON object"),
    (b"[]", "JSON object"),
])
def test_a_hostile_sidecar_is_refused_and_costs_no_row(tmp_path: Path, content: bytes, reason: str) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 10**6)
    log.append(row(1))
    (tmp_path / "00001-001.json").write_bytes(content)
    with pytest.raises(ValueError, match=reason):
        read_sidecar(log.path)
    repair(tmp_path)
    assert len(read_log(tmp_path / "00001-001.csv").records) == 1
    (tmp_path / "00001-001.json").write_bytes(content)
    (problem,) = verify([tmp_path])[0].problems
    assert problem.startswith("sidecar: expected")
    assert reason in problem


@pytest.mark.parametrize("offset_us", [10**400, 10**30, -(10**18), 1.5, True, "1"])
def test_a_clock_that_cannot_be_is_none(tmp_path: Path, offset_us: object) -> None:
    log = SegmentLog(tmp_path, 1, SIDECAR, 10**6)
    log.append(row(1, utc=False))
    (tmp_path / "00001-001.json").write_text(json.dumps(sealed({"clock_map": {"offset_us": offset_us}})))
    repair(tmp_path)
    assert read_log(tmp_path / "00001-001.csv").records == (kept(row(1, utc=False)),)


def test_a_sidecar_of_the_largest_size_is_read(tmp_path: Path) -> None:
    text = json.dumps(sealed({})).encode()
    (tmp_path / "00001-001.json").write_bytes(text + b" " * (STATE_BYTES - len(text)))
    assert read_sidecar(tmp_path / "00001-001.csv") == {}


def test_a_repair_reads_each_of_many_parts_a_few_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = 120
    for part in range(1, count + 1):
        (tmp_path / f"00001-{part:03d}.csv.part").write_text(f"{HEADER}\n")
    (tmp_path / f"00001-{count + 1:03d}.csv.part").write_text(f"{HEADER}\n{format_row(row(1))}\n")
    read = []
    monkeypatch.setattr(sidecar, "scan", lambda file: read.append(file.name) or row_format.scan(file))
    repair(tmp_path, CutFiles())
    assert sorted(texts(tmp_path)) == [f"00001-{count + 1:03d}.csv", f"00001-{count + 1:03d}.json"]
    assert len(read) <= 3 * (count + 1)


def test_parts_beyond_999_are_in_order(tmp_path: Path) -> None:
    """Names of four digits sort before those of three: the row that stands twice is kept where it was written last."""
    (tmp_path / "00001-999.csv.part").write_text(f"{HEADER}\n{format_row(row(1))}\n{format_row(row(2))}\n")
    (tmp_path / "00001-1000.csv.part").write_text(f"{HEADER}\n{format_row(row(2))}\n{format_row(row(3))}\n")
    repair(tmp_path, CutFiles())
    kept = [read_log(tmp_path / f"00001-{part}.csv").records for part in (999, 1000)]
    assert [[record.segment for record in records] for records in kept] == [[1], [2, 3]]
