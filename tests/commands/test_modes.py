"""``ridelog modes`` as people and programs call it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput

from ..support.command import called

AGREED = ["frequency_hz", "damping_ratio", "frequency_std_hz", "damping_std"]


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(f"{value:.6f}" for value in row) + "\n" for row in rows.tolist()]
    path.write_text(",".join(columns) + "\n" + "".join(lines))
    return path


@pytest.fixture
def decay(tmp_path: Path) -> Path:
    """Two vibrations of 1.5 Hz, 2 %, and 6 Hz, 1 %, in two columns."""
    t_s = np.arange(1000) / 100
    slow, fast = (np.exp(-r * 2 * np.pi * f * t_s) * np.cos(2 * np.pi * f * np.sqrt(1 - r * r) * t_s)
                  for f, r in ((1.5, 0.02), (6.0, 0.01)))
    noise = 0.02 * np.random.default_rng(1).standard_normal((2, 1000))
    top, middle = slow + fast + noise[0], 0.5 * slow - fast + noise[1]
    return written(tmp_path / "decay.csv", {"t_s": t_s, "top": top, "middle": middle})


def as_json(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict:
    assert main(["modes", *map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_agreed_fields_and_shapes(decay: Path, capsys: pytest.CaptureFixture[str]) -> None:
    modes = as_json(capsys, decay, "--method", "era")["modes"]
    assert [list(mode)[:4] for mode in modes] == [AGREED, AGREED]
    assert [mode["frequency_hz"] for mode in modes] == pytest.approx([1.5, 6.0], rel=2e-3)
    assert [mode["damping_ratio"] for mode in modes] == pytest.approx([0.02, 0.01], rel=0.1)
    middle = [mode["shape"][1] for mode in modes]
    assert [part["channel"] for part in middle] == ["middle", "middle"]
    assert middle[0]["amplitude"] == pytest.approx(0.5, abs=0.02)
    assert abs(middle[1]["phase_deg"]) == pytest.approx(180, abs=3)


def test_a_table_for_a_person(decay: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(decay), "--method", "era"]) == 0
    text = capsys.readouterr().out
    assert "decay.csv: 10 s at 100 Hz, 2 channels" in text
    assert "free decay" in text
    assert "± is one standard deviation" in text
    assert "Rejected:" in text


def test_the_decrement(decay: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = as_json(capsys, decay, "--method", "decrement", "--columns", "top")["modes"]
    assert found[0]["damping_ratio"] == pytest.approx(0.02, abs=4 * found[0]["damping_std"])


def test_noise_has_no_modes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    noise = np.random.default_rng(2).standard_normal(3000)
    path = written(tmp_path / "noise.csv", {"t_s": np.arange(3000) / 100, "accel": noise})
    assert as_json(capsys, path)["modes"] == []
    with pytest.raises(BadInput, match="expected a free decay for --method era, found a motion that goes on"):
        main(["modes", str(path), "--method", "era"])
    assert main(["modes", str(path)]) == 0
    assert "No mode: nothing in this record exceeds noise" in capsys.readouterr().out


def test_an_input_column(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(3)
    force, motion = rng.standard_normal(3000), np.zeros(3000)
    pole = np.exp((-0.05 + 1j * np.sqrt(1 - 0.05**2)) * 2 * np.pi * 5 / 100)
    for k in range(2, 3000):
        motion[k] = 2 * pole.real * motion[k - 1] - abs(pole) ** 2 * motion[k - 2] + force[k - 1]
    path = written(tmp_path / "push.csv", {"t_s": np.arange(3000) / 100, "force": force, "accel": motion
                                           + 0.1 * rng.standard_normal(3000)})
    mode, = as_json(capsys, path, "--method", "n4sid", "--input", "force")["modes"]
    assert mode["frequency_hz"] == pytest.approx(5.0, abs=4 * mode["frequency_std_hz"])
    assert mode["damping_ratio"] == pytest.approx(0.05, abs=4 * mode["damping_std"])


@pytest.mark.parametrize(("arguments", "complaint"), [
    ([], "expected a FILE"),
    (["FILE", "--method", "arx"], "no longer offered.*expected --method n4sid with --input"),
    (["FILE", "--method", "fft"], "no longer offered.*expected --method ssi$"),
    (["FILE", "--method", "prony"], "--method prony: expected one of era, ssi, n4sid, decrement"),
    (["FILE", "--input", "top", "--method", "era"], "expected --method n4sid with it, found era"),
    (["FILE", "--method", "n4sid", "--input", "none"], "expected a column none, found top,middle"),
    (["FILE", "--columns", "top,side"], "csv:1: expected a header with t_s,top,side"),
    (["FILE", "--columns", "top", "--method", "n4sid", "--input", "top"], "the input not among them"),
    (["FILE", "--columns", "top,top"], "--columns top,top: expected names with commas between them, each once"),
    (["FILE", "--columns", ""], "expected names with commas"),
    (["FILE", "--from", "20"], "expected --from before --to, within 0 to 9.99 s"),
    (["FILE", "--from", "8", "--to", "2"], "expected --from before --to"),
    (["FILE", "--to", "0.5"], "expected at least 100 samples, found 51"),
    (["FILE", "--method", "decrement"], "expected one column"),
    (["--vehicle", "rav4-2009", "--method", "ssi"], "--method: expected a FILE with it, not --vehicle rav4-2009"),
    (["--vehicle", "rav4-2009", "--from", "0"], "--from: expected a FILE with it"),
])
def test_wrong_use(decay: Path, arguments: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        main(["modes", *(str(decay) if word == "FILE" else word for word in arguments)])


def test_records_that_will_not_do(tmp_path: Path) -> None:
    t_s = np.arange(200) / 100
    still = written(tmp_path / "still.csv", {"t_s": t_s, "a": np.sin(t_s), "b": np.ones(200)})
    with pytest.raises(BadInput, match=r"still.csv:2: expected b to move, found 1 throughout"):
        main(["modes", str(still)])
    t_s[100:] += 0.5
    with pytest.raises(BadInput, match=r"gap.csv:102: expected samples evenly 0.01 s apart"):
        main(["modes", str(written(tmp_path / "gap.csv", {"t_s": t_s, "a": np.sin(t_s)}))])
    held_s = np.arange(3000) / 100
    noise = np.repeat(np.random.default_rng(1).normal(size=(1000, 2)).round(3), 3, axis=0)
    held = written(tmp_path / "held.csv", {"t_s": held_s, "a": noise[:, 0], "b": noise[:, 1]})
    with pytest.raises(BadInput, match=r"held.csv: expected every sample to be a new measurement, found 67% that "
                                       "repeat"):
        main(["modes", str(held)])
    big = written(tmp_path / "big.csv", {"t_s": np.arange(9) / 100, "a": np.arange(9) * 1e12})
    with pytest.raises(BadInput, match=r"big.csv:4: expected a within 1e\+12, found 2e\+12"):
        main(["modes", str(big)])


def test_the_command_exits_2_with_one_line(tmp_path: Path) -> None:
    done = called("modes", tmp_path / "none.csv")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
