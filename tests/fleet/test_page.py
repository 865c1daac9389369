"""The report's folder, as a browser sees it, and its files, as other readers do."""

from __future__ import annotations

import json
from pathlib import Path

import duckdb
import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput

from ..support.browser import CHROMIUM, NO_BROWSER, browser, opened
from ..support.drives.fleet_town import drives, ingested, town


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ingested(drives(town(8, 600.0, 4, seed=3), 120, seed=4), tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="module")
def report(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "map"
    for _ in range(2):  # a report takes the place of an older one
        assert main(["fleet", "report", str(dataset), "--out", str(out)]) == 0
    assert [path.name for path in out.parent.iterdir()] == ["map"]
    return out


def tiles_of(report: Path) -> dict[str, dict[str, list[float]]]:
    texts = [path.read_text() for path in (report / "tiles").rglob("*.js")]
    return dict(json.loads("[" + text.removeprefix("fleetTile(").rstrip()[:-1] + "]") for text in texts)


def test_tiles_hold_each_segment_once_and_means_that_are_theirs(report: Path) -> None:
    rows = duckdb.sql(f"select iri_m_per_km, length_m from '{report}/segments.parquet'").fetchnumpy()
    tiles = tiles_of(report)
    finest = [tile for name, tile in tiles.items() if name.startswith("15/")]
    assert sorted(value for tile in finest for value in tile["m"]) == sorted(
        round(value * 100) for value in rows["iri_m_per_km"].tolist())
    for level in {name.split("/")[0] for name in tiles} - {"15"}:
        worst = max(max(tile["w"]) for name, tile in tiles.items() if name.startswith(f"{level}/"))
        assert worst == round(rows["iri_m_per_km"].max() * 100)


def test_sections_are_means_of_their_segments(report: Path) -> None:
    total = "sum(iri_m_per_km * length_m) / sum(length_m), sum(length_m)"
    segments, sections = (duckdb.sql(f"select {total} from '{report}/{name}.parquet'").fetchall()[0]
                          for name in ("segments", "sections"))
    assert np.allclose(segments, sections, rtol=1e-12)
    assert len((report / "sections.csv").read_text().splitlines()) == duckdb.sql(
        f"select count(*) from '{report}/sections.parquet'").fetchall()[0][0] + 1


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason=NO_BROWSER)
def test_the_map_loads_its_tiles_from_the_folder_and_answers(report: Path) -> None:
    complaints: list[str] = []
    with browser() as chromium, opened(chromium, report / "index.html", complaints) as tab:
        tab.click("[data-lat] >> nth=0")
        tab.wait_for_timeout(1500)
        tab.click("[data-lat] >> nth=0")
        tab.wait_for_selector("#reading canvas.history")
        assert "standard error" in tab.inner_text("#reading")
        colours = tab.evaluate("""() => {
            const {canvas} = map, pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
            const seen = new Set();
            for (let i = 0; i < pixels.length; i += 4) seen.add(pixels[i] << 16 | pixels[i + 1] << 8 | pixels[i + 2]);
            return seen.size; }""")
        assert colours > 20
        assert "poor, above 2.68 m/km" in tab.inner_text(".legend")
    assert not [one for one in complaints if not one.startswith(f"request: {report.as_uri()}/tiles/")]


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason=NO_BROWSER)
def test_the_page_fits_a_phone(report: Path) -> None:
    with browser() as chromium, opened(chromium, report / "index.html", [], viewport={"width": 390, "height": 844}
                                       ) as tab:
        assert tab.evaluate("document.documentElement.scrollWidth") <= 390


def test_segments_of_few_cars_are_withheld(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cars = {}
    for least in (1, 3):
        assert main(["fleet", "summarise", str(dataset), "--json", "--public", str(least)]) == 0
        found = json.loads(capsys.readouterr().out)
        cars[least] = [one["cars"] for one in found["roads"]]
        assert all(one["last_utc"].endswith("T00:00:00.000Z") for one in found["roads"])
        assert found["withheld_segments"] == len(cars[1]) - len(cars[least])
    assert min(cars[1]) < 3 <= min(cars[3])
    with pytest.raises(BadInput, match="expected a segment that 100 cars have driven, found none"):
        main(["fleet", "report", str(dataset), "--out", str(tmp_path / "map"), "--public", "100"])


def test_a_folder_with_other_files_is_not_taken(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(BadInput, match="expected a new or empty folder, or one of an earlier report"):
        main(["fleet", "report", str(dataset), "--out", str(tmp_path)])
    assert (tmp_path / "mine.txt").read_text() == "mine"
