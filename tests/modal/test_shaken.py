"""Modes of shaken cars and frames: found, with errors that hold, and none made up; inputs that show nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.modal.analysis import find_modes

from .shaken import RATE_HZ, Shaken, matched, quarter_car, record, records


@pytest.mark.slow
@pytest.mark.parametrize("is_measured", [True, False])
def test_no_mode_is_made_up_and_errors_hold(is_measured: bool) -> None:
    """Without noise, and with noise as loud as the signal."""
    for one in (record("car", quarter_car(400.0, 1500.0), share, 7, 60.0) for share in (0.0, 1.0)):
        modes = find_modes(one.samples, RATE_HZ, one.inputs if is_measured else None, decay=False).modes
        pairs, extra = matched(one, modes)
        assert extra == 0
        assert None not in pairs
        for (hz, ratio), mode in zip(one.true.tolist(), pairs, strict=True):
            assert abs(mode.frequency_hz - hz) < 4 * mode.frequency_std_hz + 1e-6 < 0.2 * hz
            assert abs(mode.damping_ratio - ratio) < 4 * mode.damping_std + 1e-6 < 0.9 * ratio


@pytest.mark.slow
def test_nine_floors_in_noise() -> None:
    for one in (one for one in records(range(1)) if "nine" in one.name):
        modes = find_modes(one.samples, RATE_HZ, one.inputs).modes
        pairs, extra = matched(one, modes)
        assert extra == 0
        assert sum(mode is not None for mode in pairs) >= (7 if "noise 1" in one.name else 9)


def written(path: Path, one: Shaken) -> str:
    t_s = np.arange(len(one.samples)) / RATE_HZ
    np.savetxt(path, np.column_stack([t_s, one.samples, one.inputs]), "%.7g", ",", comments="",
               header="t_s," + ",".join("abc"[:one.samples.shape[1]]) + ",u")
    return str(path)


def test_the_command_finds_both_modes_of_a_car(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path / "car.csv", record("car", quarter_car(400.0, 1500.0), 0.1, 1, 60.0))
    assert main(["modes", file, "--input", "u"]) == 0
    text = capsys.readouterr().out
    assert "beside its measured input" in text
    assert text.count("±") == 5  # two modes of two figures, and the sentence about them
    for method in ("era", "decrement"):
        with pytest.raises(BadInput, match=f"expected a free decay for --method {method}.*--method ssi"):
            main(["modes", file, "--columns", "a", "--method", method])


SECONDS = np.arange(6000) / RATE_HZ


@pytest.mark.parametrize(("inputs", "frequencies", "order"), [
    (np.sin(2 * np.pi * 0.3 * SECONDS), 1, 2), (5 + np.sin(2 * np.pi * 0.3 * SECONDS).round(3), 1, 2),
    (np.sin(2 * np.pi * 0.3 * SECONDS) + np.sin(2 * np.pi * 3 * SECONDS), 2, 4)])
def test_an_input_of_few_frequencies_is_refused_in_words(inputs: np.ndarray, frequencies: int, order: int) -> None:
    motion = 0.5 * np.roll(inputs, 20)[:, None]
    with pytest.raises(ValueError, match=f"found {frequencies} .*order of excitation is {order}.*sweep or noise"):
        find_modes(motion, RATE_HZ, inputs[:, None])


@pytest.mark.parametrize("kind", ["switched", "swept", "three sines"])
def test_an_input_that_excites_is_taken(kind: str) -> None:
    inputs = {"switched": np.sign(np.random.default_rng(1).standard_normal(6000)),
              "swept": np.sin(2 * np.pi * (0.1 + 0.08 * SECONDS) * SECONDS),
              "three sines": np.sin(2 * SECONDS) + np.sin(8 * SECONDS) + np.sin(5 * SECONDS)}[kind]
    motion, pole = np.zeros(6000), np.exp((-0.18 + 1j * np.sqrt(1 - 0.18**2)) * 2 * np.pi * 0.8 / RATE_HZ)
    for k in range(2, 6000):
        motion[k] = 2 * pole.real * motion[k - 1] - abs(pole) ** 2 * motion[k - 2] + inputs[k - 1]
    mode, = find_modes(motion[:, None], RATE_HZ, inputs[:, None]).modes
    assert mode.frequency_hz == pytest.approx(0.8, rel=0.02)
    assert mode.damping_ratio == pytest.approx(0.18, rel=0.05)


def test_channels_that_are_sums_of_others_are_refused() -> None:
    noise = np.random.default_rng(1).standard_normal((3000, 2))
    with pytest.raises(ValueError, match="a combination of others"):
        find_modes(np.column_stack([noise, noise[:, 0] - 2 * noise[:, 1]]), RATE_HZ)
