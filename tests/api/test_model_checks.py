"""Right input is not refused, whatever is missing from the model: a suspension that sticks shakes the body two to three
times as much as a free one, and above its bounce the other way."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from logger.api.bench import silent
from logger.api.model_checks import check_model
from logger.api.run_checks import lab_runs
from logger.commands.main import main
from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.vehicle_file import read_model


def stuck(tmp_path: Path, road: str, friction_n: int) -> SimulatedRuns:
    """A drive at walking pace over a smooth road, in a car whose suspension rubs so much that it hardly moves."""
    folder = tmp_path / "run"
    folder.mkdir()
    main(["road", "generate", "--class", road, "--length", "250", "--seed", "5", "--out", str(folder / "profile.csv")])
    main(["simulate", "--vehicle", "rav4-2009", "--profile", str(folder / "profile.csv"), "--speed", "6",
          "--effect", f"dry_friction:friction_force_n={friction_n}", "--out", str(folder / "drive.csv")])
    return lab_runs([folder])


@pytest.mark.parametrize(("road", "friction_n"), [("A", 200), ("A", 300), ("B", 500)])
def test_a_suspension_that_sticks_is_no_wrong_input(tmp_path: Path, road: str, friction_n: int) -> None:
    check_model("rav4-2009", read_model(vehicle_file("rav4-2009")), stuck(tmp_path, road, friction_n), silent)


def test_a_free_one_in_feet_or_upside_down_is_refused(tmp_path: Path) -> None:
    run, = stuck(tmp_path, "B", 5).runs
    for factor, words in ((-1.0, "upside down"), (1 / 0.3048, "ft/s2")):
        with pytest.raises(BadInput, match=words):
            check_model("rav4-2009", read_model(vehicle_file("rav4-2009")),
                        SimulatedRuns([replace(run, measured_mps2=factor * run.measured_mps2)]), silent)
