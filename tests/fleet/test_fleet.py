"""From logs to figures: nothing lost, nothing twice, and the truth within its errors."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from pathlib import Path

import duckdb
import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.fleet import summary
from logger.fleet.dataset import Dataset

from ..support.drives.fleet_town import drives, ingest, town, write_logs
from ..support.slow import slow


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("town")
    write_logs(drives(town(4, 200.0, 3), 24), folder)
    return folder


def rows_of(dataset: Path) -> list[tuple[int, ...]]:
    """The rows that the manifest names, read by DuckDB alone."""
    files = [str(path) for path in Dataset(dataset).files()]
    return duckdb.sql(f"select car, session, segment, crc32 from read_parquet({files}, hive_partitioning=false) "
                      "order by all").fetchall()


def said(capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    return json.loads(capsys.readouterr().out.splitlines()[-1])


def test_rows_come_in_once(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dataset = tmp_path / "town"
    ingest(logs, dataset)
    first = rows_of(dataset)
    assert len(first) == len(set(first)) == 24 * 26
    capsys.readouterr()
    ingest(logs, dataset, "--json")
    assert rows_of(dataset) == first
    assert said(capsys)["known_logs"] == len(list((logs / "car002").glob("*.csv")))
    assert not [path for path in dataset.rglob("*") if "car00" in path.name]


def test_a_log_that_has_grown_adds_what_is_new(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = sorted((logs / "car000").glob("*.csv"))[0]
    lines = log.read_text("ascii").splitlines(keepends=True)
    part, dataset = tmp_path / "a" / "00001-001.csv", tmp_path / "town"
    part.parent.mkdir()
    for count in (11, len(lines), len(lines)):
        part.write_text("".join(lines[:count]), "ascii")
        assert main(["fleet", "ingest", str(part.parent), "--to", str(dataset), "--car", "a", "--json"]) == 0
    outputs = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(one["added"], one["repeated"], one["known_logs"]) for one in outputs] == [
        (10, 0, 0), (len(lines) - 11, 10, 0), (0, 0, 1)]


def test_damaged_rows_are_refused_and_counted(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = sorted((logs / "car001").glob("*.csv"))[0]
    lines = source.read_bytes().splitlines(keepends=True)
    lines[5] = lines[5].replace(b",12.000,", b",13.000,", 1)
    lines[9] = b"\xff\x00" * 40 + b"\n"
    log = tmp_path / "00001-001.csv"
    log.write_bytes(b"".join(lines)[:-30])
    assert main(["fleet", "ingest", str(log), "--to", str(tmp_path / "town"), "--car", "a", "--json"]) == 0
    found = said(capsys)
    assert (found["added"], found["damaged_lines"]) == (len(lines) - 1 - 3, 3)
    assert {row[2] for row in rows_of(tmp_path / "town")} == set(range(1, len(lines))) - {5, 9, len(lines) - 1}


def test_starts_and_ends_of_drives_are_cut(logs: Path, tmp_path: Path) -> None:
    ingest(logs, tmp_path / "town", "--trim-m", "50")
    whole, cut = 26 * 7.62, 50
    kept = [at for at in range(26) if at * 7.62 >= cut and whole - (at + 1) * 7.62 >= cut]
    assert sorted({row[2] for row in rows_of(tmp_path / "town")}) == [at + 1 for at in kept]
    with pytest.raises(BadInput, match=r"--trim-m 20: expected 50 m, as at the dataset's first ingest"):
        main(["fleet", "ingest", str(logs), "--to", str(tmp_path / "town"), "--car", "x", "--trim-m", "20"])


KILLED = """
import json, os, shutil, signal, sys
from pathlib import Path
import numpy, pyarrow.csv
from pyarrow import parquet
from logger.commands.main import main
import logger.api.fleet, logger.fleet.ingest as ingest

logs, out, every = sys.argv[1:]
ingest.ingest_sessions.__kwdefaults__["batch_rows"] = 60
left = [10**9]

def counted(real):
    def step(*args, **kwargs):
        left[0] -= 1
        if left[0] < 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return real(*args, **kwargs)
    return step

os.fsync, Path.replace, Path.unlink = counted(os.fsync), counted(Path.replace), counted(Path.unlink)
parquet.write_table = counted(parquet.write_table)

def in_a_process(steps, dataset):
    child = os.fork()
    if not child:
        left[0] = steps
        sys.stdout = open(os.devnull, "w")
        main(["fleet", "ingest", logs, "--to", dataset, "--car", "a"])
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

ends = []
for point in range(0, 10_000, int(every)):
    killed = f"{out}/{point}-killed"
    ends.append(in_a_process(point, killed))
    again = f"{out}/{point}-again"
    if os.path.exists(killed):
        shutil.copytree(killed, again)
        if os.path.exists(killed + ".key"):
            shutil.copy(killed + ".key", again + ".key")
    in_a_process(point // 2, again)
    assert in_a_process(10**9, again) == 0
    if ends[-1] == 0:
        break
print(json.dumps(ends))
"""
"""Ingests in commits of a few rows, killed before the n-th step on the disk; again, killed sooner; and whole."""


@pytest.mark.parametrize("every", [pytest.param(8, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.release)])
def test_an_ingest_that_is_killed_anywhere_loses_no_row_and_takes_none_twice(every: int, logs: Path,
                                                                             tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    assert main(["fleet", "ingest", str(logs / "car000"), "--to", str(whole), "--car", "a"]) == 0
    expected = [row[1:] for row in rows_of(whole)]
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    done = subprocess.run([sys.executable, str(script), str(logs / "car000"), str(tmp_path), str(every)],
                          capture_output=True, text=True, check=True)
    ends = json.loads(done.stdout)
    assert set(ends[:-1]) == {-signal.SIGKILL} and ends[-1] == 0
    assert len(ends) > 50 / every
    for point in range(0, every * len(ends), every):
        killed, again = tmp_path / f"{point}-killed", tmp_path / f"{point}-again"
        if killed.exists() and Dataset(killed).manifest.rows:
            there = [row[1:] for row in rows_of(killed)]
            assert len(there) == len(set(there)) and set(there) <= set(expected)
        assert [row[1:] for row in rows_of(again)] == expected
        assert {path.name for path in again.rglob("*.parquet")} == {
            Path(one.path).name for commit in Dataset(again).manifest.commits for one in commit.files} | {
            Path(commit.ledger).name for commit in Dataset(again).manifest.commits}


@pytest.mark.slow
def test_means_biases_and_changes_are_found_within_their_errors(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                                ) -> None:
    place = town(6, 300.0, 5, seed=3)
    found = drives(place, 400, seed=4)
    write_logs(found, tmp_path / "logs")
    ingest(tmp_path / "logs", tmp_path / "town")
    capsys.readouterr()
    assert main(["fleet", "summarise", str(tmp_path / "town"), "--json"]) == 0
    figures = said(capsys)
    names = {f"car{car:03d}": car for car in range(5)}
    biases = {names[one["car"]]: one for one in figures["cars"]}
    errors = np.array([(np.log1p(biases[car]["bias"]) - place.log_gain[car]) / biases[car]["bias_std"]
                       for car in range(5)])
    assert np.abs(errors).max() < 3
    assert max(biases[car]["bias_std"] for car in range(5)) < 0.01
    assert figures["growth_per_year"] == pytest.approx(place.decay.mean(), abs=0.02)


@pytest.mark.parametrize(("arguments", "complaint"), [
    (["summarise", "nothing"], r"nothing: expected a dataset that 'ridelog fleet ingest' has made"),
    (["ingest", "LOGS", "--to", "TOWN"], r"expected the car's name in the sidecar beside it, or --car NAME"),
    (["summarise", "TOWN", "--by", "route"], r"--by route: expected a dataset made with --roads"),
    (["summarise", "TOWN", "--engine", "oracle"], r"--engine oracle: expected duckdb, spark://HOST:PORT"),
    (["summarise", "TOWN", "--since", "spring"], r"--since spring: expected a date such as 2026-04-30"),
    (["summarise", "TOWN", "--since", "2030-01-01"], r"expected at least one pass with an IRI in that time"),
])
def test_wrong_use_is_one_line(arguments: list[str], complaint: str, logs: Path, tmp_path: Path) -> None:
    ingest(logs, tmp_path / "town")
    places = {"LOGS": str(logs), "TOWN": str(tmp_path / "town")}
    with pytest.raises(BadInput, match=complaint):
        main(["fleet", *(places.get(one, one) for one in arguments)])


@pytest.mark.parametrize("most", [1, *slow(8)])
def test_biases_of_few_roads_with_many_passes_are_estimated(most: int, logs: Path, tmp_path: Path,
                                                            capsys: pytest.CaptureFixture[str],
                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    """One road in so many may be none of the few that there are."""
    seen: list[int] = []
    real = summary.car_biases
    monkeypatch.setattr(summary, "MOST_PASSES", most)
    monkeypatch.setattr(summary, "car_biases", lambda passes, cars: (seen.append(int(passes.count.sum())),
                                                                     real(passes, cars))[1])
    ingest(logs, tmp_path / "town")
    assert main(["fleet", "summarise", str(tmp_path / "town"), "--json"]) == 0
    assert seen[0] >= most / 4


def test_cars_have_their_names_and_for_others_pseudonyms_which_the_owner_can_look_up(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset, names = tmp_path / "town", {one.name for one in logs.iterdir()}
    assert main(["fleet", "ingest", str(logs), "--to", str(dataset), "--car-folders"]) == 0
    assert main(["fleet", "ingest", str(logs), "--to", str(dataset), "--car", "=van"]) == 0
    capsys.readouterr()

    def cars(*options: str) -> set[str]:
        assert main(["fleet", "summarise", str(dataset), "--json", *options]) == 0
        return {one["car"] for one in said(capsys)["cars"]}  # type: ignore

    assert cars() == names | {"'=van"}  # a spreadsheet opens the table of names
    hidden = cars("--public", "1")
    assert not hidden & names
    rows = list(csv.reader((tmp_path / "town.cars.csv").read_text("utf-8").splitlines()))
    assert rows[0] == ["car", "name"]
    assert {name for car, name in rows[1:] if car in hidden} == names | {"'=van"}
    assert not [path for path in dataset.rglob("*") if path.is_file() and b"car001" in path.read_bytes()]
    (tmp_path / "town.cars.csv").unlink()
    assert cars() == hidden


@pytest.mark.parametrize(("inside", "named"), [
    ("", "depot"), ("", "depot/van 7"), ("", "depot/van 7/00001-001.csv"), ("2026-05", "depot"),
    ("ridelog/0a1b", "depot"), ("ridelog/0a1b", "depot/van 7")])
def test_a_car_is_named_after_its_folder_however_its_logs_lie_in_it(inside: str, named: str, tmp_path: Path) -> None:
    write_logs(drives(town(1, 200.0, 2), 1), tmp_path / "made")
    folder = tmp_path / "depot" / "van 7" / inside
    folder.parent.mkdir(parents=True)
    next((tmp_path / "made").iterdir()).rename(folder)
    assert main(["fleet", "ingest", str(tmp_path / named), "--to", str(tmp_path / "town"), "--car-folders"]) == 0
    assert ",van 7" in (tmp_path / "town.cars.csv").read_text("utf-8")


def test_two_cars_with_a_drive_each_are_not_judged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = town(1, 200.0, 2)
    found = drives(place, 2)
    found.car[:] = [0, 1]
    found.street[:] = 0
    write_logs(found, tmp_path / "logs")
    dataset, page = tmp_path / "town", tmp_path / "map"
    assert main(["fleet", "ingest", str(tmp_path / "logs"), "--to", str(dataset), "--car-folders"]) == 0
    capsys.readouterr()
    assert main(["fleet", "summarise", str(dataset)]) == 0
    text = capsys.readouterr().out
    assert "This takes 6 drives over roads that the same car has driven before; there are 0." in text
    assert "Cars: car000, car001" in text and "Whether a segment has become worse is not known" in text
    assert not {sign for sign in ("±", "%") if sign in text}
    assert main(["fleet", "summarise", str(dataset), "--json"]) == 0
    figures = said(capsys)
    assert "This takes 6 drives" in str(figures["not_known"])
    assert [figures[name] for name in ("pass_std", "session_std", "growth_per_year")] == [None] * 3
    assert {(one["bias"], one["bias_std"]) for one in figures["cars"]} == {(None, None)}  # type: ignore
    assert {(one["iri_std_m_per_km"], one["trend_m_per_km_per_year"], one["p_value"])
            for one in figures["roads"]} == {(None, None, None)}  # type: ignore
    assert main(["fleet", "report", str(dataset), "--out", str(page)]) == 0
    assert "This takes 6 drives" in (page / "index.html").read_text("utf-8")
