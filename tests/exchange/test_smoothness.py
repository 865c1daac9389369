"""Suggestions for OpenStreetMap: beside sums done by hand, on streets of known roughness, read by GDAL."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logger.api.conversion import smoothness_layer
from logger.commands.main import main
from logger.geodesy import EARTH_RADIUS_M
from logger.records import WindowRecord
from logger.roads.repeated_drives import Passes, Scatter, suggestion, way_means
from logger.roads.sections import WindowErrors
from logger.store.formats.road_lines import read_map_ways

WINDOW_M = 7.62
PLACES = [(46.5, 6.5), (-33.9, 151.2), (-17.0, 179.9995)]


def rows_along(lat_deg: float, lon_deg: float, north_m: float, length_m: float, iri: float, drive: int
               ) -> list[WindowRecord]:
    """A drive to the east, from so far south-west of a place."""
    middle = np.arange(WINDOW_M / 2, length_m, WINDOW_M)
    lon = lon_deg + np.degrees(middle / EARTH_RADIUS_M) / np.cos(np.radians(lat_deg))
    lon = (lon + 180.0) % 360.0 - 180.0
    lat = lat_deg + np.degrees(north_m / EARTH_RADIUS_M)
    return [WindowRecord(
        number + 1, drive, round(1e6 * (1e5 * drive + at_m / 10)), None, WINDOW_M / 10, at_m - WINDOW_M / 2,
        at_m + WINDOW_M / 2, float(lat), east, 10.0, iri, 0.3, None, 0.3, None, None, None, "", "C", None, 0, 0, (),
        0.01)
        for number, (at_m, east) in enumerate(zip(middle.tolist(), lon.tolist(), strict=True))]


def extract(lat_deg: float, lon_deg: float) -> dict[str, Any]:
    """Two parallel streets 30 m apart, 600 m long, a footway between them, and a street that nobody drove."""
    def feature(number: int, north_m: float, **tags: str) -> dict[str, object]:
        east = np.degrees(np.array([0.0, 300.0, 600.0]) / EARTH_RADIUS_M) / np.cos(np.radians(lat_deg)) + lon_deg
        east = np.where(east > 180.0, east - 360.0, east)
        lat = lat_deg + np.degrees(north_m / EARTH_RADIUS_M)
        return {"type": "Feature", "properties": {"@id": f"way/{number}", **tags}, "geometry": {
            "type": "LineString", "coordinates": [[float(one), float(lat)] for one in east]}}

    return {"type": "FeatureCollection", "features": [
        feature(11, 0.0, highway="residential", smoothness="bad", name="South"),
        feature(12, 30.0, highway="residential"), feature(13, 5.0, highway="footway"),
        feature(14, 400.0, highway="residential")]}


@pytest.mark.parametrize("lat_deg, lon_deg", PLACES)
def test_streets_are_told_apart_and_what_is_little_known_stays_empty(tmp_path: Path, lat_deg: float, lon_deg: float
                                                                     ) -> None:
    file = tmp_path / "ways.geojson"
    file.write_text(json.dumps(extract(lat_deg, lon_deg)))
    rows = [*rows_along(lat_deg, lon_deg, 1.0, 600.0, 3.4, 1), *rows_along(lat_deg, lon_deg, -1.5, 600.0, 3.4, 2),
            *rows_along(lat_deg, lon_deg, 31.0, 200.0, 6.4, 3)]
    layer = smoothness_layer(rows, read_map_ways(file))
    found = {one.values[0]: dict(zip(layer.names, one.values, strict=True)) for one in layer.features}
    assert set(found) == {11, 12}
    assert (found[11]["smoothness_tagged"], found[11]["smoothness_suggested"]) == ("bad", "good")
    assert found[11]["drives"] == 2
    assert found[11]["iri_m_per_km"] == pytest.approx(3.4)
    assert found[11]["covered_m"] == pytest.approx(600.0, abs=8.0)
    assert found[11]["length_m"] == pytest.approx(600.0, abs=0.1)
    assert found[12]["smoothness_suggested"] is None
    assert found[12]["confidence"] is None
    assert found[12]["covered_m"] == pytest.approx(200.0, abs=8.0)


def alone(std: np.ndarray) -> WindowErrors:
    return WindowErrors(std, *np.zeros((3, len(std))))


def test_a_mean_of_a_way_counts_road_by_length_and_a_drive_once() -> None:
    # Way 0: cells of 25 and 10 m, one drive over both, another one over the first.
    key = np.array([0, 0, 1]) + (1 << 20)
    passes = Passes(key, np.array([0, 1, 0]), np.zeros(3), np.array([2.0, 4.0, 6.0]),
                    alone(np.full(3, 0.7)), np.array([25.0, 25.0, 10.0]))
    found = way_means(passes, Scatter(0.0, 0.0), 25.0)
    assert found.covered_m.tolist() == [35.0]
    assert found.drives.tolist() == [2]
    np.testing.assert_allclose(found.iri_m_per_km, [(3.0 * 25 + 6.0 * 10) / 35])
    shares = np.array([12.5, 12.5, 10.0]) / 35
    np.testing.assert_allclose(found.iri_std_m_per_km, [0.7 * np.sqrt(np.sum(shares**2))])
    common = way_means(replace(passes, iri_errors=alone(np.full(3, 1e-5))), Scatter(0.1, 0.0), 25.0)
    assert common.iri_std_m_per_km[0] > 0.1 * 0.5**0.5 * common.iri_m_per_km[0]
    nothing = np.zeros(3)
    of_car = replace(passes, iri_errors=WindowErrors(np.full(3, 0.2), nothing, np.full(3, 0.2), nothing))
    np.testing.assert_allclose(way_means(of_car, Scatter(0.0, 0.0), 25.0).iri_std_m_per_km, [0.2])


@pytest.mark.parametrize("iri, word", [(0.5, "excellent"), (2.99, "excellent"), (3.0, "good"), (5.5, "intermediate"),
                                       (7.1, "bad"), (30.0, "bad")])
def test_words_of_means(iri: float, word: str) -> None:
    assert suggestion(iri, 0.0)[0] == word


def test_how_sure_a_word_is() -> None:
    assert suggestion(3.0, 0.5)[1] == pytest.approx(0.5, abs=1e-4)
    assert suggestion(4.0, 0.5)[1] == pytest.approx(0.9545, abs=1e-4)


@pytest.mark.slow
def test_gdal_reads_what_is_to_be_reviewed(
        short_dump: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pyogrio = pytest.importorskip("pyogrio")
    assert main(["replay", str(short_dump), "--out", str(tmp_path / "logs")]) == 0
    ways, out = tmp_path / "ways.geojson", tmp_path / "review.geojson"
    rows = read_log_line(tmp_path / "logs")
    ways.write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "id": "way/4711", "properties": {"highway": "primary"},
         "geometry": {"type": "LineString", "coordinates": rows}}]}))
    capsys.readouterr()
    assert main(["convert", str(tmp_path / "logs"), "--smoothness", str(ways), "--to", str(out)]) == 0
    assert "1 way" in capsys.readouterr().out
    _, _, geometry, columns = pyogrio.raw.read(out)
    assert len(geometry) == 1
    assert columns[0].tolist() == [4711]


def read_log_line(folder: Path) -> list[list[float]]:
    """Every tenth place of the logs in a folder."""
    from logger.api.logs import read_log

    log = read_log(folder)
    known = np.isfinite(log["lat_deg"])
    places = np.column_stack([log["lon_deg"][known], log["lat_deg"][known]])[::10]
    return places.tolist()


@pytest.mark.parametrize("content, complaint", [
    ("{}", "GeoJSON"), ('{"type":"FeatureCollection","features":[]}', "ways of OpenStreetMap"),
    ('{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"@id":"way/1","highway":"primary"},'
     '"geometry":{"type":"LineString","coordinates":[[1,2]]}}]}', "at least two")])
def test_what_holds_no_ways_is_one_line(tmp_path: Path, content: str, complaint: str) -> None:
    from logger.errors import BadInput

    file = tmp_path / "ways.geojson"
    file.write_text(content)
    with pytest.raises(BadInput, match=complaint):
        read_map_ways(file)


def test_one_drive_says_no_confidence_and_odd_ways_are_left_out(tmp_path: Path) -> None:
    """A merged way has a list of kinds; a line of one point twice has no length."""
    ways = extract(46.5, 6.5)
    features = ways["features"]
    features[1]["properties"]["highway"] = ["residential", "tertiary"]
    features[3]["geometry"]["coordinates"] = [[6.5, 46.5]] * 2
    file = tmp_path / "ways.geojson"
    file.write_text(json.dumps(ways))
    rows = rows_along(46.5, 6.5, 1.0, 600.0, 3.4, 1)
    one, = smoothness_layer(rows, read_map_ways(file)).features
    found = dict(zip(smoothness_layer(rows, []).names, one.values, strict=True))
    assert (found["smoothness_suggested"], found["drives"], found["confidence"]) == ("good", 1, None)
    assert not smoothness_layer(rows, [way for way in read_map_ways(file) if way.osm_id == 14]).features
