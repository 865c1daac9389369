"""``ridelog plan``: the contract's object for a program, sentences and a page, and one line else."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import pytest

import ridelog
from logger.commands.main import main
from logger.errors import BadInput
from logger.store.formats.effect_file import shipped_effects

from ..support.lab.runs_with_effects import OWN

FEW = ("sensor_gain", "sensor_offset", "cg_shift", "payload", "roll", "time_offset")


@pytest.fixture(autouse=True)
def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {name: shipped_effects()[name] for name in FEW}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("road") / "road.csv"
    ridelog.write_profile(file, ridelog.random_road(iso_class="C", length_m=120.0, seed=3))
    return file


def plan(*arguments: object) -> int:
    return main(["plan", "--vehicle", "rav4-2009", *map(str, arguments)])


@pytest.mark.slow
def test_for_a_program_and_as_a_page(road: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    assert plan("--profile", road, "--speed", 8, "--speed", 12, "--json", "--out", page) == 0
    reported = json.loads(capsys.readouterr().out)
    names = set(FEW) - {"roll"}
    assert reported["detectability"].keys() == reported["isolability"].keys() == names
    assert reported["left_out"].keys() == {"roll"}
    for name, beside in reported["isolability"].items():
        assert beside.keys() == names - {name}
        assert all(0 <= one <= reported["detectability"][name] + 1e-9 for one in beside.values())
    offset = reported["isolability"]["sensor_offset"]
    assert min(offset, key=lambda name: offset[name]) == "cg_shift"  # both move the sensor against the body
    assert reported["noise_mps2"] == 0.05 and not reported["noise_measured"]
    assert [one["drive"] for one in reported["drives"]] == [f"{road} at 8 m/s", f"{road} at 12 m/s"]
    more = [one["more_named"] for one in reported["next"]]
    assert all(round(a, 1) >= round(b, 1) for a, b in pairwise(more))
    assert min(more) > -0.01 and all(gain > 1 for one in reported["next"] for gain in one["gains"].values())
    assert any("pitch gyroscope" in one["do"] for one in reported["next"])
    html = page.read_text("utf-8")
    assert html.count("<svg") == 1 and html.count("<rect") == len(names) ** 2


@pytest.mark.slow
def test_in_words_a_louder_sensor_names_less(road: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive = ("--profile", road, "--speed", 10)
    assert plan(*drive, "--noise", 0.02) == 0
    quiet = capsys.readouterr().out
    assert plan(*drive, "--noise", 2, "--step", 1) == 0
    loud = capsys.readouterr().out
    assert "can be named" in quiet and "Drives that would add most:" in quiet
    assert "noise of 2.02 m/s2" in " ".join(loud.split())  # a step of 1 adds a twelfth of its square
    assert loud.count("can be named") < quiet.count("can be named")


@pytest.mark.slow
def test_runs_that_were_driven_bring_their_own_noise_and_effects(road: Path, tmp_path: Path) -> None:
    car = ridelog.read_vehicle("rav4-2009").with_effect("sensor_gain", gain=1.1)
    run = ridelog.simulate(car, road, 9.0, noise_mps2=0.08, name="driven")
    file = tmp_path / "effect.py"
    file.write_text(OWN, "utf-8")
    found = ridelog.plan(car, run, profile=road, speeds_mps=[13.0], candidates=["sensor_offset", "cg_shift"])
    assert found.noise_mps2 == pytest.approx(0.08, rel=0.1)
    assert found.detectability.keys() == {"sensor_offset", "cg_shift"}
    alone = ridelog.plan(car, run, candidates=["sensor_offset", "cg_shift"])
    assert all(alone.detectability[name] < found.detectability[name] for name in found.detectability)
    assert "driven" in found.as_json()["drives"][0]["drive"] and "Detectability" in repr(found)


@pytest.mark.parametrize(("arguments", "complaint"), [
    ((), "plan: expected a run, or --profile and --speed"),
    (("--speed", "8"), "--speed: expected --profile with it"),
    (("--profile", "ROAD"), "plan: expected a run, or --profile and --speed"),
    (("--profile", "ROAD", "--speed", "60"), "--speed 60: expected a drive of 5 s or longer, found 2 s over"),
    (("--profile", "ROAD", "--speed", "8", "--speed", "8"), "--speed 8: expected each speed once"),
    (("--profile", "ROAD", "--speed", "0"), "--speed 0: expected 0.1 to 100 m/s"),
    (("--profile", "ROAD", "--speed", "8", "--noise", "0"), "--noise 0: expected"),
    (("--profile", "FLAT", "--speed", "8"), "expected a drive over a rough profile"),
    (("--profile", "nowhere.csv", "--speed", "8"), "nowhere.csv"),
])
def test_wrong_use_is_one_line(arguments: tuple[str, ...], complaint: str, road: Path, tmp_path: Path) -> None:
    flat = tmp_path / "flat.csv"
    flat.write_text("distance_m,elevation_m\n" + "".join(f"{one},0\n" for one in range(100)), "ascii")
    names = {"ROAD": str(road), "FLAT": str(flat)}
    with pytest.raises((BadInput, OSError)) as reported:
        plan(*[names.get(one, one) for one in arguments])
    assert complaint in str(reported.value) and "\n" not in str(reported.value)


@pytest.mark.slow
def test_what_is_planned_is_what_is_found() -> None:
    """On drives of a simulator that shares nothing with the lab."""
    from ..benchmarks.plan import NEAR, SHOWN, a_road, compared

    assert compared("sensor_offset", SHOWN["sensor_offset"], a_road()).off < NEAR
