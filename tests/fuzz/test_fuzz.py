"""A short seeded run of the fuzzer over every reader, and what must take neither time nor memory however large it is.

``tests/benchmarks/fuzz.py`` runs the same for as long as one likes.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from ..support.fuzz import huge_inputs
from ..support.fuzz.field_targets import FIELD_TARGETS
from ..support.fuzz.mutation import Counts, fuzz, read_counts
from ..support.fuzz.targets import TARGETS as BYTE_TARGETS
from ..support.fuzz.targets import Workshop

TARGETS = {**BYTE_TARGETS, **FIELD_TARGETS}
INPUTS = {"vehicle_yaml": 250, "config_yaml": 300, "pasco_profile_yaml": 250, "pasco_ps2119": 300,
          "fields:phone_csv": 60, "fields:record_checks": 200, "fields:run_folder": 200, "fields:vehicle": 250}
MEMORY_MB = 150
ROOT = Path(__file__).resolve().parents[2]
HUGE_GB = 0.02
LONGEST_S = 20.0


@pytest.mark.parametrize("share", [pytest.param(0.1, id="a tenth"), pytest.param(1, id="all", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", TARGETS)
def test_damaged_input_is_refused_in_one_line_or_read_as_it_stands(name: str, share: float) -> None:
    with Workshop() as folder:
        tally = fuzz(TARGETS[name](folder), seed=1, inputs=round(share * INPUTS.get(name, 500)))
    assert not tally.failures, tally.failures[:3]
    assert tally.accepted > 0
    assert tally.memory_mb < MEMORY_MB


@pytest.mark.slow
def test_what_is_huge_outside_or_inside_takes_little_time_and_memory(tmp_path: Path) -> None:
    command = [sys.executable, "-m", huge_inputs.__name__, str(tmp_path), str(HUGE_GB)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    assert len(rows) > 25
    for name, _, seconds, _ in rows:
        assert float(seconds) < LONGEST_S, name
    assert int(rows[-1][3]) < MEMORY_MB


def test_counts_of_several_runs_add_up() -> None:
    with Workshop() as folder:
        target = TARGETS["bma220"](folder)
        runs = [Counts.of(fuzz(target, seed, inputs), 0.5) for seed, inputs in ((1, 30), (2, 50))]
    record = "\n".join(["noise", runs[0].line("bma220"), runs[0].line("nmea"), "", runs[1].line("bma220")])
    counts = read_counts(record)
    assert list(counts) == ["bma220", "nmea"]
    assert (counts["bma220"].inputs, counts["bma220"].accepted, counts["nmea"].inputs) == (80, 80, 30)
    assert counts["bma220"].seconds == pytest.approx(1.0)
    assert counts["bma220"].ends == max(run.ends for run in runs)
