"""Public records of test rigs as people run them, on records of our own with their layout and a known truth."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.signal import chirp

from logger.api.data_sets import columns_in
from logger.api.rigs import emps, silverbox
from logger.commands.main import main
from logger.errors import BadInput

MASS, SPRING, DAMPER, CUBIC = 5.4e-6, 1.0, 2.2e-4, 4.0
AXIS_KG, VISCOUS, COULOMB_N, OFFSET_N = 95.0, 204.0, 20.0, -3.0
_FINER = 8


def hardening(force_n: np.ndarray, rate_hz: float) -> np.ndarray:
    """Places (n,) of a mass on a spring that hardens, by Runge and Kutta's fourth order, by its force at each of
    2 _FINER parts of a sample (2 n _FINER,)."""
    step_s, place_m, rate_mps, found = 1 / (rate_hz * _FINER), 0.0, 0.0, [0.0]

    def slope(force: float, at: float, rate: float) -> tuple[float, float]:
        return rate, (force - SPRING * at - CUBIC * at**3 - DAMPER * rate) / MASS

    force = force_n.tolist()
    for number in range(0, len(force) - 2, 2):
        first, middle, last = force[number : number + 3]
        a = slope(first, place_m, rate_mps)
        b = slope(middle, place_m + step_s * a[0] / 2, rate_mps + step_s * a[1] / 2)
        c = slope(middle, place_m + step_s * b[0] / 2, rate_mps + step_s * b[1] / 2)
        d = slope(last, place_m + step_s * c[0], rate_mps + step_s * c[1])
        place_m += step_s * (a[0] + 2 * b[0] + 2 * c[0] + d[0]) / 6
        rate_mps += step_s * (a[1] + 2 * b[1] + 2 * c[1] + d[1]) / 6
        found.append(place_m)
    return np.array(found[::_FINER])


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """SNLS80mV.csv as it is laid out: names between quotation marks, a comma at each end. Where no part of the study
    looks, nothing moves. The drive has nothing above 200 Hz, also between its samples."""
    rng = np.random.default_rng(1)
    volts = np.zeros((silverbox.TEST.stop, 2))
    for part in (silverbox.ARROW, slice(silverbox.FIT.start, silverbox.FIT.start + 6000), silverbox.TEST):
        count = part.stop - part.start
        hz = np.fft.rfftfreq(count, 1 / silverbox.RATE_HZ)
        drive = np.fft.irfft(np.where((hz > 0) & (hz < 200), np.fft.rfft(rng.standard_normal(count)), 0),
                             2 * _FINER * count)
        drive *= 0.022 / drive.std() * (np.linspace(0, 2.0, len(drive)) if part == silverbox.ARROW else 1.0)
        volts[part] = np.column_stack([drive[::2 * _FINER], hardening(drive, silverbox.RATE_HZ)])
    volts[:, 1] += rng.normal(0, 2e-4, len(volts))
    folder = tmp_path_factory.mktemp("box") / "SilverboxFiles"
    folder.mkdir()
    lines = [f"{one:.5g},{two:.5g}," for one, two in volts]
    (folder / "SNLS80mV.csv").write_text('"V1","V2",\n' + "\n".join(lines) + "\n")
    return folder


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """DATA_EMPS.mat as it is laid out: the drive's volts and the encoder's place."""
    rng = np.random.default_rng(2)
    time_s = np.arange(0, 10, 1 / emps.RATE_HZ)
    place_m = 0.08 * np.sin(2 * np.pi * 0.4 * time_s) + 0.002 * chirp(time_s, 1.0, 10.0, 8.0)
    rate_mps = np.gradient(place_m, time_s)
    force_n = (AXIS_KG * np.gradient(rate_mps, time_s) + VISCOUS * rate_mps + COULOMB_N * np.sign(rate_mps) + OFFSET_N
               + rng.normal(0, 1.0, len(time_s)))
    folder = tmp_path_factory.mktemp("emps")
    savemat(folder / "DATA_EMPS.mat", {"vir": force_n[:, None] / emps.DRIVE_N_PER_V, "qm": place_m[:, None],
                                       "t": time_s[:, None]})
    return folder


@pytest.mark.slow
def test_the_silverbox_study_names_the_spring_and_simulates_its_tests(
        box: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "box.html"
    assert main(["study", "silverbox", str(box), "--quick", "--out", str(page), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    errors, effects = found["tables"][2:4]
    *_, linear, better = errors["rows"]
    assert max(better[1:]) < 0.5  # mV; the noise is 0.2
    assert min(linear[1:]) > 4 * max(better[1:])
    cubic = next(row for row in effects["rows"] if row[1] == "cubic_stiffness_n_per_m3")
    assert cubic[2] == pytest.approx(CUBIC, abs=4 * cubic[3])
    assert page.read_text().count("<svg") == 6


@pytest.mark.slow
def test_the_emps_study_names_friction_and_finds_the_axis(axis: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["study", "emps", str(axis), "--json"])  # its numbers are not the published ones
    found = json.loads(capsys.readouterr().out)
    numbers = next(table for table in found["tables"] if table["title"] == "Parameters of the axis")
    for row, truth in zip(numbers["rows"], (AXIS_KG, VISCOUS, COULOMB_N), strict=True):
        assert row[2] == pytest.approx(truth, rel=0.01), row


def refused(name: str, folder: Path) -> str:
    with pytest.raises(BadInput) as error:
        main(["study", name, str(folder)])
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("name", ["silverbox", "emps"])
def test_a_wrong_folder_says_where_to_download(name: str, tmp_path: Path) -> None:
    for folder, found in (("nowhere", "nothing there"), (".", "found none")):
        text = refused(name, tmp_path / folder)
        assert found in text
        assert "nonlinearbenchmark.org" in text


def test_a_wrong_file_is_one_line(tmp_path: Path) -> None:
    record = tmp_path / "SNLS80mV.csv"
    for text, words in (("V1,V3\n1,2\n", "SNLS80mV.csv:1: expected a column V2, found V1; V3"),
                        ("V1,V2\n1,2\n3,\n", "expected a number in every row"),
                        ("V1,V2\n1,2\n3,4\n", "expected 127400 samples or more, found 2")):
        record.write_text(text)
        assert words in refused("silverbox", tmp_path)
    record.unlink()
    (tmp_path / "SNLS80mV.csv.gz").write_bytes(gzip.compress(b"V1,V2\n1,2\n3,4\n")[:-4])
    assert "expected a file packed by gzip" in refused("silverbox", tmp_path)
    savemat(tmp_path / "DATA_EMPS.mat", {"vir": np.ones(9), "qm": np.ones(8)})
    assert "expected columns of one length, found 9, 8" in refused("emps", tmp_path)


def test_a_table_and_matlab_s_file_read_alike(tmp_path: Path) -> None:
    values = np.random.default_rng(3).normal(size=(2, 50))
    names = {"csv": ("vir_V", "qm_m"), "mat": ("vir", "qm")}
    savemat(tmp_path / "one.mat", {"vir": values[0][:, None], "qm": values[1][:, None]})
    rows = "\n".join(",".join(f"{one:.17g}" for one in row) for row in values.T)
    (tmp_path / "two.csv").write_text(f"vir_V,qm_m\n{rows}\n")
    (tmp_path / "three.csv.gz").write_bytes(gzip.compress((tmp_path / "two.csv").read_bytes()))
    for pattern in ("one.*", "two.*", "three.*"):
        assert np.array_equal(columns_in(tmp_path, pattern, "a record", names), values)
