"""``ridelog comfort`` as people and programs call it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.dsp.weightings import wb, wd, wf, wk
from logger.errors import BadInput
from logger.plugins import catalogue

from ..support.command import called

WEIGHTINGS = ", ".join(catalogue("logger.dsp.weightings", "WEIGHTING"))
AGREED = ["weighting", "a_w_mps2", "mtvv_mps2", "vdv_mps175", "crest_factor", "comfort"]
SINE_HZ = 6.3
AMPLITUDE_MPS2 = 1.2


def sine(path: Path, rate_hz: float, seconds: float = 60.0, axes: dict[str, float] | None = None) -> Path:
    """Whole seconds of a sine on each axis, as many m/s2 as named."""
    t_s = np.arange(round(rate_hz * seconds)) / rate_hz
    wave = np.sin(2 * np.pi * SINE_HZ * t_s)
    columns = {"t_s": t_s} | {f"accel_{axis}_mps2": size * wave
                              for axis, size in (axes or {"z": AMPLITUDE_MPS2}).items()}
    rows = [",".join(map(repr, row)) for row in np.column_stack(list(columns.values())).tolist()]
    path.write_text("\n".join([",".join(columns), *rows]))
    return path


def as_json(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict:
    assert main(["comfort", *map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def on_screen(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main(["comfort", *map(str, arguments)]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("rate_hz", [80.0, 100.0, 128.0, 500.0, 2000.0])
def test_a_sine_at_any_rate(tmp_path: Path, capsys: pytest.CaptureFixture[str], rate_hz: float) -> None:
    result = as_json(capsys, sine(tmp_path / "sine.csv", rate_hz))
    assert list(result)[:6] == AGREED
    rms = AMPLITUDE_MPS2 * abs(wk.WEIGHTING.response(SINE_HZ)) / np.sqrt(2)
    assert result["weighting"] == "wk"
    assert result["a_w_mps2"] == pytest.approx(rms, rel=2e-3)
    assert result["mtvv_mps2"] == pytest.approx(rms, rel=2e-2)
    assert result["vdv_mps175"] == pytest.approx(rms * np.sqrt(2) * (3 / 8 * 60) ** 0.25, rel=2e-3)
    assert result["crest_factor"] == pytest.approx(np.sqrt(2), rel=5e-2)  # the sine begins with a jolt
    assert result["comfort"] == "uncomfortable"
    assert result["report_beside_a_w"] == []
    assert result["unseen_from_hz"] == (pytest.approx(rate_hz / 2) if rate_hz < 160 else None)


@pytest.mark.parametrize(("name", "module"), [("wd", wd), ("wf", wf), ("wb", wb)])
def test_other_weightings(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, module: object) -> None:
    result = as_json(capsys, sine(tmp_path / "sine.csv", 100.0, 300.0), "--weighting", name)
    rms = AMPLITUDE_MPS2 * abs(module.WEIGHTING.response(SINE_HZ)) / np.sqrt(2)
    assert result["weighting"] == name
    if name == "wf":  # the sine is far above what makes sick: its beginning, a jolt, is most of it
        assert result["comfort"] is None
        assert result["msdv_mps15"] == pytest.approx(result["a_w_mps2"] * np.sqrt(300.0))
    else:
        assert result["a_w_mps2"] == pytest.approx(rms, rel=2e-3)
    assert (result["health"] is not None) == (name == "wd")


def test_three_axes_are_combined(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = sine(tmp_path / "ride.csv", 200.0, axes={"x": 1.0, "y": 0.5, "z": 0.2})
    result = as_json(capsys, path, "--daily-hours", "2")
    horizontal, vertical = (abs(w.WEIGHTING.response(SINE_HZ)) / np.sqrt(2) for w in (wd, wk))
    x, y, z = horizontal, 0.5 * horizontal, 0.2 * vertical
    assert {axis: figures["a_w_mps2"] for axis, figures in result["axes"].items()} == pytest.approx(
        {"x": x, "y": y, "z": z}, rel=3e-3)
    assert result["a_w_mps2"] == result["axes"]["z"]["a_w_mps2"]
    assert result["total_a_w_mps2"] == pytest.approx(np.sqrt(x**2 + y**2 + z**2), rel=3e-3)
    assert result["health_total_a_w_mps2"] == pytest.approx(np.sqrt(1.96 * (x**2 + y**2) + z**2), rel=3e-3)
    health = result["health"]
    assert (health["a8_axis"], health["vdv_axis"]) == ("x", "x")
    assert health["a8_mps2"] == pytest.approx(1.4 * x * np.sqrt(2 / 8), rel=3e-3)
    dose = 1.4 * x * np.sqrt(2) * (3 / 8 * 7200) ** 0.25
    assert health["daily_vdv_mps175"] == pytest.approx(dose, rel=5e-3)
    assert health["hours_to_a8_action"] == pytest.approx(8 * (0.5 / (1.4 * x)) ** 2, rel=1e-2)


def test_gravity_in_the_record_changes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = sine(tmp_path / "sine.csv", 100.0)
    rows = [line.split(",") for line in plain.read_text().splitlines()]
    lifted = tmp_path / "lifted.csv"
    lifted.write_text("\n".join(",".join(row) for row in [rows[0], *([t, repr(float(a) + 9.81)] for t, a in rows[1:])]))
    first, second = as_json(capsys, plain), as_json(capsys, lifted)
    assert [second[name] for name in AGREED[1:5]] == pytest.approx([first[name] for name in AGREED[1:5]])


def test_a_ride_with_a_blow_says_what_to_use(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t_s = np.arange(12_000) / 100
    wave = 0.3 * np.sin(2 * np.pi * 5 * t_s)
    wave[6000:6010] += 20.0
    path = tmp_path / "blow.csv"
    path.write_text("t_s,accel_z_mps2,note\n" + "".join(f"{t:.2f},{a:.6f},\n" for t, a in zip(t_s, wave, strict=True)))
    result = as_json(capsys, path)
    assert result["crest_factor"] > 9
    assert result["report_beside_a_w"] == ["mtvv", "vdv"]
    text = on_screen(capsys, path, "--daily-hours", "8")
    assert "a_w alone understates the ride, as there are shocks. Report z: MTVV and VDV as well." in text
    assert "above 50 Hz" in text
    assert "Health, for 8 h a day of this ride:" in text


def test_silence_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(BadInput, match="expected accelerations that vary, found 0 m/s2 throughout"):
        as_json(capsys, sine(tmp_path / "still.csv", 100.0, 5.0, {"z": 0.0}))


def test_axes_that_cannot_be_combined_are_mentioned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one_short = sine(tmp_path / "xz.csv", 100.0, 5.0, {"x": 1.0, "z": 1.0})
    assert "x and y together; left out" in on_screen(capsys, one_short)
    assert "axes" not in as_json(capsys, one_short)
    all_three = sine(tmp_path / "xyz.csv", 100.0, 5.0, {"x": 1.0, "y": 1.0, "z": 1.0})
    assert "left out" in on_screen(capsys, all_three, "--weighting", "wb")
    assert "over three axes" in on_screen(capsys, all_three)


@pytest.mark.parametrize(
    ("arguments", "rate_hz", "seconds", "complaint"),
    [
        (["--weighting", "none"], 100, 2, f"weighting 'none': expected one of {WEIGHTINGS}"),
        (["--daily-hours", "25"], 100, 2, "--daily-hours 25: expected 0.001 to 24 hours"),
        (["--daily-hours", "nan"], 100, 2, "--daily-hours nan: expected 0.001 to 24 hours"),
        ([], 50, 2, r"ride\.csv: expected at least 80 samples a second, found 50 \(--resample takes 40 or more\)"),
        ([], 39, 2, r"ride\.csv: expected at least 80 samples a second, found 39$"),
        ([], 100, 0.5, r"ride\.csv: expected at least 1 s, found 0\.5 s"),
    ],
)
def test_wrong_use(tmp_path: Path, arguments: list[str], rate_hz: float, seconds: float, complaint: str) -> None:
    path = sine(tmp_path / "ride.csv", rate_hz, seconds)
    with pytest.raises(BadInput, match=complaint):
        main(["comfort", str(path), *arguments])


def test_the_command_exits_2_with_one_line(tmp_path: Path) -> None:
    done = called("comfort", tmp_path / "none.csv", "--weighting", "none")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert WEIGHTINGS in done.stderr


def test_the_help_names_every_weighting(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["comfort", "--help"])
    assert f"one of {WEIGHTINGS} (default: wk)" in " ".join(capsys.readouterr().out.split())
