"""The examples of the public interface, run as they stand."""

from __future__ import annotations

import doctest
import importlib
import json
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import logger.api
import ridelog
from logger.plugins import catalogue
from logger.store.formats.effect_file import shipped_effects

from ..support.slow import slow

MODULES = [importlib.import_module(one.name) for one in pkgutil.walk_packages(logger.api.__path__, "logger.api.")]
SLOW = ("logger.api.lab.question", "logger.api.lab.diagnose", "logger.api.fleet", "logger.api.log_questions",
        "logger.api.lab.bench", "logger.api.lab.plan")


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory, short_dump: Path) -> dict[str, Any]:
    """What the examples take for given: a run's folder, with a log in it; a recorded dump; a car, and runs of it with a
    sensor that reads 15 % too much."""
    from logger.commands.main import main

    folder = tmp_path_factory.mktemp("run")
    road = ridelog.random_road(iso_class="B", length_m=200.0, spacing_m=0.1, seed=4)
    run = ridelog.simulate("rav4-2009", road, speed_mps=20.0, noise_mps2=0.05)
    ridelog.write_run(folder, run)
    assert main(["replay", str(short_dump), "--out", str(folder / "logs"), "--json"]) == 0
    car, bumpy = ridelog.read_vehicle("rav4-2009"), ridelog.random_road(iso_class="C", length_m=150.0, seed=2)
    wrong = car.with_effect("sensor_gain", gain=1.15)
    runs = [ridelog.simulate(wrong, bumpy, speed_mps, noise_mps2=0.03, name=f"at {speed_mps:g} mps")
            for speed_mps in (9.0, 15.0)]
    return {"folder": folder, "recording": short_dump, "car": car, "runs": runs, "np": np,
            **{name: getattr(ridelog, name) for name in ridelog.__all__}}


@pytest.mark.parametrize("module", [
    pytest.param(one, marks=pytest.mark.slow if one.__name__ in SLOW else (), id=one.__name__) for one in MODULES])
def test_examples(module: ModuleType, names: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Once each: a function that asks a question shows the question's examples. A search has few effects and families
    of laws to try; among all of them it is judged in ``tests.lab``."""
    if "lab" in module.__name__:
        few = {name: shipped_effects()[name] for name in ("sensor_gain", "sensor_offset", "time_offset")}
        monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
        families = {name: one for name, one in catalogue("logger.lab.laws.families", "FAMILY").items()
                    if name in ("changing_gain", "force_by_rate", "hum")}
        assert len(families) == 3
        monkeypatch.setattr("logger.api.lab.learn.catalogue", lambda *_: families)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for one in doctest.DocTestFinder().find(module, extraglobs=names):
        holder = getattr(module, one.name.removeprefix(f"{module.__name__}."), None)
        if not hasattr(holder, "__signature__"):
            runner.run(one)
    assert runner.summarize().failed == 0


def test_each_name_is_documented() -> None:
    named = {name: getattr(ridelog, name) for name in ridelog.__all__}
    assert not [name for name, one in named.items() if callable(one)
                and not (one.__doc__ and (isinstance(one, type) or ">>>" in one.__doc__))]


def test_what_effects_are_made_of_and_the_list_of_them_have_one_name() -> None:
    """Python puts a module in the place of a function of its name, whichever was asked for first."""
    listed = ridelog.effects()
    kinds = importlib.import_module("ridelog.effects")
    assert kinds.ForceEffect.__name__ == "ForceEffect" and callable(ridelog.effects)
    assert list(ridelog.effects()) == list(listed) and "roll" in listed


def test_importing_it_loads_nothing_that_takes_long_and_prints_nothing() -> None:
    code = "import ridelog, sys; raise SystemExit(len({'numpy', 'yaml', 'scipy', 'numba'} & set(sys.modules)))"
    reported = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (reported.returncode, reported.stdout, reported.stderr) == (0, "", "")
    assert set(ridelog.__all__) <= set(dir(ridelog))


def test_what_is_wrong_is_one_line_and_nothing_is_printed(
    names: dict[str, Any], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    car, run = names["car"], names["runs"][0]
    bare = ridelog.make_run(run.accel_z_mps2, run.speed_mps, rate_hz=100.0, name="bare")
    (tmp_path / "wrong.csv").write_text("nothing\n", "ascii")
    ridelog.write_vehicle(tmp_path / "vehicle-1.yaml", car)
    channels = ridelog.make_channels({"a": np.arange(200.0) % 7}, rate_hz=100.0)
    asked: list[Callable[[], object]] = [
        lambda: ridelog.read_vehicle("nobody"), lambda: ridelog.read_run(tmp_path), lambda: ridelog.read_log(tmp_path),
        lambda: ridelog.read_dump(tmp_path / "wrong.csv"), lambda: ridelog.read_profile(tmp_path / "wrong.csv"),
        lambda: ridelog.comfort(run, "wz"), lambda: ridelog.iri(run.profile, window_m=0.0),
        lambda: ridelog.random_road(iso_class="Z"), lambda: ridelog.simulate(car, run.profile, 1000.0),
        lambda: car.with_effect("dry_friction", friction_force_n=-1.0),
        lambda: ridelog.compare(car, [run, run]), lambda: ridelog.compare(car, bare),
        lambda: ridelog.compare(car, []), lambda: car.with_numbers({"mass": 1.0}),
        lambda: ridelog.compare(car, run, tolerance=2.0),
        lambda: ridelog.diagnose(car, run, candidates=["magic"]),
        lambda: ridelog.add_effect("payload", car.with_effect("payload"), run),
        lambda: ridelog.add_effect("sensor_gain+sensor_offset", car, run, start={"offset": 0.1}),
        lambda: ridelog.calibrate(car, window_m=0.0), lambda: ridelog.calibrate(car, window_m=1e6),
        lambda: ridelog.read_channels(tmp_path / "wrong.csv"),
        lambda: ridelog.make_channels({"a": [1.0, 2.0], "b": [1.0]}, rate_hz=100.0),
        lambda: ridelog.make_channels({"a": [1.0, 2.0]}, rate_hz=0.0),
        lambda: ridelog.modes(channels, "magic"), lambda: ridelog.modes(channels, columns=["c"]),
        lambda: ridelog.modes(channels, "n4sid", input_column="c"), lambda: ridelog.modes(channels, from_s=9.0),
        lambda: ridelog.modes(channels, "armax", input_column="a"),
        lambda: ridelog.diagnose(car, run, same_road=True),
        lambda: ridelog.diagnose(car, [run, names["runs"][1]], candidates=["magic"], same_road=True),
        lambda: ridelog.lab(car, run, tmp_path / "wrong.csv", candidates=["payload"]),
        lambda: ridelog.lab(tmp_path / "vehicle-1.yaml", run, tmp_path, candidates=["payload"]),
    ]
    for ask in asked:
        with pytest.raises(ridelog.BadInput) as refused:
            ask()
        assert "\n" not in str(refused.value) and "expected" in str(refused.value)
    assert capfd.readouterr() == ("", "")


def test_what_was_written_is_read_back(names: dict[str, Any], tmp_path: Path) -> None:
    run = names["runs"][0]
    ridelog.write_run(tmp_path, run)
    again = ridelog.read_run(tmp_path)
    np.testing.assert_allclose(again.accel_z_mps2, run.accel_z_mps2, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(again.profile.elevation_m, run.profile.elevation_m, atol=1e-7)
    car = names["car"].with_effect("dry_friction", friction_force_n=33.0)
    ridelog.write_vehicle(tmp_path / "car.yaml", car)
    assert repr(ridelog.read_vehicle(tmp_path / "car.yaml")) == repr(car)


def ringing() -> ridelog.Channels:
    t_s = np.arange(1000) / 100
    noise = 0.01 * np.random.default_rng(1).standard_normal(1000)
    return ridelog.make_channels({"top": np.exp(-0.2 * t_s) * np.cos(9.4 * t_s) + noise}, rate_hz=100.0)


@pytest.mark.slow
def test_each_record_shows_itself(names: dict[str, Any]) -> None:
    run, folder = names["runs"][0], names["folder"]
    shown = [run, run.profile, names["car"], ridelog.iri(run.profile), ridelog.estimate(run, "rav4-2009"),
             ridelog.comfort(run), ridelog.read_log(folder), ridelog.read_dump(names["recording"]),
             ridelog.effects(), ridelog.effects()["roll"], ridelog.compare(names["car"], names["runs"]),
             ridelog.calibrate(names["car"]), ridelog.read_channels(folder / "drive.csv", ["accel_z_mps2"]),
             ridelog.modes(ringing())]
    for one in shown:
        assert 2 <= len(repr(one).splitlines()) <= 60
        html = one._repr_html_()
        assert html.startswith('<div class="ridelog"') and html.count("<svg") == len(one.charts())
    assert sum(len(one.charts()) for one in shown) >= 6


def test_a_long_run_is_drawn_with_its_peaks_and_few_points() -> None:
    accel = np.sin(np.arange(360_001) / 50.0)
    accel[123_456] = 9.0
    run = ridelog.make_run(accel, 10.0, rate_hz=100.0)
    (chart,) = run.charts()
    (drawn,) = chart.lines
    assert len(drawn.x) < 5000 and drawn.y.max() == 9.0 and (np.diff(drawn.x) >= 0).all()
    assert drawn.x[drawn.y.argmax()] == run.time_s[123_456]
    assert len(run._repr_html_()) < 200_000


@pytest.mark.parametrize("command", ["iri", "comfort", "estimate", "identify", "modes", *slow("compare")])
def test_the_object_is_the_commands(
    command: str, names: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from logger.commands.main import main

    folder = names["folder"]
    rings = ringing()
    np.savetxt(tmp_path / "rings.csv", np.column_stack([np.arange(1000) / 100, rings.samples]), "%.9g", ",",
               header="t_s,top", comments="")
    file = {"iri": folder / "profile.csv", "comfort": folder / "drive.csv", "modes": tmp_path / "rings.csv"}.get(
        command, folder)
    more = {"iri": [], "comfort": [], "modes": [],
            "identify": ["--vehicle", "rav4-2009", "--free", "sprung_mass_kg"]}.get(command, ["--vehicle", "rav4-2009"])
    assert main([command, str(file), *more, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    found = {"iri": lambda: ridelog.iri(file), "comfort": lambda: ridelog.comfort(file),
             "estimate": lambda: ridelog.estimate(file, "rav4-2009"),
             "identify": lambda: ridelog.identify("rav4-2009", file, ["sprung_mass_kg"]),
             "compare": lambda: ridelog.compare("rav4-2009", file),
             "modes": lambda: ridelog.modes(file)}[command]()
    assert json.loads(json.dumps(found.as_json())) == printed
    assert main([command, str(file), *more]) == 0
    assert capsys.readouterr().out.rstrip() == repr(found).rstrip()


@pytest.mark.slow
def test_a_calibration_is_the_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from logger.commands.main import main

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    reported: list[str] = []
    found = ridelog.calibrate("rav4-2009", progress=reported.append)
    again = ridelog.calibrate("rav4-2009", progress=reported.append)
    assert ["computed in" in words for words in reported] == [True, False]
    assert "found in" in reported[1] and again.as_json() == found.as_json()
    assert main(["calibrate", "--vehicle", "rav4-2009", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found.as_json()
    plain = ridelog.calibrate(ridelog.read_vehicle("rav4-2009"), progress=reported.append)
    assert reported[-1].endswith("not kept") and [path.name for path in tmp_path.iterdir()] == ["ridelog"]
    assert (found.accel_rms_per_root_gd.slope == plain.accel_rms_per_root_gd.slope).all()


@pytest.mark.slow
def test_the_loop_asks_what_to_add(names: dict[str, Any], tmp_path: Path) -> None:
    asked: list[str] = []
    story = ridelog.lab(names["car"], names["runs"], tmp_path, candidates=["sensor_gain", "time_offset"],
                        ask=asked.append)
    assert asked == ["sensor_gain"] and story.refused == ("sensor_gain",) and story.additions == ()
    assert [path.name for path in tmp_path.iterdir()] == ["story.html"]
    assert "Missing, but you chose not to add: sensor_gain." in repr(story) and story.model.effects == ()
    with pytest.raises(ridelog.BadInput, match="expected one of sensor_gain, time_offset"):
        ridelog.lab(names["car"], names["runs"], tmp_path, candidates=["sensor_gain", "time_offset"],
                    ask=lambda _: "rust")


@pytest.mark.slow
@pytest.mark.parametrize("more", [
    pytest.param(["diagnose", "--same-road"], id="same road"), pytest.param(["diagnose"], id="diagnose"),
    pytest.param(["lab"], id="lab", marks=pytest.mark.release)])
def test_a_search_is_the_commands(
    more: list[str], names: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from logger.commands.main import main
    from logger.store.formats.effect_file import shipped_effects

    few = {name: shipped_effects()[name] for name in ("sensor_gain", "sensor_offset")}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
    folders = [tmp_path / "slow", tmp_path / "fast"]
    out = ["--out", str(tmp_path / "lab")] if "lab" in more else []
    is_one_road = "--same-road" in more
    short = ridelog.random_road(iso_class="C", length_m=90.0, seed=2)  # a road that is estimated takes its square
    runs = names["runs"] if not is_one_road else [ridelog.simulate(names["car"], short, speed_mps, noise_mps2=0.03)
                                      for speed_mps in (9.0, 15.0)]
    for folder, run in zip(folders, runs, strict=True):
        ridelog.write_run(folder, run)
    assert main([*more, "--vehicle", "rav4-2009", *map(str, folders), *out, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    found = ridelog.lab("rav4-2009", folders, tmp_path / "lab") if out else ridelog.diagnose(
        "rav4-2009", folders, same_road=is_one_road)
    assert json.loads(json.dumps(found.as_json())) == printed
    assert found.figures() and found._repr_html_().count("<svg") == 1
    if is_one_road:
        assert len(found.found.by_run) == len(printed["runs"]) == len(folders) and printed["sentences"]
    if not out:
        assert main([*more, "--vehicle", "rav4-2009", *map(str, folders)]) == 0
        said, _, todo = capsys.readouterr().out.rstrip().partition("\n\nNext: ")
        assert said == repr(found) and (todo == "") == is_one_road
