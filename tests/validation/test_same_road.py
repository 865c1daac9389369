"""The lab without a profile on cases of the examination: what is missing is found, and what is not is not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import ridelog
from logger.errors import BadInput

from .cases.case_files import write_case
from .cases.same_road import same_road_case

FEW = ("sensor_mount_resonance", "sensor_bandwidth", "sensor_offset", "sensor_gain", "tire_enveloping", "tire_damping",
       "damper_asymmetry", "speed_scale", "roll")
"""Those that are like the one that is hidden, and of each kind that cannot be tried; all of them are for an examination
(``python -m tests.validation.same_road``)."""


def reported_of(seed: int, effect: str | None, folder: Path) -> dict[str, Any]:
    write_case(same_road_case(seed, effect, length_m=90.0, speeds_mps=(9.0, 15.0)), folder)
    for profile in folder.glob("run*/profile.csv"):
        profile.unlink()
    return ridelog.diagnose(folder / "vehicle.yaml", sorted(folder.glob("run*")), tolerance=0.04,
                            same_road=True, candidates=FEW).as_json()


@pytest.mark.release
def test_a_missing_effect_is_found(tmp_path: Path) -> None:
    reported = reported_of(1, "sensor_mount_resonance", tmp_path)
    first = next(one for one in reported["candidates"] if one["effect"] == reported["verdict"][0])
    assert "sensor_mount_resonance" in [first["effect"], *first["confused_with"]]
    assert {"effect", "parameters", "error", "p_value", "confused_with"} <= first.keys()
    assert reported["errors"][-2]["error"] < reported["errors"][1]["error"] < reported["baseline_error"]
    assert {"sensor_gain", "tire_enveloping"} <= reported["taken_by_road"].keys()
    assert {"damper_asymmetry", "speed_scale", "roll"} <= reported["not_tried"].keys()
    assert any("share one scale" in one or "only together" in one for one in reported["sentences"])


@pytest.mark.slow
def test_nothing_missing(tmp_path: Path) -> None:
    reported = reported_of(2, None, tmp_path)
    assert reported["verdict"] == []
    better = {one["effect"] for one in reported["candidates"]}
    assert {*better, *reported["no_better_than_refitted"]} == {*FEW} - reported["not_tried"].keys()


def test_one_drive_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="two runs"):
        ridelog.diagnose("rav4-2009", [tmp_path], same_road=True)
