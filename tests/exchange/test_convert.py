"""Logs written for other programs, through the command, and read by those programs' own libraries: GDAL, DuckDB, gpxpy,
Python's csv; and where known places come out, in both hemispheres and across the 180th meridian."""

from __future__ import annotations

import builtins
import csv
import itertools
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import duckdb
import gpxpy
import pyogrio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.commands.main import main
from logger.errors import BadInput
from logger.exchange.layer import formats, windows_layer
from logger.records import WindowRecord
from logger.store.log.log_reader import LoggedFile
from logger.store.log.row_format import COLUMNS, HEADER, format_row

WINDOW_M = 7.62
A_DEGREE_M = 111_195.0  # of latitude, on a sphere of 6371 km
ROW = WindowRecord(
    segment=1, drive=1, t_us=1_500_000, utc_us=1_767_225_600_250_000, duration_s=0.5, distance_start_m=0.0,
    distance_end_m=WINDOW_M, lat_deg=0.0, lon_deg=0.0, speed_mps=15.24, iri_m_per_km=2.5, iri_std_m_per_km=0.2,
    iri_rms_m_per_km=2.7, a_w_mps2=0.31, mtvv_mps2=0.6, vdv_mps175=0.9, crest_factor=4.1, comfort="not_uncomfortable",
    iri_class="B", accel_rms_mps2=0.5, samples=50, clipped_samples=0, flags=())


def drive(places: Sequence[tuple[float, float] | None], **changes: Any) -> list[WindowRecord]:
    """Rows one after the other at these places (latitude, longitude); None: no position."""
    return [replace(ROW, segment=number + 1, t_us=ROW.t_us + 500_000 * number, utc_us=ROW.utc_us + 500_000 * number,
                    distance_start_m=WINDOW_M * number, distance_end_m=WINDOW_M * (number + 1),
                    lat_deg=place[0] if place else None, lon_deg=place[1] if place else None,
                    flags=() if place else ("gps_lost",), **changes)
            for number, place in enumerate(places)]


def eastwards(lat_deg: float, lon_deg: float, count: int) -> list[tuple[float, float]]:
    """Places a window apart along a parallel."""
    step = WINDOW_M / (A_DEGREE_M * math.cos(math.radians(lat_deg)))
    return [(lat_deg, (lon_deg + number * step + 180.0) % 360.0 - 180.0) for number in range(count)]


def write(folder: Path, rows: Sequence[WindowRecord], name: str = "00001-001.csv", more: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text("\n".join([HEADER, *map(format_row, rows)]) + "\n" + more, encoding="utf-8")
    return folder


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two files: south and west; and across the 180th meridian with a row that lost its position."""
    write(tmp_path / "logs", drive(eastwards(-33.9, -70.7, 5)))
    return write(tmp_path / "logs", drive([*eastwards(-16.9, 179.9999, 4), None]), "00002-001.csv")


def converted(logs: Path, ending: str) -> Path:
    out = logs.parent / f"out.{ending}"
    assert main(["convert", str(logs), "--to", str(out)]) == 0
    return out


@pytest.mark.parametrize(("ending", "layer", "count"), [("geojson", "out", 10), ("gpkg", "windows", 10)])
def test_gdal_reads_maps_as_they_were_driven(logs: Path, ending: str, layer: str, count: int) -> None:
    out = converted(logs, ending)
    about = pyogrio.read_info(out, layer=layer)
    assert (about["features"], about["crs"]) == (count, "EPSG:4326")
    assert {column.name for column in COLUMNS} | {"log"} <= set(about["fields"])
    _, table = pyogrio.read_arrow(out, layer=layer)
    rows = table.to_pylist()
    assert [row["iri_m_per_km"] for row in rows] == [2.5] * count
    assert rows[-1]["flags"] == "gps_lost"
    assert rows[-1].get("wkb_geometry", rows[-1].get("geom", rows[-1].get("geometry"))) is None
    west, south, east, north = about["total_bounds"]
    assert (west, east, north) == (-180.0, 180.0, -16.9)
    assert south == pytest.approx(-33.9)


def test_geojson_keeps_to_its_standard(logs: Path) -> None:
    """RFC 7946: no part crosses the 180th meridian, six decimals, longitude first, null where nothing is known."""
    found = json.loads(converted(logs, "geojson").read_text("utf-8"))
    assert found["type"] == "FeatureCollection"
    assert "crs" not in found
    kinds = []
    for feature in found["features"]:
        assert set(feature) == {"type", "geometry", "properties"}
        if feature["geometry"] is None:
            continue
        kinds.append(feature["geometry"]["type"])
        lines = feature["geometry"]["coordinates"]
        for line in lines if kinds[-1] == "MultiLineString" else [lines]:
            assert len(line) >= 2
            assert all(abs(one[0] - other[0]) < 1 for one, other in itertools.pairwise(line))
            assert all(-180 <= lon <= 180 and -90 <= lat <= 90 and round(lon, 6) == lon for lon, lat in line)
    assert kinds.count("MultiLineString") == 1
    first = found["features"][0]
    assert first["geometry"]["coordinates"][0] == [-70.7, -33.9]
    assert first["properties"]["t_utc"] == "2026-01-01T00:00:00.250Z"
    assert found["features"][-1]["properties"]["lat_deg"] is None


def test_duckdb_reads_parquet_and_its_geometries_say_what_they_are(logs: Path) -> None:
    out = converted(logs, "parquet")
    asked = "count(*), sum(distance_end_m - distance_start_m), count(geometry), min(epoch_ms(t_utc))"
    count, total, known, first = duckdb.connect().execute(f"select {asked} from '{out}'").fetchone()
    assert (count, known) == (10, 9)
    assert total == pytest.approx(10 * WINDOW_M)
    assert first == ROW.utc_us // 1000
    import pyarrow.parquet

    about = json.loads(pyarrow.parquet.read_schema(out).metadata[b"geo"])
    assert (about["version"], about["primary_column"]) == ("1.1.0", "geometry")
    assert about["columns"]["geometry"]["encoding"] == "WKB"
    assert about["columns"]["geometry"]["geometry_types"] == ["LineString", "MultiLineString"]


def test_gpx_is_tracks_of_the_length_driven(logs: Path) -> None:
    out = converted(logs, "gpx")
    found = gpxpy.parse(out.read_text("utf-8"))
    assert [track.name for track in found.tracks] == ["00001-001.csv, drive 1", "00002-001.csv, drive 1"]
    assert [track.length_2d() for track in found.tracks] == pytest.approx([4 * WINDOW_M, 3 * WINDOW_M], rel=0.01)
    point = found.tracks[0].segments[0].points[0]
    assert (point.latitude, point.longitude) == (-33.9, -70.7)
    assert point.time.isoformat() == "2026-01-01T00:00:00.500000+00:00"  # the middle of the window
    values = {one.tag.partition("}")[2]: one.text for one in point.extensions}
    assert (values["iri_m_per_km"], values["comfort"]) == ("2.5", "not_uncomfortable")
    assert "track_points" in [name for name, _ in pyogrio.list_layers(out)]


def test_kml_has_a_folder_a_drive_and_colours(logs: Path) -> None:
    out = converted(logs, "kml")
    layers = [name for name, _ in pyogrio.list_layers(out)]
    assert layers == ["00001-001.csv, drive 1", "00002-001.csv, drive 1"]
    _, table = pyogrio.read_arrow(out, layer=layers[1])
    assert len(table) == 4  # the row without a position has no place on a map
    assert "#class-B" in out.read_text("utf-8")
    assert 'id="class-B"><LineStyle><color>ffd4a958</color>' in out.read_text("utf-8")  # blue, green, red of #58a9d4


def test_a_table_has_all_rows_with_their_units(logs: Path) -> None:
    with converted(logs, "csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["log", *(column.name for column in COLUMNS)]
    assert (len(rows), rows[0]["log"], rows[9]["lat_deg"], rows[9]["flags"]) == (10, "00001-001.csv", "", "gps_lost")
    assert [float(row["t_s"]) for row in rows[:2]] == [1.5, 2.0]


@given(lat=st.floats(-85, 85), lon=st.floats(-180, 180), count=st.integers(1, 30))
def test_lines_join_and_cover_the_way_once(lat: float, lon: float, count: int) -> None:
    """From the first middle to the last, each line beginning where the one before ends, none across the meridian."""
    found = windows_layer([LoggedFile("one", drive(eastwards(lat, lon, count)), 0, None)])
    lines = [line for row in found.features for line in row.geometry]
    assert found.placed == count
    length_m = 0.0
    for line in lines:
        for (lon0, lat0), (lon1, lat1) in itertools.pairwise(line):
            assert abs(lon1 - lon0) < 180
            assert (lat0, lat1) == (lat, lat)
            length_m += abs(lon1 - lon0) * A_DEGREE_M * math.cos(math.radians(lat))
    assert length_m == pytest.approx((count - 1) * WINDOW_M, abs=1e-4)
    for one, other in itertools.pairwise(lines):
        assert (one[-1][0] - other[0][0]) % 360 == pytest.approx(0, abs=1e-9)


def test_a_gap_stays_a_gap_and_a_lone_row_is_a_point(tmp_path: Path) -> None:
    places = eastwards(50.0, 8.0, 6)
    rows = drive([places[0], None, *places[2:4], None, places[5]])
    found = windows_layer([LoggedFile("one", rows, 0, None)])
    assert [len(row.geometry[0]) if row.geometry else 0 for row in found.features] == [1, 0, 2, 2, 0, 1]
    assert main(["convert", str(write(tmp_path / "logs", rows)), "--to", str(tmp_path / "out.gpkg")]) == 0
    assert pyogrio.read_info(tmp_path / "out.gpkg", layer="windows")["features"] == 6


def test_what_it_says(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = logs.parent / "way.geojson"
    write(logs, drive(eastwards(1.0, 1.0, 1)), "00003-001.csv", "torn,line\n")
    assert main(["convert", str(logs), str(logs / "00001-001.csv"), "--to", str(out)]) == 0
    assert capsys.readouterr().out == (f"{out}: 11 windows, 1 of them without a position\n"
                                       "Not used: 1 damaged line ('ridelog verify' lists them).\n")
    assert main(["convert", str(logs), "--to", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "file": str(out), "format": "geojson", "rows": 11, "placed": 10, "damaged_lines": 1,
        "left_out": [{"amount": 1, "unit": "damaged line", "why": "('ridelog verify' lists them)"}]}


@pytest.mark.parametrize(("to", "complaint"), [
    ("way.shp", rf"way.shp: expected a file that ends in one of {', '.join(f'.{name}' for name in sorted(formats()))}"),
    ("way", "way: expected a file that ends in one of"),
    ("nowhere/way.csv", "expected a file in a folder that exists"),
    ("logs/00001-001.csv", "expected a file other than the input"),
])
def test_what_cannot_be_written_is_one_line(logs: Path, to: str, complaint: str) -> None:
    before = (logs / "00001-001.csv").read_bytes()
    with pytest.raises(BadInput, match=complaint):
        main(["convert", str(logs), "--to", str(logs.parent / to)])
    assert (logs / "00001-001.csv").read_bytes() == before


def test_no_log_and_no_row_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="expected segment logs"):
        main(["convert", str(tmp_path), "--to", str(tmp_path / "way.csv")])
    write(tmp_path / "logs", [], more="nonsense\n")
    with pytest.raises(BadInput, match="expected a log with at least one intact row"):
        main(["convert", str(tmp_path / "logs"), "--to", str(tmp_path / "way.csv")])
    assert not list(tmp_path.glob("*way*"))


@pytest.mark.parametrize("ending", ["gpkg", "parquet"])
def test_a_missing_extra_is_named(logs: Path, ending: str, monkeypatch: pytest.MonkeyPatch) -> None:
    there = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.partition(".")[0] in ("pyarrow", "pyogrio"):
            raise ImportError(f"No module named {name!r}")
        return there(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(BadInput, match=r"out.\w+: expected the 'maps' extra: pip install 'ridelog\[maps\]'"):
        main(["convert", str(logs), "--to", str(logs.parent / f"out.{ending}")])
    assert not list(logs.parent.glob("*out*"))


def test_a_format_that_fails_half_way_leaves_the_old_file(logs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = converted(logs, "csv")
    before = out.read_bytes()

    def fail(layer: object, file: str) -> Iterator[bytes]:
        yield b"half"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(formats()["csv"], "content", fail)
    with pytest.raises(BadInput, match=r"out.csv: expected a file that can be written \(No space left on device\)"):
        main(["convert", str(logs), "--to", str(out)])
    assert out.read_bytes() == before
    assert [path.name for path in logs.parent.glob("*out*")] == ["out.csv"]
