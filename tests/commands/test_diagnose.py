"""``ridelog diagnose``: the contract's object for a program, a verdict in sentences, and one line else."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from logger.api.inputs import run_on_road as read_run
from logger.commands.main import main
from logger.errors import BadInput
from logger.store.formats.effect_file import shipped_effects

from ..support.lab.runs_with_effects import FEW, OWN, named, out_of_balance, write_runs

EVERY = dict(shipped_effects())


@pytest.fixture(autouse=True)
def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {name: shipped_effects()[name] for name in FEW}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)


@pytest.fixture(scope="module")
def offset_runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return write_runs(tmp_path_factory.mktemp("offset"), named("sensor_offset", offset_m=0.4))


def diagnose(*arguments: str) -> int:
    return main(["diagnose", "--vehicle", "rav4-2009", *arguments])


@pytest.mark.slow
def test_for_a_program_and_as_a_page(offset_runs: list[str], tmp_path: Path,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    assert diagnose(*offset_runs, "--json", "--out", str(page)) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["verdict"] == ["sensor_offset"]
    assert reported["unexplained"] is False
    assert reported["noise_floor_error"] < reported["baseline_error"]
    unseen = np.concatenate([one.accel_z_mps2[1400:] for one in map(read_run, offset_runs)])  # a third, after 2 s
    assert reported["noise_floor_error"] == pytest.approx(0.03 / np.sqrt(np.mean(unseen**2)), rel=0.1)
    best, *others = reported["candidates"]
    assert best["effect"] == "sensor_offset"
    assert 0 < best["standard_errors"]["offset_m"] < 0.02
    assert best["parameters"]["offset_m"] == pytest.approx(0.4, abs=0.04)
    assert best["p_value"] < 1e-6 and best["confused_with"] == []
    assert {"effect", "parameters", "error", "p_value", "confused_with"} <= best.keys()
    assert [one["p_value"] for one in others] == sorted(one["p_value"] for one in others)
    assert reported["judged_on"] == "held-out stretches"
    refitted = reported["errors"][1]["error"]
    assert best["error"] < min([refitted, *(one["error"] for one in others)])
    assert reported["no_better_than_refitted"]
    assert reported["not_tried"].keys() == {"roll"}
    tried = {*(one["effect"] for one in reported["candidates"]), *reported["no_better_than_refitted"]}
    assert tried == set(FEW) - {"roll"}
    assert reported["unexplained_shape"] is None
    assert main(["compare", "--vehicle", "rav4-2009", *offset_runs, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["error"] == reported["baseline_error"]
    html = page.read_text("utf-8")
    assert "sensor_offset is missing" in html
    assert html.count("<svg") == 3  # how the error fell, the car's numbers, candidates


def test_nothing_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert diagnose(*write_runs(tmp_path, [])) == 0
    reported = capsys.readouterr().out
    lines = reported.splitlines()
    assert "rav4-2009 on 2 runs, 36 s; ridelog knows 4 effects." in lines
    assert lines[0].startswith("Nothing is missing")
    assert "Next: nothing" in reported
    assert "roll: not tried" in reported
    assert all(len(line) <= 100 for line in lines)


@pytest.mark.slow
def test_drives_without_noise(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
                              ) -> None:
    """As ``ridelog simulate`` writes them: a right model is right, and friction is no late clock besides."""
    names = ("dry_friction", "sensor_bandwidth", "sensor_offset", "time_offset")
    few = {name: shipped_effects()[name] for name in names}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
    right = write_runs(tmp_path / "right", [], lasts_s=12.0, noise_mps2=0.0)
    assert diagnose(*right, "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["verdict"] == [] and reported["unexplained"] is False
    assert "sensor_offset" not in reported["undetectable"]
    assert main(["compare", "--vehicle", "rav4-2009", *right, "--json"]) == 0
    compared = json.loads(capsys.readouterr().out)
    assert compared["missing"] is False and not any(mark["found"] for mark in compared["residual_tests"])
    rubbing = named("dry_friction", friction_force_n=80.0, transition_velocity_m_per_s=0.0)
    assert diagnose(*write_runs(tmp_path / "rubbing", rubbing, lasts_s=12.0, noise_mps2=0.0), "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["verdict"] == ["dry_friction"] and reported["unexplained"] is False
    assert reported["candidates"][0]["parameters"]["friction_force_n"] == pytest.approx(80.0, rel=0.02)


@pytest.mark.slow
def test_short_runs_are_judged_on_what_no_fit_saw_as_well(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                          ) -> None:
    assert diagnose(*write_runs(tmp_path, named("sensor_offset", offset_m=0.4), lasts_s=8.0), "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["judged_on"] == "held-out stretches"
    assert reported["errors"][-2]["error"] == pytest.approx(reported["noise_floor_error"], rel=0.1)


@pytest.mark.slow
def test_something_that_no_candidate_explains(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    assert diagnose(*write_runs(tmp_path / "runs", [], more=out_of_balance), "--out", str(page)) == 0
    reported = " ".join(capsys.readouterr().out.split())
    assert "Something is missing that no known effect explains" in reported
    assert "It repeats every 2.07 m of road" in reported  # the circumference of 0.33 m
    assert "A wheel of 0.33 m radius" in reported
    assert "Nothing is missing" not in reported
    assert "What repeats along the road" in page.read_text("utf-8")


@pytest.mark.slow
def test_an_effect_of_the_users_own_that_is_like_another(offset_runs: list[str], tmp_path: Path,
                                                         capsys: pytest.CaptureFixture[str]) -> None:
    own = tmp_path / "bracket.py"
    own.write_text(OWN, "utf-8")
    assert diagnose(*offset_runs, "--effect-file", str(own)) == 0
    reported = " ".join(capsys.readouterr().out.split())
    assert "these runs cannot distinguish them" in reported
    assert "drive a smooth road" in reported  # what the file says would show it
    assert "ridelog knows 5 effects" in reported


def test_what_cannot_be_diagnosed(offset_runs: list[str], tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text(OWN.replace("EFFECT = Bracket()", "EFFECT = nothing"), "utf-8")
    taken = tmp_path / "taken.py"
    taken.write_text(OWN.replace("long_bracket", "sensor_gain"), "utf-8")
    for arguments, words in (
        (("--effect-file", str(wrong)), "wrong.py:.*nothing"),
        (("--effect-file", str(taken)), "taken.py: .*sensor_gain"),
        (("--tolerance", "2"), "--tolerance 2: expected unknown, or 0.001 to 0.5"),
        ((str(tmp_path / "none"),), "expected a folder"),
    ):
        with pytest.raises(BadInput, match=words):
            diagnose(*offset_runs, *arguments)


@pytest.mark.slow
def test_what_a_car_seldom_has_is_tried_where_all_else_leaves_something_unexplained(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    more = {name: EVERY[name] for name in (*FEW, "hysteresis")}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: more)
    leaves = named("hysteresis", yield_force_n=150.0, yield_travel_m=0.0015, sharpness_ratio=1.0)
    for runs, found in ((write_runs(tmp_path / "leaves", leaves, lasts_s=12.0), ["hysteresis"]),
                        (write_runs(tmp_path / "plain", [], lasts_s=12.0), [])):
        assert diagnose("--json", *runs) == 0
        said = json.loads(capsys.readouterr().out)
        assert said["verdict"] == found
        assert ("hysteresis" in {one["effect"] for one in said["candidates"]}) is bool(found)
