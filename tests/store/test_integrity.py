"""What ``ridelog verify`` finds, and what it says and returns."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.dump import DumpHeader, DumpWriter, Event
from logger.commands.main import main
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.store import integrity as verify_of_store
from logger.store.export.export import export
from logger.store.integrity import SHOWN_PROBLEMS, FileCheck, verify
from logger.store.log.log_writer import SegmentLog
from logger.store.log.recovery import repair
from logger.store.log.row_format import HEADER, format_row
from logger.store.log.sidecar import sealed

RECORD = WindowRecord(
    segment=1, drive=1, t_us=0, utc_us=None, duration_s=0.5, distance_start_m=None, distance_end_m=None, lat_deg=None,
    lon_deg=None, speed_mps=15.0, iri_m_per_km=None, iri_std_m_per_km=None, iri_rms_m_per_km=None, a_w_mps2=0.4,
    mtvv_mps2=0.5, vdv_mps175=0.6, crest_factor=3.0, comfort="a_little_uncomfortable", iri_class="",
    accel_rms_mps2=0.5, samples=50, clipped_samples=0, flags=("time_unset",),
)


def row(segment: int, t_us: int | None = None) -> WindowRecord:
    return replace(RECORD, segment=segment, t_us=segment * 500_000 if t_us is None else t_us)


def lines_of(*records: WindowRecord) -> list[str]:
    return [HEADER, *map(format_row, records)]


def store(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_text("\n".join(lines) + end)
    return path


def log_in(folder: Path, *segments: int, session: int = 1) -> SegmentLog:
    log = SegmentLog(folder, session, {}, 10**6)
    for segment in segments:
        log.append(row(segment))
    return log


def found(path: Path) -> FileCheck:
    check, = verify([path])
    return check


def counts(check: FileCheck) -> tuple[int, int, int, int]:
    return check.records_good, check.records_torn, check.records_corrupt, check.gaps


def a_dump(path: Path, *events: Event) -> Path:
    writer = DumpWriter(path, DumpHeader(None, {"driver": "bma220"}, {"baud": 9600}, "x"))
    for event in events:
        writer.write(event)
    writer.close()
    return path


SAMPLES = [Event(n * 10_000, "bma220", b"\x00\x04\x40") for n in range(50)]


def test_sound_log(tmp_path: Path) -> None:
    log_in(tmp_path, 1, 2, 3).close()
    check = found(tmp_path / "00001-001.csv")
    assert (check.kind, check.state, counts(check), check.ok) == ("log", "finished", (3, 0, 0, 0), True)


def test_a_copy_under_another_name_needs_no_sidecar(tmp_path: Path) -> None:
    assert found(store(tmp_path / "copy.csv", lines_of(row(5), row(6)))).ok


def test_damaged_row_is_one_corrupt_record_and_no_gap(tmp_path: Path) -> None:
    lines = lines_of(row(1), row(2), row(3))
    lines[2] = lines[2].replace("15.000", "15.001")
    check = found(store(tmp_path / "a.csv", lines))
    assert counts(check) == (2, 0, 1, 0)
    assert check.problems == ("line 3: corrupt: expected a row that matches its crc32",)


def test_every_wrong_byte_shows(tmp_path: Path) -> None:
    whole = store(tmp_path / "00001-001.csv", lines_of(row(1), row(2))).read_bytes()
    for place in range(len(whole)):
        damaged = whole[:place] + bytes([whole[place] ^ 0x04]) + whole[place + 1:]
        (tmp_path / "00001-001.csv").write_bytes(damaged)
        assert not found(tmp_path / "00001-001.csv").ok, place


def test_every_cut_of_a_finished_log_shows(tmp_path: Path) -> None:
    log_in(tmp_path, 1, 2, 3).close()
    path = tmp_path / "00001-001.csv"
    whole = path.read_bytes()
    for cut in range(len(whole)):
        path.write_bytes(whole[:cut])
        check = found(path)
        assert not check.ok, cut
        assert check.records_good == sum(line.count(b",") == HEADER.count(",") and line in whole.split(b"\n")
                                         for line in whole[:cut].split(b"\n")[1:])


def test_open_part_with_a_torn_row_is_open_and_not_wrong(tmp_path: Path) -> None:
    log = log_in(tmp_path, 1, 2, 3)
    log.path.write_bytes(log.path.read_bytes()[:-20])
    check = found(log.path)
    assert (check.state, counts(check), check.ok) == ("open", (2, 1, 0, 0), True)


def test_open_part_with_a_damaged_row_is_wrong(tmp_path: Path) -> None:
    lines = lines_of(row(1), row(2))
    path = store(tmp_path / "00001-001.csv.part", [lines[0], lines[1][1:], lines[2]])
    assert (counts(found(path)), found(path).ok) == ((1, 0, 1, 0), False)


@pytest.mark.parametrize(
    ("records", "problem"),
    [
        ([row(1), row(3)], "line 3: gap: expected segment 2, found 3"),
        ([row(2), row(2)], "line 3: gap: expected segment 3, found 2"),
        ([row(2), row(1)], "line 3: gap: expected segment 3, found 1"),
        ([row(1), row(2, t_us=1)], "line 3: gap: expected a time not before 0.500000 s, found 0.000001 s"),
    ],
)
def test_gaps(tmp_path: Path, records: list[WindowRecord], problem: str) -> None:
    check = found(store(tmp_path / "a.csv", lines_of(*records)))
    assert (counts(check), check.problems) == ((2, 0, 0, 1), (problem,))


def test_gap_larger_than_the_damage_shows(tmp_path: Path) -> None:
    assert counts(found(store(tmp_path / "a.csv", [*lines_of(row(1)), "x", format_row(row(3))]))) == (2, 0, 1, 0)
    assert counts(found(store(tmp_path / "a.csv", [*lines_of(row(1)), "x", format_row(row(4))]))) == (2, 0, 1, 1)


def test_gaps_between_the_files_of_a_session(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, {}, 1)
    for segment in (1, 2, 3):
        log.append(row(segment))
    log.close()
    log_in(tmp_path, 1, session=2).close()
    assert all(check.ok for check in verify([tmp_path]))
    (tmp_path / "00001-002.csv").unlink()
    bad, = (check for check in verify([tmp_path]) if not check.ok)
    assert bad.path.name == "00001-003.csv"
    assert bad.problems == ("after 00001-001.csv: gap: expected segment 2, found 3",)


def test_rows_that_the_sidecar_tells_of_are_missed(tmp_path: Path) -> None:
    log_in(tmp_path, 1, 2, 3).close()
    store(tmp_path / "00001-001.csv", lines_of(row(1), row(2)))
    check = found(tmp_path / "00001-001.csv")
    assert counts(check) == (2, 0, 0, 1)
    assert check.problems == ("gap: expected the 3 rows that the sidecar lists, found 2",)


def test_damaged_sidecar_is_wrong(tmp_path: Path) -> None:
    log_in(tmp_path, 1).close()
    (tmp_path / "00001-001.json").write_text("{")
    assert found(tmp_path / "00001-001.csv").problems == ("sidecar: expected a JSON object",)


def test_repaired_log_is_sound(tmp_path: Path) -> None:
    log = log_in(tmp_path, 1, 2, 3)
    log.path.write_bytes(log.path.read_bytes()[:-20])
    repair(tmp_path)
    assert counts(found(tmp_path / "00001-001.csv")) == (2, 0, 0, 0)
    assert found(tmp_path / "00001-001.csv").ok


def test_problems_in_words_are_bounded(tmp_path: Path) -> None:
    check = found(store(tmp_path / "00001-001.csv", ["x"] * 1000))
    assert (check.records_corrupt, len(check.problems)) == (1000, SHOWN_PROBLEMS)


@pytest.mark.parametrize("name", ["a.dump", "a.dump.gz", "renamed"])
def test_sound_dump(tmp_path: Path, name: str) -> None:
    check = found(a_dump(tmp_path / name, *SAMPLES))
    assert (check.kind, counts(check), check.ok) == ("dump", (50, 0, 0, 0), True)


def test_torn_damaged_and_silent_dumps(tmp_path: Path) -> None:
    path = a_dump(tmp_path / "a.dump", *SAMPLES)
    whole = path.read_bytes()
    path.write_bytes(whole[:-3])
    assert (counts(found(path)), found(path).ok) == ((49, 1, 0, 0), False)
    path.write_bytes(whole.replace(b"0.100000 bma220", b"0.100000 bmx220"))
    assert (counts(found(path)), found(path).ok) == ((10, 0, 1, 0), False)
    assert found(path).problems[0].startswith("corrupt: 12: expected a source out of")
    a_dump(tmp_path / "b.dump", *SAMPLES, Event(1_000_000, "nmea", b"$"), Event(1_490_001, "bma220", b"\x00\x04\x40"))
    assert counts(found(tmp_path / "b.dump")) == (52, 0, 0, 1)
    packed = gzip.compress(whole)
    (tmp_path / "c.dump.gz").write_bytes(packed[:-4])
    assert counts(found(tmp_path / "c.dump.gz")) == (50, 1, 0, 0)


@pytest.mark.parametrize("name", ["00001.dump.gz.part", "00001.dump.part"])
def test_a_recording_that_is_being_made_is_open_and_its_torn_end_not_wrong(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    writer = DumpWriter(path, DumpHeader(None, {"driver": "bma220"}, {"baud": 9600}, "x"))
    ends = [0]
    for event in SAMPLES:
        writer.write(event)
        writer.flush(sync=False)
        ends.append(path.stat().st_size)
    whole = path.read_bytes()
    for cut in (*range(0, len(whole), 37), *ends):
        path.write_bytes(whole[:cut])
        check, = verify([tmp_path])
        assert (check.kind, check.state, check.ok, check.records_corrupt, check.gaps) == ("dump", "open", True, 0, 0)
        assert check.records_torn == (cut not in ends)
        assert check.records_good >= sum(end <= cut for end in ends[1:])
    assert counts(check) == (50, 0, 0, 0)
    path.write_bytes(whole[:-40] + bytes(39) + b"\n")
    assert (counts(found(path))[2], found(path).ok) == (1, False)
    writer.close()


def test_a_silent_sensor_is_reported_and_nothing_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The recording is what was written: a cable that came loose in the drive is no damage."""
    path = a_dump(tmp_path / "a.dump", *SAMPLES, Event(5_000_000, "bma220", b"\x00\x04\x40"))
    check = found(path)
    assert (counts(check), check.ok, check.problems) == ((51, 0, 0, 1), True, ())
    words = "gap: nothing from the accelerometer between 0.490000 s and 5.000000 s"
    assert check.notes == (words,)
    assert main(["verify", str(path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "ok: 1 file, 51 good, 0 torn, 0 corrupt, 1 gap", f"{path} (dump): 51 good, 0 torn, 0 corrupt, 1 gap",
        f"    {words}"]
    assert main(["verify", "--json", str(path)]) == 0
    assert json.loads(capsys.readouterr().out)["files"][0]["notes"] == [words]


def test_folders_are_searched_for_logs_and_dumps_only(tmp_path: Path) -> None:
    (tmp_path / "drive").mkdir()
    log_in(tmp_path / "drive", 1).close()
    a_dump(tmp_path / "a.dump.gz", *SAMPLES)
    (tmp_path / "drive" / "profile.csv").write_text("distance_m,elevation_m\n")
    assert [check.path.name for check in verify([tmp_path, tmp_path / "a.dump.gz"])] == ["a.dump.gz", "00001-001.csv"]


@pytest.mark.parametrize("content", ["", "distance_m,elevation_m\n0,0\n", "\x00\x01"])
def test_what_is_neither_log_nor_dump_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(BadInput, match=r"a\.csv:1: expected a segment log or a recorded dump"):
        verify([tmp_path / "a.csv"])
    with pytest.raises(BadInput, match="found none"):
        verify([tmp_path])
    with pytest.raises(BadInput, match="no such file"):
        verify([tmp_path / "b.csv"])


def test_command_tells_a_person(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log_in(tmp_path, 1, 2).close()
    assert main(["verify", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "ok: 1 file, 2 good, 0 torn, 0 corrupt, 0 gaps",
        f"{tmp_path}/00001-001.csv (log): 2 good, 0 torn, 0 corrupt, 0 gaps",
    ]
    store(tmp_path / "00002-001.csv.part", lines_of(row(1), row(3)), end="\n1,torn")
    assert main(["verify", str(tmp_path)]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "WRONG: 2 files, 4 good, 1 torn, 0 corrupt, 1 gap",
        f"{tmp_path}/00002-001.csv.part (log, open): 2 good, 1 torn, 0 corrupt, 1 gap",
        "    line 3: gap: expected segment 2, found 3",
        f"{tmp_path}/00001-001.csv (log): 2 good, 0 torn, 0 corrupt, 0 gaps",
        "Commands skip torn and corrupt records and read all others.",
    ]


@pytest.mark.parametrize("listed", [True, False])
def test_a_name_cannot_forge_a_line_of_the_answer(
        tmp_path: Path, listed: bool, capsys: pytest.CaptureFixture[str]) -> None:
    evil = "\x1b[2J\r\nok: 9 files, 9 good"
    (tmp_path / evil).mkdir()
    store(tmp_path / evil / "00001-001.csv", ["x"])
    if not listed:
        (tmp_path / evil / "00001-001.csv").rename(tmp_path / f"{evil}.dump")
    assert main(["verify", str(tmp_path)]) == 1
    lines = capsys.readouterr().out.split("\n")
    assert all(line.isprintable() for line in lines)
    assert [line for line in lines if line.startswith(("ok", "WRONG"))] == [lines[0]]


def test_command_tells_a_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = store(tmp_path / "a.csv", lines_of(row(1), row(3)))
    assert main(["verify", "--json", str(path)]) == 1
    assert json.loads(capsys.readouterr().out) == {
        "ok": False, "records_good": 2, "records_torn": 0, "records_corrupt": 0, "gaps": 1,
        "files": [{"path": str(path), "kind": "log", "state": "finished", "ok": False, "records_good": 2,
                   "records_torn": 0, "records_corrupt": 0, "gaps": 1,
                   "problems": ["line 3: gap: expected segment 2, found 3"], "notes": []}],
    }


class Meanwhile:
    """Lets the service do something just before the check opens a file of that name, or as soon as it has."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, name: str, act: Callable[[], object], after: bool) -> None:
        self.acts = [act]
        check = verify_of_store._check_log

        def checked(path: Path) -> object:
            if path.name == name and not after:
                self.run()
            found = check(path)
            if path.name == name:
                self.run()
            return found

        monkeypatch.setattr(verify_of_store, "_check_log", checked)

    def run(self) -> None:
        for act in self.acts:
            act()
        self.acts.clear()


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("named", [False, True])
def test_a_part_that_is_finished_meanwhile_is_checked_as_what_it_has_become(
        tmp_path: Path, after: bool, named: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    log = SegmentLog(tmp_path, 1, {}, 1)
    for segment in (1, 2, 3):
        log.append(row(segment))
    place = log.path if named else tmp_path
    Meanwhile(monkeypatch, log.path.name, lambda: (log.append(row(4)), log.append(row(5))), after)
    checks = verify([place])
    expected = ["00001-003.csv"] if named else ["00001-001.csv", "00001-002.csv", "00001-003.csv"]
    assert [(check.path.name, check.state, check.problems) for check in checks] == [
        (name, "finished", ()) for name in expected]


@pytest.mark.parametrize("after", [False, True])
def test_a_log_that_is_removed_meanwhile_to_make_room_is_not_missed(
        tmp_path: Path, after: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    log = SegmentLog(tmp_path, 1, {}, 1)
    for segment in (1, 2, 3):
        log.append(row(segment))
    log.close()

    def make_room() -> None:
        for name in ("00001-001.csv", "00001-001.json"):
            (tmp_path / name).unlink()

    Meanwhile(monkeypatch, "00001-001.csv", make_room, after)
    assert [(check.path.name, check.ok) for check in verify([tmp_path])] == [
        ("00001-002.csv", True), ("00001-003.csv", True)]


def test_a_recording_that_is_finished_meanwhile_is_checked_as_what_it_has_become(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    a_dump(tmp_path / "00001.dump.gz", *SAMPLES).rename(tmp_path / "00001.dump.gz.part")
    log_in(tmp_path, 1).close()
    Meanwhile(monkeypatch, "00001-001.csv",
              lambda: (tmp_path / "00001.dump.gz.part").rename(tmp_path / "00001.dump.gz"), after=True)
    assert [(check.path.name, check.state) for check in verify([tmp_path])] == [
        ("00001-001.csv", "finished"), ("00001.dump.gz", "dump")]


def test_command_refuses_with_status_2(tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        main(["verify", str(tmp_path / "none")])
    assert caught.value.exit_status == 2


def test_a_recording_that_an_export_set_aside_is_checked_as_one(tmp_path: Path) -> None:
    path = a_dump(tmp_path / "00001.dump.gz", Event(0, "nmea", b"$GP"))
    aside = path.rename(path.with_name("00001.dump.gz.0123abcd.old"))
    assert counts(found(aside)) == (1, 0, 0, 0)


@pytest.fixture
def stick(tmp_path: Path) -> Path:
    """A stick with the export of one log; gives the logger's folder on it."""
    (tmp_path / "log").mkdir()
    (tmp_path / "stick").mkdir()
    log_in(tmp_path / "log", 1, 2, 3).close()
    done = export(tmp_path / "log", tmp_path / "stick", report=lambda progress: None)
    assert done.logger is not None
    return tmp_path / "stick" / "ridelog" / done.logger


def test_a_stick_with_its_manifest_is_sound(stick: Path) -> None:
    for place in (stick, stick.parent, stick.parent.parent):
        assert all(check.ok for check in verify([place]))


@pytest.mark.parametrize("left", ["nothing", "link", "folder"])
def test_a_stick_that_cannot_be_checked_is_wrong(stick: Path, left: str, monkeypatch: pytest.MonkeyPatch) -> None:
    listed = stick / "manifest.sha256"
    listed.rename(stick.parent.parent / "moved")
    if left == "link":
        listed.symlink_to(stick.parent.parent / "moved")
    elif left == "folder":
        listed.mkdir()
    monkeypatch.chdir(stick)
    for place in (Path(), stick, stick.parent, stick.parent.parent):
        bad, = (check for check in verify([place]) if not check.ok)
        assert (bad.kind, bad.gaps) == ("manifest", 1)
        assert "expected a list of what was exported" in bad.problems[0]
        assert main(["verify", str(place)]) == 1


def test_a_finished_log_without_its_sidecar_is_wrong(tmp_path: Path) -> None:
    log_in(tmp_path, 1, 2, 3).close()
    (tmp_path / "00001-001.json").unlink()
    assert found(tmp_path / "00001-001.csv").problems == (
        "sidecar: expected 00001-001.json beside it; it is missing",)
    (tmp_path / "00001-001.json").write_text(json.dumps(sealed({"log": {"rows": None}})))
    assert found(tmp_path / "00001-001.csv").problems == ("sidecar: expected the number of rows of a finished log",)


def test_more_rows_than_the_sidecar_tells_of_are_wrong(tmp_path: Path) -> None:
    log_in(tmp_path, 1, 2, 3).close()
    with (tmp_path / "00001-001.csv").open("a") as file:
        file.write(f"{format_row(row(4))}\n")
    assert found(tmp_path / "00001-001.csv").problems == (
        "gap: expected the 3 rows that the sidecar lists, found 4",)


@pytest.mark.parametrize("place", [".", "/", "..", "./"])
@pytest.mark.parametrize("command", ["verify", "report"])
def test_a_folder_without_a_name_of_its_own_is_a_folder(
        tmp_path: Path, place: str, command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "inside").mkdir()
    monkeypatch.chdir(tmp_path / "inside")
    monkeypatch.setattr(Path, "rglob", lambda folder, pattern: iter(()))  # not the whole disk
    with pytest.raises(BadInput, match="expected"):
        main([command, place, *(["--out", "page.html"] if command == "report" else [])])
