"""Records that are not what they seem, at the command line: refused with the option that mends them, or reported."""

from __future__ import annotations

import json
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from ..support.command import called
from ..support.drives.records import at, held, ride, rounded, write_record

SECONDS = 40
FINE = ride(SECONDS + 2, np.random.default_rng(5), 0.6)
EVEN_S = np.arange(1, SECONDS, 0.01)


@pytest.fixture
def comfort(tmp_path: Path):
    """Exit status, JSON or none, and lines on stderr of ``ridelog comfort`` on a record."""

    def run(t_s: np.ndarray, accel: np.ndarray, *arguments: str) -> tuple[int, dict, list[str]]:
        path = write_record(tmp_path / "ride.csv", t_s, accel_z_mps2=accel)
        done = called("comfort", path, "--json", *arguments)
        return done.returncode, json.loads(done.stdout or "{}"), done.stderr.splitlines()

    return run


@pytest.mark.parametrize("step", [0.0, 0.0383, 0.098, 0.613])
@pytest.mark.parametrize("level", [0.0, 9.81])
def test_a_good_record_is_not_doubted(comfort, step: float, level: float) -> None:
    status, reported, complaints = comfort(EVEN_S, rounded(at(EVEN_S, FINE) + level, step))
    assert (status, reported["doubts"], reported["resampled"], complaints) == (0, [], None, [])


def test_a_standing_car_is_not_refused(comfort) -> None:
    status, reported, _ = comfort(EVEN_S, np.full(len(EVEN_S), 9.8))
    assert (status, reported["a_w_mps2"]) == (0, pytest.approx(0, abs=1e-9))


@pytest.mark.parametrize("taken_hz", [51, 90])
def test_repeated_samples_are_refused_and_dropped(comfort, taken_hz: float) -> None:
    taken_s = np.arange(1, SECONDS, 1 / taken_hz)
    honest = comfort(taken_s, rounded(at(taken_s, FINE), 0.0192), "--resample", "100")[1]
    t_s, values = held(FINE, taken_s, 200, 0.0192)
    status, _, complaints = comfort(t_s, values)
    assert (status, len(complaints)) == (2, 1)
    assert "ride.csv: expected every sample to be a new measurement, found" in complaints[0]
    assert f"({taken_hz} Hz written at 200): --resample drops the repeats" in complaints[0]
    status, reported, complaints = comfort(t_s, values, "--resample", "100")
    assert (status, complaints) == (0, [])
    assert reported["a_w_mps2"] == pytest.approx(honest["a_w_mps2"], rel=0.01)
    assert reported["resampled"]["from_hz"] == pytest.approx(taken_hz, rel=1e-3)
    assert reported["resampled"]["repeats_dropped"] == pytest.approx(1 - taken_hz / 200, abs=0.03)
    assert reported["unseen_from_hz"] == pytest.approx(taken_hz / 2, rel=1e-3)


def test_values_in_g_are_refused_and_converted(comfort) -> None:
    right = comfort(EVEN_S, at(EVEN_S, FINE))[1]
    in_g = 0.995 + at(EVEN_S, FINE) / 9.80665
    status, _, complaints = comfort(EVEN_S, in_g)
    assert (status, len(complaints)) == (2, 1)
    assert "found a mean of 0.995, as of gravity in g: --unit g" in complaints[0]
    status, reported, complaints = comfort(EVEN_S, in_g, "--unit", "g")
    assert (status, complaints) == (0, [])
    assert reported["a_w_mps2"] == pytest.approx(right["a_w_mps2"], rel=1e-4)
    assert comfort(EVEN_S, in_g, "--unit", "mps2")[0] == 0
    status, reported, complaints = comfort(EVEN_S, in_g - 0.995)
    assert (status, [doubt["what"] for doubt in reported["doubts"]], len(complaints)) == (0, ["quiet"], 1)
    assert "is it in g?" in complaints[0]
    assert "did the car stand?" in comfort(EVEN_S, in_g - 0.995 + 9.8)[2][0]  # gravity shows that it is in m/s2


@pytest.mark.parametrize("level", [9.81, 0.1])
def test_a_record_that_never_changes_is_reported(comfort, level: float) -> None:
    status, reported, complaints = comfort(EVEN_S, np.full_like(EVEN_S, level))
    assert (status, [doubt["what"] for doubt in reported["doubts"]], len(complaints)) == (0, ["constant"], 1)
    assert f"every sample of accel_z_mps2 is {level:.4g} m/s2" in complaints[0]


def test_a_record_of_zeros_is_refused(comfort) -> None:
    status, _, complaints = comfort(EVEN_S, np.zeros_like(EVEN_S))
    assert (status, len(complaints)) == (2, 1)
    assert "found 0 m/s2 throughout" in complaints[0]


def test_a_file_behind_the_bare_option_is_no_rate() -> None:
    done = called("comfort", "--resample", "ride.csv")
    assert done.returncode == 2
    assert "--resample ride.csv: expected a rate in Hz; put the file before --resample" in done.stderr


def test_the_end_of_a_range_is_reported(comfort) -> None:
    status, reported, complaints = comfort(EVEN_S, np.clip(at(EVEN_S, FINE), -5, 0.9))
    assert (status, len(complaints)) == (0, 1)
    assert "samples of accel_z_mps2 are at 0.9 m/s2, the end of a range" in complaints[0]
    assert reported["doubts"][0]["at_mps2"] == 0.9


@pytest.mark.parametrize(("t_s", "words"), [
    (EVEN_S + 0.003 * np.random.default_rng(1).uniform(-1, 1, len(EVEN_S)), "found a step of"),
    (EVEN_S * (1 + 1e-5 * EVEN_S), "the clock drifts"),
])
def test_uneven_times_are_refused_and_laid_on_a_grid(comfort, t_s: np.ndarray, words: str) -> None:
    right = comfort(EVEN_S, at(EVEN_S, FINE))[1]
    status, _, complaints = comfort(t_s, at(t_s, FINE))
    assert (status, len(complaints)) == (2, 1)
    assert words in complaints[0]
    assert "--resample" in complaints[0]
    status, reported, complaints = comfort(t_s, at(t_s, FINE), "--resample")
    assert (status, complaints) == (0, [])
    assert reported["a_w_mps2"] == pytest.approx(right["a_w_mps2"], rel=0.01)


def test_bursts_are_refused_and_spread(comfort) -> None:
    right = comfort(EVEN_S, at(EVEN_S, FINE))[1]
    arrived_s = np.ceil(EVEN_S * 12 - 1e-9) / 12
    status, _, complaints = comfort(arrived_s, at(EVEN_S, FINE))
    assert (status, "--resample" in complaints[0]) == (2, True)
    status, reported, _ = comfort(arrived_s, at(EVEN_S, FINE), "--resample")
    assert status == 0
    assert reported["a_w_mps2"] == pytest.approx(right["a_w_mps2"], rel=0.01)


def test_what_cannot_be_mended_is_refused_all_the_same(comfort) -> None:
    hole_s = np.where(EVEN_S < 20, EVEN_S, EVEN_S + 3)
    assert "expected no gap above 0.5 s, found one of 3.01 s" in comfort(hole_s, at(EVEN_S, FINE), "--resample")[2][0]
    back_s = EVEN_S.copy()
    back_s[500] -= 1
    assert "ride.csv:502: expected no time before" in comfort(back_s, at(EVEN_S, FINE), "--resample")[2][0]
    assert comfort(EVEN_S, at(EVEN_S, FINE), "--resample", "3")[0] == 2


@pytest.mark.slow
def test_estimate_refuses_and_mends_as_well(tmp_path: Path) -> None:
    road, drive = tmp_path / "road.csv", tmp_path / "drive.csv"
    called("road", "generate", "--class", "B", "--length", "400", "--out", road).check_returncode()
    called("simulate", "--vehicle", "rav4-2009", "--profile", road, "--speed", "15", "--noise", "0.05", "--out",
           drive).check_returncode()

    def estimate(*arguments: str) -> CompletedProcess[str]:
        return called("estimate", drive, "--vehicle", "rav4-2009", "--json", *arguments)

    right = json.loads(estimate().stdout)
    assert right["doubts"] == []
    t_s, accel, speed_mps, distance_m = np.loadtxt(drive, delimiter=",", skiprows=1).T
    twice_s = np.arange(2 * len(t_s) - 1) / 200
    write_record(drive, twice_s, accel_z_mps2=np.repeat(accel, 2)[:-1], speed_mps=np.interp(twice_s, t_s, speed_mps),
                 distance_m=np.interp(twice_s, t_s, distance_m))
    refused = estimate()
    assert refused.returncode == 2
    assert "(100 Hz written at 200): --resample drops the repeats" in refused.stderr
    mended = json.loads(estimate("--resample").stdout)
    assert mended["iri_m_per_km"] == pytest.approx(right["iri_m_per_km"], rel=0.01)


def test_a_sensor_that_stood_still_for_a_while_left_a_hole(comfort) -> None:
    samples = rounded(at(EVEN_S, FINE), 0.001)
    still = samples.copy()
    still[1000:2000] = still[1000]
    status, _, complaints = comfort(EVEN_S, still)
    assert (status, len(complaints)) == (2, 1)
    assert "ride.csv:1003: expected no gap above 0.5 s, found a sensor frozen" in complaints[0]
    short = samples.copy()
    short[1000:1030] = short[1000]
    status, reported, _ = comfort(EVEN_S, short)
    assert (status, [one["what"] for one in reported["doubts"]]) == (0, ["held"])
    status, _, complaints = comfort(EVEN_S, samples[np.arange(len(samples)) // 100 * 100])
    assert status == 2
    assert "(1 Hz written at 100)" in complaints[0]


def test_an_axis_that_stands_still_has_no_verdict_and_is_named(tmp_path: Path) -> None:
    """What a filter makes of a constant is its rounding."""
    z = at(EVEN_S, FINE)
    path = write_record(tmp_path / "ride.csv", EVEN_S, accel_x_mps2=np.full(len(z), 0.05),
                        accel_y_mps2=np.full(len(z), 9.81), accel_z_mps2=z)
    alone = json.loads(called("comfort", write_record(tmp_path / "z.csv", EVEN_S, accel_z_mps2=z), "--json").stdout)
    for more in ((), ("--unit", "mps2"), ("--resample", "128")):
        done = called("comfort", path, "--json", *more)
        found = json.loads(done.stdout)
        assert [one["axis"] for one in found["doubts"] if one["what"] == "constant"] == ["accel_x_mps2", "accel_y_mps2"]
        for axis in "xy":
            assert found["axes"][axis]["a_w_mps2"] == 0
            assert found["axes"][axis]["crest_factor"] is None
        assert done.stderr.count("a sensor that works shows some noise") == 2
    shown = called("comfort", path).stdout
    assert "Report x" not in shown and "y:" not in shown
    assert found["a_w_mps2"] == pytest.approx(alone["a_w_mps2"], rel=0.01)


def test_an_axis_that_stands_still_for_a_while_is_named(tmp_path: Path) -> None:
    x, z = (rounded(np.roll(at(EVEN_S, FINE), places), 0.001) for places in (700, 0))
    x[1000:2000] = x[1000]
    path = write_record(tmp_path / "ride.csv", EVEN_S, accel_x_mps2=x, accel_y_mps2=z[::-1], accel_z_mps2=z)
    (doubt,) = json.loads(called("comfort", path, "--json").stdout)["doubts"]
    assert (doubt["what"], doubt["axis"]) == ("held", "accel_x_mps2")
    assert doubt["seconds"] == pytest.approx(10.0, abs=0.05)


def test_what_a_run_says_of_itself_is_heard_of_its_folder_and_of_its_drive(tmp_path: Path) -> None:
    t_s = np.arange(0, 20, 1 / 59.36)
    phone = write_record(tmp_path / "phone.csv", t_s, accel_x_mps2=0.05 * at(t_s + 1, FINE),
                         accel_y_mps2=0.05 * at(t_s + 2, FINE), accel_z_mps2=9.81 + at(t_s + 1, FINE))
    assert called("extract", "--csv", phone, "--speed", "10", "--out", tmp_path).returncode == 0
    run = tmp_path / "phone"
    by_phone = json.loads(called("comfort", phone, "--json", "--resample").stdout)["unseen_from_hz"]
    assert by_phone == pytest.approx(59.36 / 2, rel=1e-3)
    for given in (run, run / "drive.csv"):
        assert json.loads(called("comfort", given, "--json").stdout)["unseen_from_hz"] == pytest.approx(by_phone)
    (run / "run.yaml").write_text("pass_band_hz: [0, 20]\n")
    assert json.loads(called("comfort", run, "--json").stdout)["unseen_from_hz"] == 20


def test_marks_of_a_drive_are_heard(tmp_path: Path) -> None:
    z, usable = at(EVEN_S, FINE), np.ones(len(EVEN_S))
    usable[100:400], usable[500] = 0, 2
    path = write_record(tmp_path / "drive.csv", EVEN_S, accel_z_mps2=z, usable=usable)
    doubts = json.loads(called("comfort", path, "--json").stdout)["doubts"]
    assert [one["what"] for one in doubts] == ["holes", "range_end"]


def test_a_folder_stands_for_the_file_in_it_or_is_refused_in_words(tmp_path: Path) -> None:
    run, empty = tmp_path / "run", tmp_path / "empty"
    run.mkdir()
    empty.mkdir()
    write_record(run / "drive.csv", EVEN_S, accel_z_mps2=at(EVEN_S, FINE))
    at_m = 0.25 * np.arange(800)
    (run / "profile.csv").write_text("distance_m,elevation_m\n" + "\n".join(
        f"{one:.2f},{0.01 * np.sin(one):.5f}" for one in at_m))
    for words, name in ((("comfort",), "drive.csv"), (("modes", "--method", "ssi"), "drive.csv"),
                        (("iri",), "profile.csv"), (("road", "classify"), "profile.csv")):
        of_folder, of_file = (called(*words, place, "--json") for place in (run, run / name))
        assert of_folder.returncode == 0, (words, of_folder.stderr)
        assert of_folder.stdout == of_file.stdout
        refused = called(*words, empty)
        assert refused.returncode == 2
        assert f"or a folder with {name}, found a folder without it" in refused.stderr


def test_modes_refuses_sensors_that_stood_still_for_a_while(tmp_path: Path) -> None:
    top, middle = (rounded(np.roll(at(EVEN_S, FINE), places), 0.001) for places in (0, 300))
    for one in (top, middle):
        one[1000:2000] = one[1000]
    path = write_record(tmp_path / "tower.csv", EVEN_S, top=top, middle=middle)
    done = called("modes", path, "--method", "ssi")
    assert done.returncode == 2
    assert "tower.csv:1003: expected no gap above 0.5 s, found a sensor frozen on all axes" in done.stderr


def test_a_record_that_begins_with_a_sensor_at_rest_is_doubted(tmp_path: Path) -> None:
    axes = [rounded(np.roll(at(EVEN_S, FINE), places), 0.001) for places in (0, 300, 600)]
    for one in axes:
        one[:1000] = one[0]
    path = write_record(tmp_path / "record.csv", EVEN_S, accel_z_mps2=axes[0], accel_x_mps2=axes[1],
                        accel_y_mps2=axes[2])
    done = called("comfort", path, "--json")
    assert done.returncode == 0, done.stderr
    held = [one["seconds"] for one in json.loads(done.stdout)["doubts"] if one["what"] == "held"]
    assert held == [pytest.approx(10, abs=0.02)]
    assert "is frozen on all axes for the first" in done.stderr
