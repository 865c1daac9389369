"""A recording is data: no word in a dump, log, sidecar, stick or run, and no name of one, is a path that is read,
written or run. Each reader of recordings meets words that name a trap: files whose opening is seen, and Python."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from drivers.dump import open_dump
from drivers.errors import SettingsError
from drivers.readings import GPS, RecordedWords, folder_name
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model
from logger.store.log.row_format import HEADER, format_row
from logger.store.log.sidecar import sealed

from ..support.command import called
from ..support.drives.logged_rows import rows_of_drive
from ..support.slow import slow

_watched: list[tuple[Path, list[str]]] = []


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    """Python gives a process no way to take a hook off again: this one looks for traps that are there."""
    if event == "open" and _watched and isinstance(arguments[0], str | bytes | os.PathLike):
        for folder, opened in _watched:
            if Path(os.path.realpath(os.fsdecode(arguments[0]))).is_relative_to(folder):
                opened.append(os.fsdecode(arguments[0]))


sys.addaudithook(_hook)


class Trap:
    """A car's file whose effect is Python that leaves a mark, a profile of bytes, a log, a table; and what of it was
    opened."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.mark, self.opened = folder.resolve(), folder.with_name("mark"), list[str]()
        folder.mkdir()
        self.car, self.profile = folder / "car.yaml", folder / "bytes.yaml"
        (folder / "trap.py").write_text(f"open({str(self.mark)!r}, 'w').close()\n")
        car = vehicle_file("rav4-2009").read_text("utf-8").replace("effects: []", "")
        self.car.write_text(car + "\neffects:\n- {name: trap, file: trap.py}\n")
        self.profile.write_text("name: trap\n")
        (folder / "table.csv").write_text("t_s,accel_z_mps2,speed_mps,distance_m\n0,0,1,0\n")

    def words(self) -> list[str]:
        """Ways to name the car's file."""
        return [str(self.car), f"../{self.folder.name}/car.yaml", self.car.as_uri(),
                os.path.relpath(self.car, vehicle_file("rav4-2009").parent).removesuffix(".yaml")]

    def check(self) -> None:
        assert self.opened == []
        assert not self.mark.exists()


@pytest.fixture
def trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Trap]:
    one = Trap(tmp_path / "trap")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    _watched.append((one.folder, one.opened))
    yield one
    _watched.clear()


@pytest.fixture
def dump_of(short_dump: Path, tmp_path: Path) -> Callable[..., Path]:
    """A recorded drive whose header says something else."""
    def make(name: str = "drive.dump", accelerometer: dict[str, Any] | None = None, **said: Any) -> Path:
        with open_dump(short_dump) as reader:
            header = asdict(reader.header) | said
            events = list(reader)
        if accelerometer:
            header["accelerometer"] = accelerometer
            events = [one._replace(source=accelerometer["driver"]) if one.source != GPS else one for one in events]
        lines = [f"{one.t_us / 1e6:.6f} {one.source} {one.data.hex()}" for one in events]
        path = tmp_path / "here" / name
        path.write_text("\n".join([f"# ridelog-dump 1 {json.dumps(header)}", *lines, ""]), "ascii")
        return path
    return make


def test_the_trap_is_one(trap: Trap) -> None:
    with pytest.raises(Exception, match=r"trap\.py"):
        read_model(trap.car)
    assert trap.mark.exists()
    assert str(trap.car) in trap.opened


READERS: dict[str, tuple[str, ...]] = {"replay": ("--out", "out"), "extract": ("--out", "out"), "verify": (),
                                       "hil": ("--nmea-port", "/dev/null", "--accelerometer-port", "/dev/null")}


@pytest.mark.parametrize("verb", ["replay", "verify", *slow("extract", "hil")])
def test_a_dump_that_names_files_of_this_machine(verb: str, trap: Trap, dump_of: Callable[..., Path]) -> None:
    for word in trap.words():
        done = called(verb, dump_of(vehicle=word), *READERS[verb])
        trap.check()
        if verb in ("replay", "extract"):
            assert done.returncode == 2
            assert done.stderr.count("\n") == 1 and "expected --vehicle FILE.yaml or one of" in done.stderr
    for said in ({"driver": "pasco", "profile": str(trap.profile)},
                 {"driver": "bma220", "vertical_axis": str(trap.car)},
                 {"driver": "bma220", "noise": {"noise_mps2": str(trap.car)}},
                 {"driver": "pasco", "calibrated": str(trap.car)}, {"driver": "iio", "scale_mps2": str(trap.car)}):
        done = called(verb, dump_of(accelerometer=said, gps={"baud": str(trap.car), "latency_s": str(trap.car)}),
                      *READERS[verb])
        trap.check()
        assert done.returncode == 2 or verb == "verify", done


def test_the_car_that_a_person_names_is_read(trap: Trap, dump_of: Callable[..., Path], tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(vehicle_file("rav4-2009").read_text("utf-8"))
    done = called("extract", dump_of(vehicle=str(trap.car)), "--out", "out", "--vehicle", mine)
    assert done.returncode == 0, done.stderr
    trap.check()


LOG_READERS: dict[str, tuple[str, ...]] = {
    "report": ("--out", "page.html"), "convert": ("--to", "rows.csv"), "sections": ("--length", "100m"),
    "passes": (), "verify": (), "fleet ingest": ("--to", "fleet"), "export": ()}


@pytest.mark.parametrize("verb", LOG_READERS)
def test_logs_whose_words_and_links_name_files_of_this_machine(verb: str, trap: Trap) -> None:
    logs = Path("stick")
    logs.mkdir()
    rows = "\n".join([HEADER, *map(format_row, rows_of_drive(60)), ""])
    for number in (1, 2):
        (logs / f"0000{number}-001.csv").write_text(rows, "ascii")
    word = str(trap.car)
    (logs / "00001-001.json").write_text(json.dumps(sealed({
        "ridelog_version": word, "sensor": {"driver": word, "profile": str(trap.profile)}, "receiver": word,
        "vehicle": {"name": f"../../{trap.folder.name}/x", "effects": [{"name": "x", "file": word}]},
        "settings": {"vehicle": word, "log": {"directory": str(trap.folder)}}, "replayed_from": word,
        "log": {"session": word, "rows": 60}})))
    (trap.folder / "other.json").write_text(json.dumps(sealed({"vehicle": {"name": "other"}})))
    (trap.folder / "00003-001.csv").write_text(rows, "ascii")
    (logs / "00002-001.json").symlink_to(trap.folder / "other.json")
    (logs / "00003-001.csv").symlink_to(trap.folder / "00003-001.csv")
    (logs / "more").symlink_to(trap.folder)
    for learned in ("receiver-delay", "sensor-noise"):
        (logs / learned).write_text(json.dumps({"delay_s": word, "noise_mps2": word, "of": word}))
    places = ("--from", logs, "--to", "out") if verb == "export" else (logs,)
    if verb == "export":
        Path("out").mkdir()
    trap.opened.clear()
    done = called(*verb.split(), *places, *LOG_READERS[verb], *(("--car", word) if "fleet" in verb else ()))
    trap.check()
    assert done.returncode == (verb in ("verify", "export")), done.stderr  # these two say which file is a link
    assert not [path for path in trap.folder.parent.iterdir() if path.name not in ("trap", "here")]


RUN_READERS = (("compare", "--vehicle", "rav4-2009"), ("estimate", "--vehicle", "rav4-2009"), ("comfort",))


@pytest.mark.slow
@pytest.mark.parametrize("words", RUN_READERS, ids=lambda words: words[0])
def test_a_run_that_names_files_of_this_machine(words: tuple[str, ...], trap: Trap, dump_of: Callable[..., Path]
                                                ) -> None:
    assert called("extract", dump_of(), "--out", ".").returncode == 0
    drive = Path("drive")
    (drive / "run.yaml").write_text(json.dumps({"source": str(trap.folder / "table.csv"),
                                                "places": {"by": "road", "vehicle": str(trap.car)}}))
    (drive / "profile.csv").write_text("distance_m,elevation_m\n" + "".join(f"{at},0\n" for at in range(900)))
    called(words[0], drive / "drive.csv" if words[0] == "comfort" else drive, *words[1:])
    trap.check()


def test_a_folder_of_a_phone_s_files_with_links(trap: Trap) -> None:
    Path("ride").mkdir()
    Path("ride/Accelerometer.csv").symlink_to(trap.folder / "table.csv")
    assert called("extract", "--csv", "ride", "--out", "out").returncode == 2
    trap.check()


@pytest.mark.parametrize("name", ["...dump", "..dump.gz", ".dump", "....dump.gz"])
def test_a_dump_s_name_leads_to_no_other_folder(name: str, trap: Trap, dump_of: Callable[..., Path]) -> None:
    Path("out").mkdir()
    before = sorted(Path().iterdir())
    done = called("extract", dump_of(name), "--out", "out/runs")
    new = [path for path in sorted(Path().iterdir()) if path not in before and path.name != name]
    assert new == []
    assert not list(Path("out").glob("*.csv"))
    if name.removesuffix(".gz").removesuffix(".dump") in ("", ".", ".."):
        assert done.returncode == 2
        assert "rename it" in done.stderr


@pytest.mark.slow
def test_a_run_is_not_written_through_a_link(trap: Trap, dump_of: Callable[..., Path]) -> None:
    Path("out").mkdir()
    Path("out/drive").symlink_to(trap.folder)
    before = sorted(trap.folder.iterdir())
    done = called("extract", dump_of(), "--out", "out")
    assert done.returncode == 2
    assert "found a symbolic link" in done.stderr
    assert sorted(trap.folder.iterdir()) == before


def test_a_fleet_s_manifest_names_its_own_files_alone(trap: Trap) -> None:
    logs = Path("logs")
    logs.mkdir()
    (logs / "00001-001.csv").write_text("\n".join([HEADER, *map(format_row, rows_of_drive(60)), ""]), "ascii")
    assert called("fleet", "ingest", logs, "--to", "fleet", "--car", "a").returncode == 0
    manifest = Path("fleet/manifest.json")
    good = json.loads(manifest.read_text())
    for key in ("ledger", "path"):
        for word in (f"../../{trap.folder.name}/table.csv", str(trap.folder / "table.csv")):
            content = json.loads(json.dumps(good))
            place = content["commits"][0] if key == "ledger" else content["commits"][0]["files"][0]
            place[key] = word
            manifest.write_text(json.dumps(content))
            assert called("fleet", "summarise", "fleet").returncode == 2
            assert called("fleet", "ingest", logs, "--to", "fleet", "--car", "a").returncode == 2
            trap.check()


def test_what_a_recording_says_comes_back_as_a_number_or_a_registered_name_or_not_at_all() -> None:
    said = RecordedWords({"n": 2, "real": 0.5, "nan": float("nan"), "yes": True, "word": "../x", "list": [1]})
    assert (said.whole("n", 1), said.number("real", 1.0, 0.0, 1.0), said.flag("yes")) == (2, 0.5, True)
    assert (said.name("other", "a", ("a", "b")), said.whole("other", 7)) == ("a", 7)
    for key in ("nan", "yes", "word", "list"):
        for ask in (lambda key: said.whole(key, 1), lambda key: said.number(key, 1.0, 0.0, 1.0),
                    lambda key: said.name(key, "a", ("a", "b")), said.group):
            with pytest.raises(SettingsError, match=f"for '{key}', found"):
                ask(key)
    for word in ("", ".", "..", "a/b", "/a", "a\0b"):
        with pytest.raises(SettingsError, match="rename"):
            folder_name(word)
    assert folder_name("..a") == "..a"
