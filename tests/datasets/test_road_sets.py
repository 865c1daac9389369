"""Public records of roads as people run them, on small folders of the same layout whose truth is known."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from logger.api.datasets.comma2k19 import comma2k19
from logger.api.datasets.lira_cd import recordings
from logger.commands.main import main
from logger.errors import BadInput
from logger.studies.study import Workload

from ..support.drives import road_sets as made

MASSACHUSETTS = (
    {"seed": 1, "lat_deg": 42.3, "lon_deg": -71.1}, {"seed": 2, "grade": "C", "lat_deg": 42.4, "lon_deg": -71.09,
                                                    "north": -1.0}, {"seed": 3, "lat_deg": 42.4, "lon_deg": -71.3})


@pytest.fixture(scope="module")
def lira_cd(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made.lira_cd(tmp_path_factory.mktemp("lira") / "set", {
        "HH": made.surveyed(1), "VH": made.surveyed(2, "C", lon_deg=12.6, north=-1.0)})


@pytest.fixture(scope="module")
def zenodo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    roads = tuple(made.surveyed(**one) for one in MASSACHUSETTS)
    return made.zenodo_4386256(tmp_path_factory.mktemp("zenodo") / "set", (roads[0], roads[1], roads[2]), (0, 2))


def reported(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    assert main(["study", *map(str, words), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def rows(table: dict[str, Any], compared: str) -> dict[str, dict[str, Any]]:
    """Rows of one kind by the name of their road."""
    named = [dict(zip(table["columns"], row, strict=True)) for row in table["rows"]]
    return {row["road"]: row for row in named if row["compared"] == compared}


# --- what comes out is the truth that was put in ---


@pytest.mark.slow
def test_cars_of_lira_cd_find_the_profilers_iri(lira_cd: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ten, hundred, repeats = reported(capsys, "lira-cd", lira_cd, "--vehicle", made.CAR)["tables"]
    assert ten["title"] == "Windows of 10 m"
    for table, r2 in ((ten, 0.8), (hundred, 0.9)):
        found = rows(table, "car, shifted along the road to fit")
        assert set(found) == {"CPH1 HH", "CPH1 VH"}
        for row in found.values():
            assert row["R2"] > r2
            assert abs(row["bias"]) < 0.03
            assert row["within 2 (95%)"] > 0.8
    assert rows(repeats, "ARAN against P79, 10 m")["CPH1 HH"]["R2"] > 0.85  # one error of 10 %, halved
    tracks = rows(repeats, "P79, right track against left, 10 m")["CPH1 HH"]
    assert tracks["MAE [m/km]"] == pytest.approx(0.05 * np.sqrt(2 / np.pi) * 5.1, rel=0.35)


@pytest.mark.slow
def test_a_factor_is_that_of_the_other_road(lira_cd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The profiler of one road reads twice as much: that road's factor stays, the other one's becomes two."""
    shutil.copytree(lira_cd, tmp_path / "set")
    file = tmp_path / "set" / "ref_data" / "cph1_iri_mpd_rut_vh.csv"
    header, *lines = file.read_text("latin-1").splitlines()
    cells = [line.split(";") for line in lines]
    file.write_text("\n".join([header, *(";".join([at, *(str(2 * float(one)) for one in more)])
                                         for at, *more in cells)]), "latin-1")
    _, hundred, _ = reported(capsys, "lira-cd", tmp_path / "set", "--vehicle", made.CAR)["tables"]
    factors = {row[0]: float(row[1].split("scaled by ")[1].split()[0]) for row in hundred["rows"]
               if row[1].startswith("car, scaled by")}
    assert factors["CPH1 HH"] == pytest.approx(2, rel=0.05)
    assert factors["CPH1 VH"] == pytest.approx(1, rel=0.05)


@pytest.mark.slow
def test_phones_of_zenodo_find_the_lasers_iri(zenodo: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    found = reported(capsys, "zenodo-4386256", zenodo, "--vehicle", made.CAR, "--out", page)
    ten, hundred = found["tables"]
    for table, mae in ((ten, 0.4), (hundred, 0.15)):
        cars = rows(table, "car")
        assert set(cars) == {"Massachusetts Avenue, north", "Route 2, Concord"}
        for row in cars.values():
            assert row["MAE [m/km]"] < mae
            assert abs(row["bias"]) < 0.03
    assert min(row["R2"] for row in rows(ten, "car").values()) > 0.7
    assert "no repeat" in found["verdict"]
    assert "Left out" not in found["verdict"]
    assert page.read_text().count("<svg") == 2


@pytest.mark.slow
def test_profilers_repeat_as_well_as_they_were_made_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = made.lira_map(tmp_path / "set", {"1ccf": (0, 0.1), "85e7": (20, 0.1), "e9ef": (0, 0.2)})
    ten, hundred, _ = reported(capsys, "lira-map", folder)["tables"]
    named = {(row[0], row[1]): dict(zip(ten["columns"], row, strict=True)) for row in ten["rows"]}
    iri = [one["value"] for one in json.loads((folder / "trip_iri_1ccf.json").read_text())["path"]["data"]]
    # Logarithms off by a and b each: they differ by the root of a^2 + b^2, whatever the road.
    for name, off in (("85e7 against 1ccf", np.hypot(0.1, 0.1)), ("e9ef against 1ccf", np.hypot(0.1, 0.2))):
        expected = 1 - off**2 / np.var(np.log(iri))
        assert named[name, "nearest cells"]["R2 of log IRI"] == pytest.approx(expected, abs=0.05)
        assert named[name, "aligned, each 200 m moved by up to 4 m"]["R2"] > named[name, "aligned"]["R2"] - 0.01
    assert all(row[3] > other[3] for row, other in zip(hundred["rows"], ten["rows"], strict=True))


@pytest.mark.slow
def test_a_minute_of_comma2k19_becomes_rows_and_a_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    road = made.surveyed(1)
    found = reported(capsys, "comma2k19", made.comma2k19(tmp_path / "set", road, late_s=0.3, faster_mps=0.2))
    table, speed = found["tables"]
    assert [row[2] for row in speed["rows"]] == pytest.approx([0.3, 0.2, 0.0], abs=0.011)
    known = [dict(zip(table["columns"], row, strict=True)) for row in table["rows"]]
    first = np.array([row["latitude [deg]"] for row in known])
    at_m = np.radians(first - road.lat_deg) / np.cos(made.HEADING_RAD) * made.EARTH_M
    truth = made.golden_car_iri(road.elevation_m, made.SPACING_M, 1.0)
    exact = np.array([truth[round(at - 12.5): round(at + 12.5)].mean() for at in at_m])
    ours = np.array([row["IRI [m/km]"] for row in known])
    assert np.median(np.abs(ours - exact)) < 0.4
    assert found["figures"][0]["x"] == "east [m]"


@pytest.mark.slow
def test_the_size_of_gravity_tells_the_unit_of_a_car(lira_cd: Path, tmp_path: Path) -> None:
    import h5py

    cars = tmp_path / "platoon_CPH1_HH.hdf5"
    shutil.copy(lira_cd / "AutoPi_CAN" / cars.name, cars)
    (in_g,), _ = recordings(cars)
    with h5py.File(cars, "a") as file:
        file["GM/16006/pass_1/acc.xyz"][:, 1:] *= made.GRAVITY_MPS2
    (in_mps2,), _ = recordings(cars)
    assert (in_g.unit, in_mps2.unit) == ("g", "m/s2")


# --- what is not there, or something else ---


def refused(name: str, folder: Path) -> str:
    with pytest.raises(BadInput) as error:
        main(["study", name, str(folder)])
    text = str(error.value)
    assert "\n" not in text
    assert "expected" in text
    return text


@pytest.mark.parametrize(("name", "where"), [
    ("lira-cd", "10.11583/DTU.c.6337148"), ("zenodo-4386256", "10.5281/zenodo.4386256"),
    ("lira-map", "github.com/peacefulotter/LiRA-Map"), ("comma2k19", "github.com/commaai/comma2k19")])
def test_a_wrong_folder_says_where_to_download(name: str, where: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "empty").mkdir()
    for folder, found in (("nowhere", "nothing there"), ("file", "a file"), ("empty", "found none")):
        text = refused(name, tmp_path / folder)
        assert found in text
        assert where in text


def test_a_car_for_a_study_without_one_is_refused() -> None:
    with pytest.raises(BadInput, match="expected no --vehicle, found rav4-2009"):
        main(["study", "table-4-1", "--vehicle", "rav4-2009"])


def test_lira_cd_says_what_is_wrong(lira_cd: Path, tmp_path: Path) -> None:
    import h5py

    shutil.copytree(lira_cd, tmp_path / "set")
    folder = tmp_path / "set" / "ref_data"
    for name in ("cph1_iri_mpd_rut_hh.csv", "cph1_zp_hh.csv"):
        text = (folder / name).read_text("latin-1")
        (folder / name).unlink()
        assert name in refused("lira-cd", tmp_path / "set")
        (folder / name).write_text(text.replace("Distance [m]", "Metres"), "latin-1")
        assert f"{name}:1: expected a column Distance [m], found Metres" in refused("lira-cd", tmp_path / "set")
        (folder / name).write_text(text, "latin-1")
    cars = tmp_path / "set" / "AutoPi_CAN" / "platoon_CPH1_HH.hdf5"
    with h5py.File(cars, "a") as file:
        file.copy("GM/16006/pass_1", "GM/16006/pass_2")
        del file["GM/16006/pass_2/spd_veh"]
    found, left = recordings(cars)  # one bad pass among others is left out
    assert [one.name for one in found] == ["16006-pass_1"]
    assert left == ["16006-pass_2: expected spd_veh with 2 columns, found nothing"]
    with h5py.File(cars, "w") as file:
        file["else"] = 1
    assert "expected a group GM with the trips, found else" in refused("lira-cd", tmp_path / "set")
    cars.write_bytes(b"no such thing")
    assert "expected an HDF5 file" in refused("lira-cd", tmp_path / "set")
    cars.rename(cars.with_name("platoon_CPH1.hdf5"))
    assert "expected a name like platoon_CPH1_HH.hdf5" in refused("lira-cd", tmp_path / "set")


@pytest.mark.slow
def test_zenodo_says_what_is_wrong(zenodo: Path, tmp_path: Path) -> None:
    folder = tmp_path / "set"
    shutil.copytree(zenodo, folder)
    trip = folder / "phone-2019-0.mat"
    whole = {name: one for name, one in loadmat(trip).items() if not name.startswith("__")}
    for change, words in (({"z": "letters"}, "expected z to be numbers"), ({"z": np.ones(5)}, "of one length")):
        savemat(trip, whole | change)
        assert words in refused("zenodo-4386256", folder)
    del whole["speedMS"]
    savemat(trip, whole)
    assert "phone-2019-0.mat: expected an array speedMS, found" in refused("zenodo-4386256", folder)
    trip.write_bytes(b"nonsense")
    assert "phone-2019-0.mat: expected a .mat file" in refused("zenodo-4386256", folder)
    places = folder / "geopoint_Massachusetts_NB_INSIDE.mat"
    savemat(places, {"lat": np.ones(5)})
    assert "expected a geopoint, or arrays lat and lon, found lat" in refused("zenodo-4386256", folder)
    places.unlink()
    assert places.name in refused("zenodo-4386256", folder)


def test_lira_map_and_comma2k19_say_what_is_wrong(tmp_path: Path) -> None:
    folder = made.lira_map(tmp_path / "map", {"1ccf": (0, 0.1), "85e7": (0, 0.1), "e9ef": (0, 0.1)})
    (folder / "trip_iri_85e7.json").write_text('{"path": {"data": [{"pos": 1}]}}')
    assert "expected path.data with pos, timestamp (metres, growing) and value" in refused("lira-map", folder)
    segment = made.comma2k19(tmp_path / "comma", made.surveyed(1))
    accel = segment / "40" / "processed_log" / "IMU" / "accelerometer"
    (accel / "t").unlink()
    assert "expected an array of the segment, found nothing there" in refused("comma2k19", segment)
    with (accel / "t").open("wb") as file:
        np.save(file, np.zeros(3))
    assert "expected t (n,) and value (n, 3 or more), found (3,)" in refused("comma2k19", segment)
    (accel / "t").write_text("1 2 3")
    assert "expected an array of NumPy" in refused("comma2k19", segment)


def test_a_study_of_a_folder_needs_one() -> None:
    with pytest.raises(BadInput, match="study comma2k19: expected DIR, comma2k19"):
        main(["study", "comma2k19"])
    with pytest.raises(BadInput, match="expected a folder with comma2k19"):
        comma2k19.run(Workload())
