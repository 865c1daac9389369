"""Pages and pictures of results, through the commands: what is in them, and what is refused."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import ridelog
from logger.chart_data import Curves, Line
from logger.commands.main import main
from logger.errors import BadInput
from logger.report.charts import chart
from logger.roads.iri import continuous_iri, rectified_slope, window_iri

from ..support.slow import slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A road and a drive over it."""
    place = tmp_path_factory.mktemp("pictures")
    assert main(["road", "generate", "--class", "C", "--length", "300", "--out", str(place / "road.csv")]) == 0
    assert main(["simulate", "--vehicle", "rav4-2009", "--profile", str(place / "road.csv"), "--speed", "15",
                 "--out", str(place / "drive.csv")]) == 0
    rows = (place / "drive.csv").read_text().splitlines()
    (place / "record.csv").write_text("".join(",".join(row.split(",")[:2]) + "\n" for row in rows))
    time_s = np.arange(0, 10, 0.01)
    np.savetxt(place / "decay.csv", np.stack([time_s, np.exp(-time_s) * np.sin(9 * time_s)], axis=1), "%.9g", ",",
               header="t_s,accel_z_mps2", comments="")
    return place


COMMANDS: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "iri": (["iri", "road.csv"], ["Roughness", "25 ft, continuous", "Profile"]),
    "classify": (["road", "classify", "road.csv"], ["Spectrum of the road", "A | B", "G | H", "class      C"]),
    "comfort": (["comfort", "drive.csv"], ["Running r.m.s. over 1 s", "a_w", "Spectrum of the weighted acceleration"]),
    "modes": (["modes", "record.csv"], ["Stabilisation diagram"]),
    "estimate": (["estimate", "drive.csv", "--vehicle", "rav4-2009"], ["Roughness from acceleration", "estimate"]),
    "simulate": (["simulate", "--vehicle", "rav4-2009", "--profile", "road.csv", "--speed", "12", "--out", "again.csv"],
                 ["Simulated drive", "acceleration [m/s2]"]),
}


LONG = ("classify", "comfort", "estimate")


@pytest.mark.parametrize("name", [*(one for one in COMMANDS if one not in LONG), *slow(*LONG)])
def test_a_result_is_a_page_that_stands_alone_and_pictures_are_files_of_their_kind(
        name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(folder)
    words, shown = COMMANDS[name]
    assert main([*words, *(word for ending in ("html", "png", "svg") for word in ("--out", f"{name}.{ending}"))]) == 0
    said = capsys.readouterr().out
    page = (folder / f"{name}.html").read_text("utf-8")
    assert all(one in page for one in shown)
    assert said.strip().splitlines()[0] in page.replace("&gt;", ">")
    assert "<script" not in page
    assert "src=" not in page
    assert page.count("<svg") >= 1
    assert "nan" not in page.partition("<svg")[2]
    data = (folder / f"{name}.png").read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    assert (width, height % 540) == (1200, 0)
    assert ET.parse(folder / f"{name}.svg").getroot().tag.endswith("svg")


@pytest.mark.slow
def test_the_same_result_is_the_same_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    for name in ("first.png", "second.png"):
        assert main(["iri", "road.csv", "--out", name]) == 0
    assert (folder / "first.png").read_bytes() == (folder / "second.png").read_bytes()


@pytest.mark.parametrize(("words", "complaint"), [
    (["iri", "road.csv", "--out", "road.csv"], "--out road.csv: expected a file other than the input"),
    (["iri", "road.csv", "--out", "x.csv"], "--out x.csv: expected a file that ends in one of .html, .png, .svg"),
    (["iri", "road.csv", "--out", "nowhere/x.png"], "expected a file in a folder that exists"),
    (["modes", "decay.csv", "--method", "decrement", "--out", "x.png"],
     "--out x.png: this result has no pictures; .html holds its text"),
    (["estimate", "drive.csv", "--vehicle", "rav4-2009", "--out", "drive.csv.png", "--profile-out", "drive.csv.png"],
     "--profile-out drive.csv.png: expected a different file each time"),
])
def test_what_cannot_be_a_picture_is_one_line(words: list[str], complaint: str, folder: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    before = (folder / "road.csv").read_bytes()
    with pytest.raises(BadInput, match=complaint):
        main(words)
    assert (folder / "road.csv").read_bytes() == before


def test_the_continuous_iri_is_that_of_the_window_around(folder: Path) -> None:
    road = ridelog.read_profile(folder / "road.csv")
    at_m, values = continuous_iri(road.elevation_m, None, road.spacing_m, 7.6)
    slope = rectified_slope(road.elevation_m, road.spacing_m)
    for index in (0, 700, len(at_m) - 1):
        exact = window_iri(slope, road.spacing_m, [at_m[index] - 3.8, at_m[index] + 3.8])
        assert values[index] == pytest.approx(exact[0], rel=1e-9)
    whole, all_of_it = continuous_iri(road.elevation_m[:400], None, road.spacing_m, 100.0)
    assert len(whole) == 1
    short = ridelog.Profile(0.0, road.spacing_m, road.elevation_m[:400], None)
    assert all_of_it[0] == pytest.approx(ridelog.iri(short).iri_m_per_km)


def test_a_logarithmic_axis_puts_powers_of_ten_at_even_steps() -> None:
    x = np.array([0.1, 1.0, 10.0, 100.0])
    drawn = chart(Curves("Powers", "x", "y", (Line("one", x, x**2),), log_x=True, log_y=True))
    flat = [float(one) for one in drawn.partition('class="thick s0" d="M')[2].partition('"')[0].split()]
    steps = np.diff(np.array(flat).reshape(-1, 2), axis=0)
    assert steps == pytest.approx(np.tile(steps[0], (3, 1)), abs=0.15)
    for label in (">0.1<", ">1<", ">10<", ">100<", ">0.01<"):
        assert label in drawn



def test_a_fit_has_its_residuals_and_correlations(tmp_path: Path) -> None:
    car = ridelog.read_vehicle("golden-car")
    road = ridelog.random_road(iso_class="B", length_m=150.0)
    ridelog.write_run(tmp_path / "run", ridelog.simulate(car, road, 15.0, noise_mps2=0.05))
    out, vehicle = tmp_path / "fit.html", tmp_path / "fitted.yaml"
    names = "front.suspension_stiffness_n_per_m,front.suspension_damping_n_s_per_m"
    assert main(["identify", str(tmp_path / "run"), "--vehicle", "golden-car", "--free", names, "--out", str(out),
                 "--out", str(vehicle)]) == 0
    text = out.read_text("utf-8")
    assert "Autocorrelation of the residuals" in text
    assert "Correlated estimates" in text
    assert names.replace(",", ", ") in text
    assert "fitted by ridelog identify" in vehicle.read_text("utf-8")


def test_white_residuals_stay_in_the_band() -> None:
    from logger.api.identify.answer import _left

    white = [np.random.default_rng(seed).standard_normal(4000) for seed in (1, 2)]
    curves = _left(white)
    found, band = curves.lines[0].y, curves.lines[1].y
    assert 0.88 <= float((abs(found) < band).mean()) <= 1.0
    assert band[0] == pytest.approx(1.96 / np.sqrt(8000), rel=1e-3)
