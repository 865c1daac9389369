"""``ridelog iri`` as people and programs call it."""

import json
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.roads import iso8608
from logger.roads.iri import iri

from ..support.command import called

SPACING_M = 0.05


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """250 m of a road, starting at 100 m."""
    elevation = iso8608.generate(40.0, 250.0, SPACING_M, 3)
    path = tmp_path_factory.mktemp("iri") / "road.csv"
    lines = (f"{100 + SPACING_M * sample:.2f},{height!r}" for sample, height in enumerate(elevation.tolist()))
    path.write_text("\n".join(["distance_m,elevation_m", *lines]))
    return path, elevation


@pytest.fixture(scope="module")
def two_tracks(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray, np.ndarray]:
    left, right = (iso8608.generate(40.0, 150.0, SPACING_M, seed) for seed in (4, 5))
    path = tmp_path_factory.mktemp("iri") / "tracks.csv"
    pairs = zip(left.tolist(), right.tolist(), strict=True)
    lines = (f"{SPACING_M * n:.2f},{a!r},{b!r}" for n, (a, b) in enumerate(pairs))
    path.write_text("\n".join(["distance_m,elevation_m,elevation_right_m", *lines]))
    return path, left, right


def as_json(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict:
    assert main(["iri", *map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_one_track_has_exactly_the_agreed_fields(
    road: tuple[Path, np.ndarray], capsys: pytest.CaptureFixture[str]
) -> None:
    path, elevation = road
    result = as_json(capsys, path)
    assert list(result) == ["iri_m_per_km", "windows"]
    assert result["iri_m_per_km"] == pytest.approx(iri(elevation, SPACING_M), rel=1e-9)
    fields = ["distance_start_m", "distance_end_m", "iri_m_per_km"]
    assert [list(window) for window in result["windows"]] == [fields] * 3
    edges = [(window["distance_start_m"], window["distance_end_m"]) for window in result["windows"]]
    assert edges == [(100, 200), (200, 300), (300, pytest.approx(349.8))]
    lengths = np.diff(edges)[:, 0]
    values = [window["iri_m_per_km"] for window in result["windows"]]
    assert lengths @ values / lengths.sum() == pytest.approx(result["iri_m_per_km"], rel=1e-9)


def test_windows_of_any_length(road: tuple[Path, np.ndarray], capsys: pytest.CaptureFixture[str]) -> None:
    windows = as_json(capsys, road[0], "--window", "7.62")["windows"]
    assert len(windows) == 33
    assert windows[1]["distance_start_m"] == pytest.approx(107.62)


def test_two_tracks_have_mri_and_hri(
    two_tracks: tuple[Path, np.ndarray, np.ndarray], capsys: pytest.CaptureFixture[str]
) -> None:
    path, left, right = two_tracks
    result = as_json(capsys, path)
    assert result["iri_m_per_km"] == pytest.approx(iri(left, SPACING_M), rel=1e-9)
    assert result["iri_right_m_per_km"] == pytest.approx(iri(right, SPACING_M), rel=1e-9)
    assert result["mri_m_per_km"] == pytest.approx((iri(left, SPACING_M) + iri(right, SPACING_M)) / 2, rel=1e-9)
    assert result["hri_m_per_km"] == pytest.approx(iri((left + right) / 2, SPACING_M), rel=1e-9)
    assert result["hri_m_per_km"] < result["mri_m_per_km"]
    for window in result["windows"]:
        assert window["mri_m_per_km"] == pytest.approx((window["iri_m_per_km"] + window["iri_right_m_per_km"]) / 2)
        assert 0 < window["hri_m_per_km"] <= window["mri_m_per_km"]


def test_a_person_sees_a_table_and_words(
    road: tuple[Path, np.ndarray], two_tracks: tuple[Path, np.ndarray, np.ndarray], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["iri", str(road[0])]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "road.csv: 250.00 m (820.2 ft), one sample every 50 mm (1.969 in)"
    assert lines[0].startswith("IRI ")
    assert lines[1].startswith("Roads like this: ")
    assert lines[2].startswith("Ride: comfortable")
    assert [line.endswith("partial") for line in lines[-5:-2]] == [False, False, True]
    assert main(["iri", str(two_tracks[0])]) == 0
    heads = capsys.readouterr().out.splitlines()[4]
    assert " ".join(heads.split()) == "from m to m from ft to ft IRI m/km IRI right m/km MRI m/km HRI m/km in/mi"


def uneven(path: Path, elevation: np.ndarray) -> Path:
    """The same road with every third sample left out."""
    kept = np.arange(len(elevation)) % 3 != 2
    lines = (f"{SPACING_M * n:.2f},{float(elevation[n])!r}" for n in np.flatnonzero(kept))
    path.write_text("\n".join(["distance_m,elevation_m", *lines]))
    return path


def test_uneven_spacing_is_refused_or_resampled_on_request(
    road: tuple[Path, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = uneven(tmp_path / "uneven.csv", road[1])
    with pytest.raises(BadInput, match=r"uneven\.csv:4: expected even steps of 0.05 m, found a gap of 0.1 m"):
        main(["iri", str(path)])
    result = as_json(capsys, path, "--resample", "0.05")
    assert (result["resampled_to_m"], result["widest_step_m"]) == (0.05, pytest.approx(0.1))
    assert result["iri_m_per_km"] == pytest.approx(iri(road[1], SPACING_M), rel=0.02)
    assert main(["iri", str(path), "--resample", "0.05"]) == 0
    assert "Resampled: interpolated between samples up to 0.1 m apart." in capsys.readouterr().out


@pytest.mark.parametrize(("count", "spacing_m", "arguments", "message"), [
    (44, 0.25, [], "expected a profile of at least 11 m, found 10.75 m"),
    (400, 0.5, [], "expected samples at most 0.3 m apart, found 0.5 m"),
    (400, 0.25, ["--resample", "0.31"], "expected samples at most 0.3 m apart, found 0.31 m"),
    (400, 0.25, ["--window", "inf"], "expected a finite window of at least the 0.25 m between samples, found inf m"),
    (400, 0.25, ["--window", "0.1"], "expected a finite window of at least the 0.25 m between samples, found 0.1 m"),
])
def test_what_has_no_iri_is_refused_by_name(
    tmp_path: Path, count: int, spacing_m: float, arguments: list[str], message: str
) -> None:
    path = tmp_path / "short.csv"
    path.write_text("distance_m,elevation_m\n" + "".join(f"{spacing_m * n:.2f},0\n" for n in range(count)))
    with pytest.raises(BadInput) as error:
        main(["iri", str(path), *arguments])
    assert str(error.value).startswith(f"{path}: {message}")


def test_a_window_beyond_every_profile_is_cut_short_by_its_end(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flat.csv"
    path.write_text("distance_m,elevation_m\n" + "".join(f"{0.25 * n:.2f},0\n" for n in range(100)))
    assert main(["iri", str(path), "--window", "1e308", "--json"]) == 0
    (window,) = json.loads(capsys.readouterr().out)["windows"]
    assert window["distance_end_m"] == 24.75


def test_the_command_answers_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text("distance_m,elevation_m\n0,1\n0.25,oops\n")
    ended = called("iri", path, "--json")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == f"ridelog: {path}:3: expected a number for elevation_m, found 'oops'\n"


def test_an_erd_file_is_recognised_by_its_first_line(
    road: tuple[Path, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "road.erd"
    text = f"ERDFILEV2.00\n1,{len(road[1])},-1,1,5,{SPACING_M},-1,\nSHORTNAMElev.\nUNITSNAMin\nXUNITS  m\nEND\n"
    path.write_text(text + "\n".join(repr(height / 0.0254) for height in road[1].tolist()))
    assert as_json(capsys, path)["iri_m_per_km"] == pytest.approx(iri(road[1], SPACING_M), rel=1e-9)
    assert as_json(capsys, path, "--resample", "0.1")["resampled_to_m"] == 0.1


@pytest.mark.parametrize("length", ["0", "-1", "nan"])
def test_a_window_that_has_no_length_is_refused_by_its_name(road: tuple[Path, np.ndarray], length: str) -> None:
    with pytest.raises(BadInput, match=r"^--window .*: expected a length above 0 m"):
        main(["iri", str(road[0]), "--window", length])


def test_the_folder_where_one_is_has_a_profile(
    road: tuple[Path, np.ndarray], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "profile.csv").write_bytes(road[0].read_bytes())
    monkeypatch.chdir(tmp_path / "run")
    assert as_json(capsys, Path())["iri_m_per_km"] == as_json(capsys, road[0])["iri_m_per_km"]


@pytest.mark.parametrize("window", ["160.9344", "160.9344m", "0.1mi", "528ft", "0.1609344km"])
def test_a_window_may_name_its_unit(window: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    road = tmp_path / "road.csv"
    rows = "".join(f"{0.5 * row:.1f},{0.2 * (row % 7):.3f}\n" for row in range(1200))
    road.write_text(f"distance_ft,elevation_in\n{rows}", "ascii")
    assert main(["iri", str(road), "--window", window, "--json"]) == 0
    ends = [one["distance_end_m"] for one in json.loads(capsys.readouterr().out)["windows"]]
    assert ends[0] == pytest.approx(160.9344, abs=0.08) and len(ends) == 2  # to the next sample, of half a foot
