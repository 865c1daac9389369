"""Whole commands on files in which fields were changed; ``tests/benchmarks/fuzz.py`` runs more of the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger import bounds
from logger.errors import BadInput

from ..support.command import called
from ..support.fuzz.command_targets import COMMAND_TARGETS
from ..support.fuzz.field_targets import table
from ..support.fuzz.mutation import fuzz
from ..support.fuzz.targets import Workshop

T = np.arange(600) / 100
NOISE = np.random.default_rng(1).standard_normal(600)
SOONER = ("command:iri", "command:comfort", "command:simulate", "command:convert")


@pytest.mark.parametrize("name", [*SOONER, *(pytest.param(name, marks=pytest.mark.slow)
                                             for name in COMMAND_TARGETS if name not in SOONER)])
def test_a_changed_field_ends_in_an_answer_or_one_line(name: str) -> None:
    with Workshop() as folder:
        tally = fuzz(COMMAND_TARGETS[name](folder), seed=2, inputs=10)
    assert not tally.failures, tally.failures[:3]
    assert tally.accepted > 0


@pytest.mark.parametrize("size", [1e-320, 1e-160, 1e-12])
def test_readings_below_what_any_sensor_resolves_are_none(tmp_path: Path, size: float) -> None:
    """``estimate`` ended in a division by the square of such a number."""
    (tmp_path / "drive.csv").write_bytes(table("t_s,accel_z_mps2,speed_mps,distance_m", T, size * NOISE, 15 + 0 * T,
                                               15 * T))
    for words in ((), ("--resample",), ("--noise", "auto")):
        done = called("estimate", tmp_path / "drive.csv", "--vehicle", "rav4-2009", *words)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert "expected accelerations that vary, found 0 m/s2 throughout" in done.stderr


@pytest.mark.parametrize(("step_s", "words"), [(1e-8, "samples a second"), (1e-12, ""), (1e-320, ""), (1e7, "")])
def test_a_clock_that_no_recorder_has_takes_no_memory(tmp_path: Path, step_s: float, words: str) -> None:
    """A filter from 1e8 Hz to 100 Hz would take gigabytes."""
    times_s = step_s * (np.arange(600) + 0.1 * np.sin(np.arange(600)))
    (tmp_path / "ride.csv").write_bytes(table("time,ax,ay,az", times_s, NOISE, NOISE[::-1], 9.8 + NOISE))
    done = called("extract", "--csv", tmp_path / "ride.csv", "--columns", "t=time:s,x=ax:m/s2,y=ay:m/s2,z=az:m/s2",
                  "--speed", "15", "--out", tmp_path / "runs")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "ride.csv" in done.stderr and words in done.stderr


def test_a_quantity_has_a_largest_and_a_least_size() -> None:
    values = np.array([0.0, 1e-320, -1e-10, 1e-9, -5.0, 1e6])
    assert bounds.ACCELERATION.taken("a", values, str).tolist() == [0.0, 0.0, 0.0, 1e-9, -5.0, 1e6]
    for wrong in (1e7, -np.inf, np.nan):
        with pytest.raises(BadInput, match=r"^f:2: expected a within"):
            bounds.ACCELERATION.taken("a", np.array([0.0, wrong]), lambda row: f"f:{row + 1}")
    assert bounds.samples_between(10.0, 0.1, "x") == 100
    for span, step in ((1e9, 1.0), (1.0, 1e-320), (np.inf, 1.0), (np.nan, 1.0)):
        with pytest.raises(BadInput, match=r"^x: expected at most"):
            bounds.samples_between(span, step, "x")
