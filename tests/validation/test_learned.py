"""The part "off the list": the cases are parted honestly, and made-up answers are marked as the rules say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logger.plugins import catalogue
from logger.store.formats.effect_file import shipped_effects

from ..support.slow import slow
from .cases import random_case as cases
from .cases.kept_back import write_kept_back
from .cases.random_case import case
from .cases.seeds import DEVELOPMENT_SEEDS
from .learned import KINDS, LISTED, NONE, above, goals, planned, reported, right_family
from .marking.families import NAMES, PHASES_OF_THEIR_OWN, REMOVED_DRIFT, RIGHT, named
from .marking.sitting import Record
from .simulator.newcomers import NEWCOMERS
from .simulator.outsiders import OUTSIDERS


def answer(kind: str, family: str | None, after: float = 0.1) -> Record:
    """A record of a case with a noise floor of 0.09 and a truth of 0.1, where the refit takes nothing more."""
    kept = {"attainable": 0.1, "floor": 0.09, "before": 0.4, "before_refitted": 0.3}
    if family:
        kept |= {"after": after, "after_refitted": after}
    return {"kind": kind, "seed": 2000, "runs": 3, "failed": None, "kept": kept, "learning": {"wall_s": 1.0},
            "said": {"family": family, "words": "something", "verdict": []}, "truth": {"effects": [], "outsiders": []}}


def test_every_effect_off_the_list_has_a_family_and_every_meaning_a_name() -> None:
    of_the_list_in_one_axle = {"one_axle_friction"}
    assert RIGHT.keys() == (OUTSIDERS.keys() | NEWCOMERS.keys()) - of_the_list_in_one_axle
    assert RIGHT.keys() > PHASES_OF_THEIR_OWN
    for right in RIGHT.values():
        assert right.meanings and all(NAMES[meaning] for meaning in right.meanings)


def test_every_family_has_a_meaning() -> None:
    assert catalogue("logger.lab.laws.families", "FAMILY").keys() == (
        set().union(*NAMES.values()) - {REMOVED_DRIFT} - shipped_effects().keys())


def test_a_sensor_that_drifts_is_said_and_needs_no_law() -> None:
    record = answer("warming_sensor", None)
    record["kept"]["without_drift"] = 0.0945
    for share, right in ((0.4, True), (0.0, False)):
        record["said"]["removed"] = {"drift": {"error_power_share": share}}
        assert right_family(record) is right
        assert above(record) == (pytest.approx(1.05) if right else float("inf"))
    assert not right_family(answer("warming_sensor", "changing_gain"))


def test_a_known_effect_that_is_named_in_the_place_of_a_law_is_the_answer() -> None:
    instead = answer("bushing_hysteresis", None)
    instead["kept"] |= {"after": 0.11, "after_refitted": 0.1}
    instead["said"]["verdict"] = ["hysteresis"]
    assert right_family(instead) and above(instead) == pytest.approx(1.1)
    instead["said"]["verdict"] = ["sensor_gain"]
    assert not right_family(instead)
    instead["said"]["verdict"] = []
    assert not right_family(instead)


def test_a_right_family_and_a_wrong_one() -> None:
    right, wrong = sorted(NAMES[RIGHT["gas_spring"].meanings[0]])[0], sorted(NAMES[RIGHT["trailer"].meanings[0]])[0]
    assert named("gas_spring", right)
    assert not named("gas_spring", wrong) and not named("gas_spring", None)


@pytest.mark.parametrize(("kind", "after", "times"), [("gas_spring", 0.12, 1.2), ("flat_spot", 0.099, 1.1)])
def test_a_law_is_measured_by_what_the_truth_reaches(kind: str, after: float, times: float) -> None:
    assert above(answer(kind, "any", after)) == pytest.approx(times)
    assert above(answer(kind, None)) == float("inf")


def test_goals_count_what_they_say() -> None:
    right = sorted(NAMES[RIGHT["gas_spring"].meanings[0]])[0]
    records = [answer("gas_spring", right), answer("gas_spring", "none of them", 0.2), answer("trailer", None),
               answer(NONE, None), answer(NONE, right), answer(LISTED, None)]
    near, family, nothing, listed = goals(records)
    assert (near.found.count, near.found.of) == (family.found.count, family.found.of) == (1, 3)
    assert (nothing.found.count, nothing.found.of) == (1, 2) and not nothing.met
    assert (listed.found.count, listed.found.of) == (1, 1) and listed.met
    failed = {**answer(NONE, None), "said": None, "kept": None, "failed": "learn ended with 2"}
    assert goals([failed])[2].found.count == 1
    assert "NO ANSWER" in reported(failed) and "right" in reported(records[0]) and "WRONG" in reported(records[1])


def test_kinds_are_mixed_and_their_seeds_kept_apart() -> None:
    asked = planned(KINDS, 2, DEVELOPMENT_SEEDS[0], release=False)
    assert {one.kind for one in asked[: len(KINDS)]} == set(KINDS)
    with pytest.raises(ValueError, match="kept for releases"):
        planned(KINDS, 2, 7000, release=False)


@pytest.mark.parametrize("count", [2, *slow(1)])
def test_what_is_kept_back_is_not_learned_from(count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = cases.draw_drives
    monkeypatch.setattr(cases, "draw_drives", lambda rng, rough: tuple(
        replace(drive, duration_s=12.0) for drive in (drawn(rng, rough) * 2)[:count]))
    made = case("outsider", 3, "tire_warming")
    found = write_kept_back(made, tmp_path / "case")
    kept, *learned = (np.genfromtxt(folder / "drive.csv", delimiter=",", names=True)
                      for folder in (found.kept, *found.runs))
    assert len(learned) == 1 and found.kept not in found.runs
    last = made.recordings[-1]
    if count == 1:
        assert len(kept) + len(learned[0]) == len(last.t_s)
        assert kept["t_s"][0] > learned[0]["t_s"][-1]
    else:
        assert len(kept) == len(last.t_s)
    # The noise by its own definition: what the recorder added to what a perfect one would have written.
    counts = slice(-len(kept) + 200, None)
    noise = (last.accel_z_mps2 - last.clean_mps2)[counts]
    assert found.floor_error == pytest.approx(np.std(noise) / np.std(last.accel_z_mps2[counts]), rel=0.02)
    assert found.floor_error <= found.attainable_error < 1.5 * found.floor_error
