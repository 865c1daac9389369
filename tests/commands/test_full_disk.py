"""Every command that writes, on a disk that refuses any one of its changes, or all from one on: what was there stays
byte for byte, nothing is left beside it, one line says why, and the status is 2."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import ridelog
from logger.commands.main import VERBS, command
from logger.store.formats.record_file import TIME, VERTICAL
from logger.store.log.row_format import HEADER, format_row

from ..support.command import called
from ..support.drives.logged_rows import rows_of_drive
from ..support.faults.refused_writes import content, grown_older, trials

Made = Callable[[Path], object]


def road(folder: Path) -> None:
    called("road", "generate", "--class", "B", "--length", "150", "--out", folder / "road.csv")


def run(folder: Path) -> None:
    road_m = ridelog.random_road(iso_class="C", length_m=180.0, seed=2)
    ridelog.write_run(folder / "run", ridelog.simulate("rav4-2009", road_m, speed_mps=12.0, noise_mps2=0.05))


def shaken(folder: Path) -> None:
    values = np.random.default_rng(1).standard_normal(3000)
    lines = [f"{number / 100:.2f},{value:.5f}" for number, value in enumerate(values)]
    (folder / "shaken.csv").write_text("\n".join([f"{TIME},{VERTICAL}", *lines]))


def logs(folder: Path) -> None:
    for session in (1, 2):
        rows = [HEADER, *map(format_row, rows_of_drive(60, number=session))]
        (folder / f"logs{session}").mkdir()
        (folder / f"logs{session}" / f"0000{session}-001.csv").write_text("\n".join(rows) + "\n", "ascii")


def dataset(folder: Path) -> None:
    """Of the first log, so that the second is new."""
    logs(folder)
    called("fleet", "ingest", folder / "logs1", "--to", folder / "town", "--car", "a")


@dataclass(frozen=True)
class Writer:
    """A command line that writes, in a folder with what it takes.

    asks      options, and nothing else, that ask for what it writes
    is_older  what a run before has written is there, changed; False: what ``needs`` made is all
    """

    needs: Made
    words: str
    is_older: bool = True


LAB = "--vehicle rav4-2009 run"
SLOW = pytest.mark.slow
WRITERS = {
    "road generate --out": Writer(road, "road generate --class C --length 150 --out road.csv"),
    "road classify --out": Writer(road, "road classify road.csv --out a.html"),
    "simulate --out": Writer(road, "simulate --vehicle rav4-2009 --profile road.csv --speed 15 --out drive.csv "
                             "--out profile.csv --out a.html"),
    "iri --out": Writer(road, "iri road.csv --out a.html --out b.html --out a.png"),
    "comfort --out": Writer(shaken, "comfort shaken.csv --out a.html"),
    "modes --out": Writer(shaken, "modes shaken.csv --method ssi --out a.html"),
    "estimate --out --profile-out": Writer(run, "estimate run --vehicle rav4-2009 --out a.csv --out a.html "
                                           "--profile-out found.csv"),
    "calibrate --out": Writer(road, "calibrate --vehicle rav4-2009 --out speeds.csv"),
    "identify --out": Writer(run, f"identify {LAB} --free sprung_mass_kg --out car.yaml --out a.html"),
    "compare --out": Writer(run, f"compare {LAB} --out a.html"),
    "add-effect --out": Writer(run, f"add-effect sensor_offset {LAB} --out car.yaml"),
    "report --out": Writer(logs, "report logs1 --out a.html"),
    "sections --out": Writer(logs, "sections logs1 --out a.csv --out a.geojson --out a.gpkg --out a.html"),
    "passes --out --visit": Writer(logs, "passes logs1 logs2 --above 0.1 --out a.parquet --out a.html --visit a.gpx"),
    "convert --to": Writer(logs, "convert logs1 --to a.kml"),
    "fleet ingest --to": Writer(dataset, "fleet ingest logs2 --to town --car a", is_older=False),
    "fleet summarise --out": Writer(dataset, "fleet summarise town --out a.csv"),
    "fleet report --out": Writer(dataset, "fleet report town --out page"),
    "fixed-point --out": Writer(road, "fixed-point --out firmware"),
    "study --out": Writer(road, "study table-4-3 --quick --out a.html"),
    "extract --out": Writer(lambda folder: called("demo", "--field", "--unpack", "--out", folder / "field"),
                            "extract field/first.dump.gz --profile field/line.csv --out runs"),
    "plan --out": Writer(run, f"plan {LAB} --out a.html"),
    "diagnose --out": Writer(run, f"diagnose {LAB} --out a.html"),
    "learn --out": Writer(run, f"learn {LAB} --out law.py --out a.html"),
}
OTHERS = {
    "demo --out": "logs of sessions that are new, and files that ship with ridelog: never written over another's",
    "replay --out": "logs of sessions that are new", "capture --out": "a dump that must be new",
    "lab --out": "one file after the other, each as write_text does it", "export --to --note": "the stick's own rules",
    "learn-car --out": "a vehicle's file and a page, each as write_text does it",
    "install --root": "steps, each as replace_bytes does it", "uninstall --root": "removes",
}
"""Options that ask for what is written, of commands that are judged beside their own tests, and why."""
WRITE = {"--out", "--profile-out", "--visit", "--to", "--note", "--root"}
READ = {"--config", "--from", "--base", "--route", "--roads", "--smoothness", "--profile", "--location", "--csv",
        "--compare", "--excitation", "--log", "--unmounted", "--led", "--effect-file"}


def parsers() -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """All of them, with the words of their commands."""
    for verb in VERBS:
        parser, _ = command(verb)
        below = [one for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
        yield from [(f"{verb} {name}", one) for name, one in below[0].choices.items()] if below else [(verb, parser)]


def test_every_option_that_names_a_file_to_write_is_tried() -> None:
    found = {}
    for words, parser in parsers():
        files = {name for one in parser._actions if one.type is Path for name in one.option_strings}
        assert files <= WRITE | READ, f"{words} {files - WRITE - READ}: an option to write with, or to read?"
        if files & WRITE:
            found[words] = files & WRITE
    assert found == {words.partition(" --")[0]: set(words.split()) & WRITE for words in (*WRITERS, *OTHERS)}
    for name, writer in WRITERS.items():
        assert set(name.split()) & WRITE <= set(writer.words.split())


QUICK = ("convert --to",)


RELEASE = ("plan --out", "diagnose --out", "learn --out", "fleet report --out", "calibrate --out",
           "compare --out", "study --out", "extract --out", "report --out", "fleet summarise --out", "comfort --out")
"""The longest, and those that write one page or table by the same writer as others (``logger.files``)."""


@pytest.mark.parametrize("name", [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.release if name in RELEASE else SLOW)
    for name in WRITERS])
def test_what_was_there_stays(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, writer = tmp_path / "place", WRITERS[name]
    place.mkdir()
    writer.needs(place)
    monkeypatch.chdir(place)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    if writer.is_older:
        before = content(place)
        good = called(*writer.words.split())
        assert good.returncode == 0, good.stderr
        grown_older(place, before)
    refused = trials(place, writer.words.split())
    assert {"create", "write", "sync", "close", "rename"} <= set(refused)


def test_a_device_that_is_full_is_named(tmp_path: Path) -> None:
    """By the kernel's own full disk; what leads to it stays a link."""
    (tmp_path / "ridelog_wk.h").symlink_to("/dev/full")
    for words, file in ((["road", "generate", "--class", "B", "--out", "/dev/full"], "/dev/full"),
                        (["fixed-point", "--out", tmp_path], tmp_path / "ridelog_wk.h")):
        refused = called(*words)
        assert (refused.returncode, refused.stderr) == (2, f"ridelog: {file}: No space left on device\n")
    assert (tmp_path / "ridelog_wk.h").readlink() == Path("/dev/full")
    assert [path.name for path in tmp_path.iterdir()] == ["ridelog_wk.h"]
