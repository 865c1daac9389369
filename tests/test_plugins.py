"""A folder read as a catalogue, and what it says of a file that does not keep to it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from threading import Barrier, Thread

import pytest

from drivers.catalogue import names
from logger.dsp import weightings
from logger.errors import BadInput
from logger.plugins import blamed_on, catalogue, offered_by

from .support.slow import slow


def folder(root: Path, files: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> str:
    package = root / f"offers_of_{root.name.replace('-', '_')}"
    package.mkdir()
    for name, text in {"__init__": "", **files}.items():
        (package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(root)
    return package.name


OFFER = "from types import SimpleNamespace\nSPRING = SimpleNamespace(name={name!r})\n"


def test_offers_by_name_without_the_file_that_defines_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"spring": "", "leaf": OFFER.format(name="leaf"), "coil": OFFER.format(name="coil")}
    assert list(catalogue(folder(tmp_path, files, monkeypatch), "SPRING")) == ["coil", "leaf"]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [("", r"leaf\.py: expected it to offer SPRING"),
     (OFFER.format(name="coil"), r"leaf\.py: expected SPRING to be named 'leaf', as the file is, found 'coil'")],
)
def test_a_file_without_its_offer_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, complaint: str
) -> None:
    with pytest.raises(BadInput, match=complaint):
        catalogue(folder(tmp_path, {"leaf": text}, monkeypatch), "SPRING")


def test_the_weightings_are_a_catalogue() -> None:
    files = {path.stem for path in Path(str(weightings.__file__)).parent.glob("*.py")}
    expected = sorted(files - {"__init__", "weighting"})
    assert {"wb", "wd", "wf", "wk"} <= set(expected)
    assert names("logger.dsp.weightings", "WEIGHTING") == expected
    assert list(catalogue("logger.dsp.weightings", "WEIGHTING")) == expected


def test_what_a_users_own_file_prints_is_no_answer_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.py"
    path.write_text("print('loaded')\nEFFECT = lambda: print('asked')\n")
    offer = offered_by(path, "EFFECT")
    with blamed_on(path):
        offer()
        with blamed_on(path):
            offer()
        offer()
    print("answer")
    reported = capsys.readouterr()
    assert (reported.out, reported.err.split()) == ("answer\n", ["loaded", *3 * ["asked"]])


def test_threads_that_leave_a_users_own_file_in_another_order_leave_stdout_as_it_was(tmp_path: Path) -> None:
    first_in, both_in, first_out = Barrier(2), Barrier(2), Barrier(2)

    def first() -> None:
        with blamed_on(tmp_path):
            first_in.wait(10)
            both_in.wait(10)
        first_out.wait(10)

    before, thread = sys.stdout, Thread(target=first)
    meanwhile = []
    thread.start()
    first_in.wait(10)
    with pytest.raises(BadInput), blamed_on(tmp_path):
        both_in.wait(10)
        first_out.wait(10)
        meanwhile.append(sys.stdout)
        raise ValueError("wrong")
    thread.join()
    assert meanwhile == [sys.stderr] and sys.stdout is before


EFFECT_OF_OTHERS = """
from ridelog.effects import ForceEffect, Parameter, Scale

class Theirs(ForceEffect):
    name, title = "theirs", "a damper beside the damper"
    parameters = (Parameter(name="damping_n_s_per_m", start=100.0, low=0.0, high=9000.0, null=0.0, scale=Scale.LINEAR,
                            meaning="more damping", trials=(50.0,)),)
    source, signature, shown_by = "nobody", "less motion", "any drive"

    def laws(self, p, laws):
        return laws.with_force(lambda travel_m, rate_mps: p.damping_n_s_per_m * rate_mps)

EFFECT = Theirs()
WRONG = 5
"""


def installed(root: Path, entry_points: str) -> Path:
    """A folder as pip leaves it, with a package of others."""
    (root / "their_package.py").write_text(EFFECT_OF_OTHERS)
    about = root / "their_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(entry_points)
    return root


def listed_with(root: Path, ridelog: Path) -> subprocess.CompletedProcess[str]:
    """What is said of an effect that there is not: the names of all that there are."""
    asked = ("simulate", "--vehicle", "rav4-2009", "--profile", "30", "--speed", "9", "--effect", "none", "--out", "a")
    return subprocess.run([ridelog, *asked], text=True, capture_output=True, cwd=root,
                          env=os.environ | {"PYTHONPATH": str(root)})


def test_an_installed_package_offers_an_effect_by_its_name(tmp_path: Path, ridelog: Path) -> None:
    """Listed, simulated by its name and in a vehicle's file, as one that comes with ridelog."""
    root = installed(tmp_path, "[ridelog.effects]\ntheirs = their_package:EFFECT\n")
    assert ", theirs, " in listed_with(root, ridelog).stderr
    code = ("import ridelog; car = ridelog.read_vehicle('rav4-2009').with_effect('theirs', damping_n_s_per_m=300.0)\n"
            "ridelog.write_vehicle('car.yaml', car)\n"
            "road = ridelog.random_road(iso_class='C', length_m=60.0, seed=2)\n"
            "run, plain = (ridelog.simulate(one, road, 9.0) for one in ('./car.yaml', 'rav4-2009'))\n"
            "print(run.accel_z_mps2.std() / plain.accel_z_mps2.std())")
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, cwd=tmp_path,
                          env=os.environ | {"PYTHONPATH": str(root)})
    assert done.stderr == "" and float(done.stdout) != pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("entry", "complaint"), [
    ("roll = their_package:EFFECT", "expected a name of its own, there is 'roll' already"),
    *slow(("others = their_package:EFFECT", "expected EFFECT to be named as its entry point is, found 'theirs'"),
          ("theirs = their_package:NOWHERE", "found AttributeError"),
          ("theirs = no_such_package:EFFECT", "found ModuleNotFoundError"),
          ("theirs = their_package:WRONG", "expected EFFECT to be named as its entry point is, found 5")),
])
def test_an_installed_package_that_offers_something_wrong_is_named(
    tmp_path: Path, ridelog: Path, entry: str, complaint: str
) -> None:
    done = listed_with(installed(tmp_path, f"[ridelog.effects]\n{entry}\n"), ridelog)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert complaint in done.stderr and entry.partition("= ")[2] in done.stderr


@pytest.mark.parametrize("package", [
    "drivers.accelerometers", "logger.dsp.weightings", "logger.lab.laws.families", "logger.exchange.formats"])
def test_other_catalogues_have_a_group_too(package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    offer = {"families": "FAMILY"}.get(kind := package.rpartition(".")[2], kind.removesuffix("s").upper())
    monkeypatch.syspath_prepend(installed(tmp_path, f"[ridelog.{kind}]\ntheirs = their_package:EFFECT\n"))
    try:
        assert list(catalogue(package, offer))[-1] == "theirs"
    finally:
        sys.modules.pop("their_package", None)
