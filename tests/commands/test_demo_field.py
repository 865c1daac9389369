"""``ridelog demo --field``: from recorded bytes to a better IRI, and the document that leads through it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from logger.api.inputs import run_on_road as read_run
from logger.commands.main import main
from logger.errors import BadInput
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_model
from tests.support.command import called
from tests.support.printed import printed, shown, words

FEW = ("dry_friction", "sensor_gain", "time_offset")
DOCS = Path(__file__).parents[2] / "docs"


def test_the_drives_are_unpacked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--field", "--unpack", "--out", str(tmp_path), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["vehicle"] == "rav4-2009"
    assert [Path(one).name for one in reported["dumps"]] == ["first.dump.gz", "second.dump.gz", "third.dump.gz",
                                                         "fourth.dump.gz"]
    assert all(Path(one).is_file() for one in [*reported["dumps"], *reported["lines"]])
    assert main(["demo", "--field", "--unpack", "--out", str(tmp_path)]) == 0
    assert f"Next: ridelog extract {tmp_path / 'first.dump.gz'}" in capsys.readouterr().out


def test_a_file_of_the_users_own_stays(tmp_path: Path) -> None:
    (tmp_path / "line.csv").write_text("mine\n", "utf-8")
    with pytest.raises(BadInput, match=r"line\.csv: expected nothing there"):
        main(["demo", "--field", "--out", str(tmp_path)])
    assert [path.name for path in tmp_path.iterdir()] == ["line.csv"]


@pytest.mark.slow
def test_a_run_of_either_sensor_can_be_read_and_says_what_its_steps_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--field", "--unpack", "--out", str(tmp_path)]) == 0
    dumps = [str(tmp_path / f"{name}.dump.gz") for name in ("second", "third")]
    assert main(["extract", *dumps, "--out", str(tmp_path / "runs"), "--profile", str(tmp_path / "line.csv")]) == 0
    assert capsys.readouterr().out.count("matched to the road") == 2
    coarse, fine = (read_run(tmp_path / "runs" / name).facts for name in ("second", "third"))
    assert coarse.step_mps2 == pytest.approx(2 * 9.80665 / 32, rel=1e-5)
    assert fine.step_mps2 is None


def test_one_demo_at_a_time() -> None:
    done = called("demo", "--field", "--lab")
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.slow
def test_the_effect_is_found_and_the_fourth_drive_is_judged_rightly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among a few effects; that it is found among all of them is what the document shows."""
    few = {name: one for name, one in shipped_effects().items() if name in FEW}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
    done = called("demo", "--field", "--json", "--out", tmp_path)
    assert done.returncode == 0 and all(line.startswith("Wrote ") for line in done.stderr.splitlines()), done.stderr
    reported = json.loads(done.stdout)
    assert [Path(one["run"]).name for one in reported["runs"]] == ["first", "second", "third", "fourth"]
    assert all(one["by_road"] for one in reported["runs"])
    (name,) = reported["added"]
    (effect,) = reported["effects"]
    assert name == effect["effect"] == reported["truth"]["effect"]
    assert not reported["unexplained"] and not reported["left"]
    for parameter, value in reported["truth"]["parameters"].items():
        assert effect["parameters"][parameter] == pytest.approx(value, rel=0.1)
    before, after = (reported["fourth"][when]["comparison"] for when in ("before", "after"))
    assert abs(before["bias"]) > 0.2 and before["within_two"] < 0.75
    assert abs(after["bias"]) < 0.05 and after["within_two"] > 0.8
    assert after["r2"] > 0.7 > before["r2"] + 0.5
    assert [one.effect.name for one in read_model(tmp_path / "vehicle-1.yaml").effects] == [name]
    page = Path(reported["page"]).read_text("utf-8")
    assert page.count("<svg") == 4 and "simulated" in page
    assert not any(word in page for word in ("<script", "http:", "https:"))


@pytest.mark.slow
@pytest.mark.parametrize(("page", "verbs"), [
    ("field-lab.md", "demo extract extract estimate compare diagnose add-effect compare estimate replay replay"),
    ("lab.md", "demo compare diagnose add-effect compare"),
])
def test_the_document_shows_what_its_commands_print(page: str, verbs: str, tmp_path: Path) -> None:
    """All of it, in order, in one folder; ``python -m tests.support.printed`` rewrites it."""
    commands = shown((DOCS / page).read_text("utf-8"))
    assert [one.command.split()[1] for one in commands] == verbs.split()
    for one in commands:
        now = list(map(words, printed(one.command, tmp_path)))
        assert one.paragraphs, one.command
        for line, paragraph in one.paragraphs:
            assert words(paragraph) in now, f"{page}:{line + 1}"
