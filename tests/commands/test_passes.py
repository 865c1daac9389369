"""``ridelog passes`` and ``ridelog sections --route`` as a user runs them."""

from __future__ import annotations

import csv
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from logger.api.log_questions import day_us
from logger.commands.main import main
from logger.errors import BadInput
from logger.store.log.row_format import HEADER, format_row

from ..support.drives.logged_rows import rows_of_drive

DAY_US = 86_400_000_000
BUMP = 33
SPACE = {"g": "http://www.topografix.com/GPX/1/1"}


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Four drives of 1 km due north, one a month; at 330 m a bump that was not there in the first two, and at 700 m a
    ride that is bad on a smooth road."""
    folder = tmp_path / "logs"
    folder.mkdir()
    rows = []
    for number in range(4):
        for index, row in enumerate(rows_of_drive(100, number=number + 1)):
            iri = 8.0 if index == BUMP and number > 1 else 2.0
            rows.append(replace(
                row, utc_us=(row.utc_us or 0) + 30 * number * DAY_US, iri_m_per_km=iri + 0.05 * (-1)**(index + number),
                iri_std_m_per_km=0.1, a_w_mps2=0.9 if 70 <= index < 74 else 0.3, a_w_std_mps2=0.02))
    (folder / "00001-001.csv").write_text("\n".join([HEADER, *map(format_row, rows)]) + "\n", "ascii")
    return folder


def test_four_drives_are_one_line_with_what_changed(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                     ) -> None:
    out, visit, page = tmp_path / "means.csv", tmp_path / "visit.gpx", tmp_path / "page.html"
    assert main(["passes", str(logs), "--length", "10m", "--split", "2025-06-30", "--above", "4", "--json", "--out",
                 str(out), "--out", str(page), "--visit", str(visit)]) == 0
    found = json.loads(capsys.readouterr().out)
    cells = list(csv.DictReader(out.read_text("utf-8").splitlines()))
    assert found["drives"] == 4
    assert len(cells) == len(found["cells"]) == 100
    assert {one["drives"] for one in found["cells"]} == {4}
    worse = [one for one in found["cells"] if one["change_false_share"] < 0.05]
    assert [one["change_m_per_km"] for one in worse] == [pytest.approx(6.0, abs=0.2)]
    assert worse[0]["lat_deg"] == pytest.approx(46.5 + 335.0 / 111_195.08, abs=3e-5)
    kinds = {one["what"]: one for one in found["visits"]}
    assert set(kinds) == {"single bump", "comfort only"}
    assert kinds["comfort only"]["length_m"] == 40.0
    assert kinds["single bump"]["heading_deg"] % 360.0 == pytest.approx(0.0, abs=0.1)
    points = ET.parse(visit).getroot().findall("g:wpt", SPACE)
    assert len(points) == 2
    assert float(points[0].attrib["lat"]) == pytest.approx(found["visits"][0]["lat_deg"], abs=1e-6)
    assert "mean of 4 drives" in page.read_text("utf-8")


def test_days_choose_rows(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["passes", str(logs), "--since", "2025-06-01", "--until", "2025-08-01", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["drives"] == 2


@pytest.mark.parametrize("asked, said", [
    (["--since", "spring"], "--since spring: expected a date such as 2026-04-30"),
    (["--since", "2031-01-01"], "at least one intact row of these days"),
    (["--length", "3m"], "expected a length with its unit"),
    (["--above", "-1"], "--above"),
    (["--visit", "places.doc"], "expected a file that ends in"),
])
def test_nonsense_is_refused(logs: Path, asked: list[str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        main(["passes", str(logs), *asked])


def route(tmp_path: Path, features: list[dict[str, object]]) -> Path:
    path = tmp_path / "route.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", **one} for one in features]}), "utf-8")
    return path


def line(begin_km: object) -> dict[str, object]:
    """1 km due south, over the drives of ``logs``."""
    return {"properties": {"begin_km": begin_km}, "geometry": {
        "type": "LineString", "coordinates": [[6.5, 46.5 + 1000.0 / 111_195.08], [6.5, 46.5]]}}


def test_sections_of_a_route_count_by_its_measures(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                   ) -> None:
    path = route(tmp_path, [line(20.0)])
    assert main(["sections", str(logs), "--route", str(path), "--length", "100m", "--json"]) == 0
    drives = json.loads(capsys.readouterr().out)["drives"]
    assert [one["direction"] for one in drives] == ["against"] * 4
    sections = drives[3]["sections"]
    assert [one["distance_start_m"] for one in sections] == [20_000.0 + 100.0 * index for index in range(10)]
    assert sum(one["known_m"] for one in sections) == pytest.approx(1000.0, abs=2.0)
    # The bump at 335 m from the south is at 665 m from the north.
    worst = max(sections, key=lambda one: one["worst_m_per_km"])
    assert worst["worst_at_m"] == pytest.approx(20_665.0, abs=1.0)


@pytest.mark.parametrize("features, said", [
    ([], "expected roads as LineString"),
    ([line("x")], "begin_km: expected a number of kilometres"),
    ([line(1.0), line(2.0)], "expected one LineString, the route, found 2 lines"),
    ([line(1.0), {"properties": {"km": 1}, "geometry": {"type": "Point", "coordinates": ["a"]}}],
     "kilometre posts"),
])
def test_a_file_that_is_no_route(logs: Path, tmp_path: Path, features: list[dict[str, object]], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        main(["sections", str(logs), "--route", str(route(tmp_path, features))])


def test_a_place_has_one_number_and_what_got_worse_is_called_so(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, table = tmp_path / "page.html", tmp_path / "means.csv"
    assert main(["passes", str(logs), "--length", "10m", "--split", "2025-06-30", "--above", "4",
                 "--out", str(page), "--out", str(table)]) == 0
    text, shown = capsys.readouterr().out, page.read_text("utf-8")
    assert "1 log file" not in shown  # they are means
    first, second = text.splitlines()[:2]
    said = re.fullmatch(r"Between the two periods the IRI of 100 pieces of 10 m changed by \+(0\.\d+) ± (0\.\d+) "
                        "m/km on average", first)
    assert said and 0 < float(said[1]) < 1 and 0 < float(said[2]) < 0.2
    assert second.startswith("1 of them got worse, 0 better")
    (line,) = [one for one in text.splitlines() if one.split()[1:2] == ["worse"]]
    visits = text.partition("Work list")[2].splitlines()[2:4]
    (bump,) = [one for one in visits if "single bump" in one]
    assert line.split()[:2] == [bump.split()[0], "worse"]
    worst = [one["changed"] for one in csv.DictReader(table.read_text("utf-8").splitlines())]
    assert sorted(set(worst)) == ["", "worse"] and worst[BUMP] == "worse"
    (row,) = re.findall(r"<tr><td>(\d+)</td><td>worse</td>.*?</tr>", shown)
    marked = json.loads(re.findall(r'id="data">(.*?)</script>', shown)[0])["places"]
    assert row == bump.split()[0] and marked[int(row) - 1] == BUMP
    assert "Roughest places" not in shown  # they would be numbered otherwise


def test_dates_follow_time_whatever_the_order_of_the_paths(logs: Path, tmp_path: Path) -> None:
    rows = (logs / "00001-001.csv").read_text("ascii").splitlines()
    for name, part in (("a", rows[301:]), ("b", rows[1:301])):  # the last drive before the first three
        (tmp_path / name).mkdir()
        (tmp_path / name / "00001-001.csv").write_text("\n".join([rows[0], *part, ""]), "ascii")
    page = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "a"), str(tmp_path / "b"), "--out", str(page)]) == 0
    assert "17 May 2025, 14:02 to 15 August 2025, 14:02 UTC" in page.read_text("utf-8")


def test_no_row_and_no_page_calls_a_road_poor_and_very_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """2.9 m/km is 184 in/mi: poor by 23 CFR 490.313, and class A of ISO 8608, which reaches 3.05."""
    folder = tmp_path / "logs"
    folder.mkdir()
    rows = [replace(row, iri_m_per_km=2.9, iri_std_m_per_km=0.05) for row in rows_of_drive(100)]
    (folder / "00001-001.csv").write_text("\n".join([HEADER, *map(format_row, rows)]) + "\n", "ascii")
    out, page = tmp_path / "s.csv", tmp_path / "p.html"
    assert main(["sections", str(folder), "--length", "0.1mi", "--out", str(out), "--json"]) == 0
    (drive,) = json.loads(capsys.readouterr().out)["drives"]
    assert {one["condition"] for one in drive["sections"]} == {"poor"}
    assert not any("A" in one.values() for one in [
        *drive["sections"], *csv.DictReader(out.read_text("utf-8").splitlines())])
    assert main(["sections", str(folder), "--length", "0.1mi"]) == 0
    assert not [line for line in capsys.readouterr().out.splitlines() if "poor" in line.split() and "A" in line.split()]
    assert main(["passes", str(folder), "--out", str(page)]) == 0
    assert "rough stretch" in page.read_text("utf-8") and "very good" not in page.read_text("utf-8")


def test_what_all_windows_share_stays_in_the_mean_of_a_drive_and_of_drives(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two drives of 762 m in 100 windows each: 0.3 m/km common to all, 0.4 of each window alone."""
    folder = tmp_path / "logs"
    folder.mkdir()
    parts = {"iri_level_std_m_per_km": 0.0, "iri_common_std_m_per_km": 0.3, "iri_place_std_m_per_km": 0.0}
    rows = [replace(row, iri_m_per_km=3.0, iri_std_m_per_km=0.5, distance_start_m=7.62 * index,
                    distance_end_m=7.62 * (index + 1), **parts)
            for number in (1, 2) for index, row in enumerate(rows_of_drive(100, number=number))]
    (folder / "00001-001.csv").write_text("\n".join([HEADER, *map(format_row, rows)]) + "\n", "ascii")
    assert main(["sections", str(folder), "--length", "762m", "--json"]) == 0
    drives = json.loads(capsys.readouterr().out)["drives"]
    assert [one["sections"][0]["iri_std_m_per_km"] for one in drives] == pytest.approx([np.hypot(0.3, 0.04)] * 2)
    assert main(["sections", str(folder), "--length", "50m"]) == 0
    assert f"standard error {np.hypot(0.3, 0.4 / 200**0.5):.3f}," in capsys.readouterr().out


@pytest.mark.parametrize("day, full", [("2026", "2026-01-01"), ("2026-04", "2026-04-01"), ("2026-04-30", "2026-04-30")])
def test_a_year_or_a_month_stands_for_its_first_day(day: str, full: str) -> None:
    assert day_us(day) == round(datetime.fromisoformat(f"{full}T00:00+00:00").timestamp() * 1e6)
