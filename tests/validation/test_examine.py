"""A few cases put before the lab, and the marking and reporting of made-up answers."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from .cases import random_case as cases
from .cases.random_case import case
from .cases.seeds import DEVELOPMENT_SEEDS, RELEASE_SEEDS
from .cases.visibility import UNSEEN, remainders
from .examine import questions, report
from .marking.marks import Share, alarm, all_named, first_right, goals, numbers, numbers_right, said, share
from .marking.results import read_results
from .marking.sitting import Question, Record, examined
from .report.pages import Matrix, markdown, page


@pytest.fixture
def short_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs of 14 s instead of up to four of 60."""
    drawn = cases.draw_drives

    def two(rng: np.random.Generator, rough: int) -> tuple[cases.Drive, ...]:
        drives = drawn(rng, rough)
        return tuple(replace(drive, duration_s=14.0) for drive in (drives + drives)[:2])

    monkeypatch.setattr(cases, "draw_drives", two)


# --- the lab --------------------------------------------------------------------------------------------------------

@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed", "effect"), [
    ("none", 3, None), ("one", 1, "dry_friction"),
    pytest.param("one", 2, "sensor_gain", marks=pytest.mark.release),
    pytest.param("one", 2, "sensor_bandwidth", marks=pytest.mark.release),
])
@pytest.mark.usefixtures("short_drives")
def test_the_lab_finds_what_was_hidden(kind: str, seed: int, effect: str | None) -> None:
    record = {"kind": kind, "seed": seed, "left": [], **examined(case(kind, seed, effect), in_process=True)}
    if kind == "none":
        assert not alarm(record), said(record)
    else:
        assert first_right(record), said(record)
        assert numbers_right(record), [one.words for one in numbers(record)]


@pytest.mark.slow
@pytest.mark.usefixtures("short_drives")
def test_an_effect_that_the_cars_numbers_can_do_is_nothing_to_be_seen() -> None:
    one = case("one", 5, "payload")
    kilograms = 0.01 * one.scene.car.sprung_mass_kg
    few = replace(one.hidden[0], parameters={"mass_kg": kilograms})
    bare = replace(one.scene, physics=replace(one.scene.physics, payload_kg=0.0))
    loaded = replace(one, scene=few.effect.apply(bare, few.parameters), hidden=(few,), noise_rms_mps2=0.05)
    assert remainders(loaded)[0] < UNSEEN
    rubbing = case("one", 5, "dry_friction")
    assert remainders(rubbing)[0] > UNSEEN


# --- marking --------------------------------------------------------------------------------------------------------


def answer(kind: str, seed: int, there: dict[str, dict[str, float]], named: dict[str, dict[str, float]], *,
           unexplained: bool = False, confused: tuple[str, ...] = (), error: float = 0.1, deviation: float = 0.0,
           strength: float = 5.0) -> Record:
    """A record as ``sitting`` makes it; the effects in ``there`` that are off the list have no numbers."""
    listed = [{"name": name, "parameters": numbers, "strength": strength} for name, numbers in there.items() if numbers]
    off = [{"name": name, "parameters": {}, "strength": strength, "akin": ["dry_friction"]}
           for name, numbers in there.items() if not numbers]
    added = [{"name": name, **values, "standard_errors": dict.fromkeys(values, deviation)}
             for name, values in named.items()]
    return {
        "kind": kind, "seed": seed, "left": [strength] * len(there), "source": "a", "failed": None,
        "truth": {"effects": listed, "outsiders": off, "noise_floor_error": 0.1, "attainable_error": 0.11,
                  "runs": [{"duration_s": 60.0}] * 4},
        "said": {"verdict": list(named), "unexplained": unexplained, "noise_floor_error": 0.1, "baseline_error": 0.5,
                 "candidates": [{"effect": name, "parameters": values, "confused_with": list(confused)}
                                for name, values in named.items()]},
        "added": {"error_after": error, "effects": added, "cpu_s": 1.0} if named else None,
        "diagnosing": {"wall_s": 20.0, "cpu_s": 15.0, "peak_mb": 200.0},
    }


RUB, GAIN, LOAD = {"friction_force_n": 50.0}, {"gain": 1.1}, {"mass_kg": 90.0}


def test_an_effect_counts_where_it_stands_first_or_is_named_beside_the_first() -> None:
    assert first_right(answer("one", 1, {"dry_friction": RUB}, {"dry_friction": RUB, "payload": {}}))
    assert not first_right(answer("one", 1, {"dry_friction": RUB}, {"payload": {}, "dry_friction": RUB}))
    assert first_right(answer("one", 1, {"dry_friction": RUB}, {"payload": {}}, confused=("dry_friction",)))
    assert not first_right(answer("one", 1, {"dry_friction": RUB}, {}))


def test_two_effects_need_two_answers() -> None:
    both = {"dry_friction": RUB, "sensor_gain": GAIN}
    assert all_named(answer("two", 1, both, dict(reversed(both.items()))))
    assert not all_named(answer("two", 1, both, {"payload": {}}, confused=tuple(both)))
    assert all_named(answer("two", 1, both, {"payload": {}, "dry_friction": RUB}, confused=("sensor_gain",)))


@pytest.mark.parametrize(("found", "deviation", "is_right"), [
    ({"friction_force_n": 54.9}, 0.0, True), ({"friction_force_n": 55.1}, 0.0, False),
    ({"friction_force_n": 61.0}, 4.0, True), ({"friction_force_n": 63.0}, 4.0, False),
])
def test_numbers_are_right_within_a_tenth_or_three_standard_errors(
        found: dict[str, float], deviation: float, is_right: bool) -> None:
    record = answer("one", 1, {"dry_friction": RUB}, {"dry_friction": found}, deviation=deviation)
    assert numbers_right(record) is is_right


def test_of_a_gain_what_differs_from_one_is_judged() -> None:
    assert not numbers_right(answer("one", 1, {"sensor_gain": GAIN}, {"sensor_gain": {"gain": 1.12}}))
    assert numbers_right(answer("one", 1, {"sensor_gain": GAIN}, {"sensor_gain": {"gain": 1.109}}))


def test_an_alarm_is_anything_that_is_said_of_nothing() -> None:
    assert not alarm(answer("none", 1, {}, {}))
    assert alarm(answer("none", 1, {}, {"payload": {}}))
    assert alarm(answer("none", 1, {}, {}, unexplained=True))
    assert alarm(answer("none", 1, {}, {}) | {"said": None, "failed": "diagnose ended with 2"})


def test_the_interval_of_a_share_is_wilsons() -> None:
    assert Share(9, 10).interval == pytest.approx((0.596, 0.982), abs=1e-3)  # from a table
    assert share([], alarm).of == 0


# --- plan, results and report ---------------------------------------------------------------------------------------

def test_a_part_of_the_plan_holds_all_kinds() -> None:
    plan = questions({"none": 10, "one": 40, "two": 10}, 2000)
    assert len(set(plan)) == 60
    assert {question.kind for question in plan[:8]} == {"none", "one", "two"}
    assert {question.seed for question in plan if question.kind == "one"} == set(range(2000, 2040))


def test_seeds_of_a_release_are_asked_for_by_name() -> None:
    assert questions({"one": 2, "none": 0}, RELEASE_SEEDS[0], release=True) == [
        Question("one", RELEASE_SEEDS[0]), Question("one", RELEASE_SEEDS[1])]
    for first_seed, release in ((RELEASE_SEEDS[0], False), (RELEASE_SEEDS[0] - 1, False), (RELEASE_SEEDS[-1], False),
                                (RELEASE_SEEDS[-1], True), (DEVELOPMENT_SEEDS[0], True)):
        with pytest.raises(ValueError, match="release"):
            questions({"one": 2}, first_seed, release)
    assert not set(DEVELOPMENT_SEEDS) & set(RELEASE_SEEDS)


def test_the_report_says_which_seeds_were_asked() -> None:
    assert "development seeds, 1 to 13, may have shaped the lab" in markdown(RECORDS, 11, "m.svg")
    kept_back = [record | {"seed": RELEASE_SEEDS[0] + record["seed"]} for record in RECORDS]
    text = markdown(kept_back, 11, "m.svg")
    assert "release seeds, 7001 to 7013, were never used while the lab was developed" in text
    assert "examine --release" in text


def test_the_counts_for_the_study_are_those_of_the_pages(tmp_path: Path) -> None:
    report(RECORDS, 11, tmp_path)
    found = json.loads((tmp_path / "examination.json").read_text("utf-8"))
    assert {name: found[name] for name in ("first_seed", "last_seed", "cases", "asked", "release")} == {
        "first_seed": 1, "last_seed": 13, "cases": len(RECORDS), "asked": 11, "release": False}
    text = (tmp_path / "examination.md").read_text("utf-8")
    assert len(found["goals"]) == len(goals(RECORDS))
    for goal in found["goals"]:
        assert f"| {goal['name']} | " in text
        assert f" | {goal['count']} of {goal['of']} | " in text


def test_a_line_that_a_stop_has_torn_is_left_out(tmp_path: Path) -> None:
    file = tmp_path / "results.jsonl"
    file.write_text(json.dumps(answer("none", 7, {}, {})) + '\n{"kind": "one", "se')
    assert list(read_results(file)) == [Question("none", 7)]
    assert read_results(tmp_path / "no such file") == {}


RECORDS = [
    answer("none", 1, {}, {}), answer("none", 2, {}, {"payload": {"mass_kg": 9.0}}),
    answer("one", 3, {"dry_friction": RUB}, {"dry_friction": RUB}, error=0.105),
    answer("one", 4, {"dry_friction": RUB}, {"payload": {"mass_kg": 9.0}}, strength=0.1),
    answer("two", 5, {"dry_friction": RUB, "sensor_gain": GAIN}, {"dry_friction": RUB, "sensor_gain": GAIN}, error=0.2),
    answer("three", 12, {"dry_friction": RUB, "sensor_gain": GAIN, "payload": LOAD},
           {"dry_friction": RUB, "sensor_gain": GAIN, "payload": LOAD}),
    answer("three", 13, {"dry_friction": RUB, "sensor_gain": GAIN, "payload": LOAD}, {"payload": LOAD}, strength=0.1),
    answer("outsider", 6, {"bushing_hysteresis": {}}, {"dry_friction": RUB}, unexplained=True),
    answer("outsider", 7, {"trailer": {}}, {"dry_friction": RUB}),
    answer("one", 8, {"sensor_gain": GAIN}, {}) | {"said": None, "added": None, "failed": "diagnose ended with 2"},
    answer("wandering", 9, {"dry_friction": RUB}, {"dry_friction": RUB}), answer("wandering", 10, {}, {}),
    answer("wandering", 11, {"dry_friction": RUB}, {"dry_friction": RUB}, unexplained=True),
]


def test_goals_are_counted_over_the_cases_that_they_ask() -> None:
    found = [(goal.found.count, goal.found.of, goal.met) for goal in goals(RECORDS)]
    assert found == [(1, 3, False), (1, 2, False), (1, 1, True), (1, 1, True), (1, 2, False), (0, 8, True),
                     (2, 3, False), (1, 2, False), (2, 2, True), (1, 2, False), (1, 4, False)]


def test_the_report_says_what_the_records_hold() -> None:
    text = markdown(RECORDS, 14, "m.svg")
    assert "13 of 14 cases are done" in text
    assert re.search(r"\| wandering \| 11 \| dry_friction \(5\) \| dry_friction, unexplained \|  \|", text)
    assert re.search(r"\| one \| 4 \| dry_friction \(0.1\) \| payload \| nobody could see it \|", text)
    assert re.search(r"\| outsider \| 7 \| trailer \(5\) \| dry_friction \| akin \|", text)
    assert "no answer: diagnose ended with 2" in text
    assert not re.search(r"\| (one \| 3|outsider \| 6) \|", text)
    counts = Matrix.of(RECORDS).counts
    assert sum(counts.values()) == len([one for one in RECORDS if one["kind"] in ("none", "one", "outsider")])
    assert counts["bushing_hysteresis", "unexplained"] == 1
    assert page(RECORDS, 8).startswith("<!doctype html>")


def test_the_picture_is_whole_and_shows_every_case() -> None:
    figure = ElementTree.fromstring(Matrix.of(RECORDS).figure)
    shown = [int(node.text or "") for node in figure.iter("{http://www.w3.org/2000/svg}text")
             if (node.text or "").isdigit()]
    assert sum(shown) == 7
