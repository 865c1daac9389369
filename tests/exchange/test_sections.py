"""Logs in sections, through the command, and their files read by other libraries."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pyogrio
import pytest

import ridelog
from logger.commands.main import main
from logger.errors import BadInput
from logger.units import MILE_M

from .test_convert import WINDOW_M, drive, eastwards, write


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """30 windows of IRI 1 and 2.5 in turns, the first one unsettled, the last one without an IRI."""
    rows = drive(eastwards(50.0, 8.0, 30))
    for number in range(0, 30, 2):
        object.__setattr__(rows[number], "iri_m_per_km", 1.0)
    object.__setattr__(rows[0], "flags", ("unsettled",))
    object.__setattr__(rows[29], "iri_m_per_km", None)
    return write(tmp_path / "logs", rows)


def test_sections_count_what_is_known_and_add_up(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sections", str(logs), "--length", "100m", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    rows = found["drives"][0]["sections"]
    assert [row["distance_end_m"] for row in rows] == pytest.approx([100.0, 200.0, 30 * WINDOW_M])
    assert sum(row["known_m"] for row in rows) == pytest.approx(28 * WINDOW_M)
    whole = sum(row["known_m"] * row["iri_m_per_km"] for row in rows)
    assert whole == pytest.approx(WINDOW_M * (14 * 1.0 + 14 * 2.5), rel=1e-6)
    assert rows[0]["condition"] == "fair"
    assert rows[0]["worst_m_per_km"] == 2.5
    assert rows[1]["speed_mps"] == pytest.approx(15.24)


def test_words_for_people_in_both_systems(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sections", str(logs), "--length", "0.1mi"]) == 0
    said = capsys.readouterr().out
    assert said.splitlines()[2] == "1 drive, 0.14 mi in 2 sections of 0.1 mi"
    assert "Mean IRI 111 in/mi" in said
    assert "34" in said.splitlines()[6].split()  # 15.24 m/s in miles an hour
    assert "half car on both wheelpaths (HRI)" in said
    assert main(["sections", str(logs), "--length", "1km"]) == 0
    assert "1 section of 1 km" in capsys.readouterr().out


def test_an_iri_without_a_standard_error_has_none_in_its_mean(logs: Path, tmp_path: Path,
                                                              capsys: pytest.CaptureFixture[str]) -> None:
    rows = drive(eastwards(50.0, 8.0, 30))
    for row in rows:
        object.__setattr__(row, "iri_std_m_per_km", None)
    assert main(["sections", str(write(tmp_path / "without", rows)), "--length", "1km"]) == 0
    said = capsys.readouterr().out
    assert "standard error not known, over 0.23 km" in said
    assert "nan" not in said
    assert main(["sections", str(tmp_path / "without"), str(logs), "--length", "1km"]) == 0
    assert "standard error not known" in capsys.readouterr().out


def test_files_of_sections_have_their_places(logs: Path, tmp_path: Path) -> None:
    places = {ending: tmp_path / f"sections.{ending}" for ending in ("gpkg", "csv", "html")}
    assert main(["sections", str(logs), "--out", str(places["gpkg"]), "--out", str(places["html"])]) == 0
    assert main(["sections", str(logs), "--out", str(places["csv"])]) == 0
    about = pyogrio.read_info(places["gpkg"], layer="sections")
    assert about["features"] == 3
    west, south, east, north = about["total_bounds"]
    assert (south, north) == (50.0, 50.0)
    first, last = eastwards(50.0, 8.0, 30)[0][1], eastwards(50.0, 8.0, 30)[-1][1]
    assert (west, east) == pytest.approx((first, last), abs=1e-6)
    with places["csv"].open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["t_utc"][:4] for row in rows] == ["2026"] * 3
    assert "<svg" in places["html"].read_text("utf-8")


def test_python_gives_arrays(logs: Path) -> None:
    found = ridelog.sections(logs, "0.1mi")
    assert found.length_m == pytest.approx(0.1 * MILE_M)
    assert found.iri_m_per_km.shape == found.condition.shape == (2,)
    assert found.end_m[-1] == pytest.approx(30 * WINDOW_M)
    (chart,) = found.charts()
    assert (chart.x_name, chart.y_name) == ("distance [mi]", "IRI [in/mi]")
    assert chart.lines[0].y == pytest.approx(found.iri_m_per_km * 63.36)


@pytest.mark.parametrize(("words", "complaint"), [
    (["--length", "100"], "length 100: expected a length with its unit, such as 100m, 0.1mi or 500ft, from 7.62 m to"),
    (["--length", "1m"], "length 1m: expected a length"),
    (["--length", "..m"], "length ..m: expected a length"),
    (["--out", "x.shp"], "x.shp: expected a file that ends in one of .html, .png"),
])
def test_nonsense_is_one_line(logs: Path, words: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        main(["sections", str(logs), *words])


def test_a_drive_without_a_distance_has_no_sections(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = drive([None, None])
    for row in rows:
        object.__setattr__(row, "distance_start_m", None)
        object.__setattr__(row, "distance_end_m", None)
    assert main(["sections", str(write(tmp_path / "logs", rows))]) == 0
    assert "no sections" in capsys.readouterr().out


def test_localized_roughness_slides_along_each_drive(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sections", str(logs), "--localized", "2", "--json"]) == 0
    drives = json.loads(capsys.readouterr().out)["drives"]
    found = [area for drive in drives for area in drive["localized"]]
    assert found
    assert all(one["worst_m_per_km"] > 2 and one["distance_end_m"] >= one["distance_start_m"] for one in found)
    worst = max(section["worst_m_per_km"] or 0 for drive in drives for section in drive["sections"])
    assert max(one["worst_m_per_km"] for one in found) == pytest.approx(worst)
    assert main(["sections", str(logs), "--localized", "45"]) == 0
    assert "The IRI over a sliding base of 25 ft stays below 45 m/km (2851 in/mi)" in capsys.readouterr().out
    assert main(["sections", str(logs), "--localized", "2", "--units", "us"]) == 0
    words = capsys.readouterr().out
    assert "exceeds 2 m/km (127 in/mi)" in words
    head, first = words[words.index("Areas of localized"):].splitlines()[1:3]
    assert head.split() == ["from", "ft", "to", "ft", "length", "ft", "worst", "in/mi", "at", "ft"]
    assert float(first.split()[0]) == pytest.approx(found[0]["distance_start_m"] / 0.3048, abs=0.051)
    assert float(first.split()[3]) == pytest.approx(found[0]["worst_m_per_km"] * 63.36, abs=0.51)
    with pytest.raises(BadInput, match=r"--localized 0: expected 0\.01 to 50 m/km"):
        main(["sections", str(logs), "--localized", "0"])
