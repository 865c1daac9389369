"""ridelog learn: what it writes, what it prints, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import ridelog
from logger.commands.main import main
from logger.errors import BadInput
from logger.shipped import vehicle_file


@pytest.fixture(scope="module")
def plain_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive of a car that is as its file says."""
    folder = tmp_path_factory.mktemp("runs") / "plain"
    road = ridelog.random_road(iso_class="C", length_m=180.0, seed=2)
    ridelog.write_run(folder, ridelog.simulate("rav4-2009", road, speed_mps=12.0, noise_mps2=0.05))
    return folder


@pytest.mark.parametrize(("out", "says"), [
    ("law.txt", r"ends in one of \.py, \.html"), ("nowhere/law.py", "a folder that exists"),
    ("law.html", r"the law.s file as well")])
def test_a_name_that_is_no_law_is_refused(out: str, says: str, plain_run: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=says):
        main(["learn", "--vehicle", "rav4-2009", "--out", str(tmp_path / out), str(plain_run)])
    assert not list(tmp_path.iterdir())


def test_a_page_is_not_the_law(plain_run: Path, tmp_path: Path) -> None:
    law = str(tmp_path / "law.py")
    for page, complaint in ((law, "a different file each time"), (str(tmp_path / "page.png"), r"a file that ends")):
        with pytest.raises(BadInput, match=f"--out .*: expected {complaint}"):
            main(["learn", "--vehicle", "rav4-2009", "--out", law, "--out", page, str(plain_run)])


@pytest.mark.slow
def test_where_nothing_is_missing_nothing_is_written(plain_run: Path, tmp_path: Path,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    law = tmp_path / "law.py"
    assert main(["learn", "--json", "--vehicle", "rav4-2009", "--out", str(law), str(plain_run)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["law"] is None and found["family"] is None and not law.exists()
    assert found["words"] == "nothing is missing, so there is no law to learn" and found["verdict"] == []
    assert found["error_after"] == pytest.approx(found["noise_floor_error"], rel=0.1)


@pytest.mark.slow
def test_where_a_known_effect_is_missing_the_command_that_adds_it_is_next(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rubbing.yaml").write_text(vehicle_file("rav4-2009").read_text("utf-8").replace(
        "effects: []", "effects: [{name: dry_friction, friction_force_n: 200}]"), "utf-8")
    road = ridelog.random_road(iso_class="C", length_m=180.0, seed=2)
    ridelog.write_run(Path("run"), ridelog.simulate("rubbing.yaml", road, speed_mps=12.0, noise_mps2=0.05))
    assert main(["learn", "--vehicle", "rav4-2009", "--out", "law.py", "run"]) == 0
    *_, last = capsys.readouterr().out.rstrip().splitlines()
    assert last == "Next: ridelog add-effect dry_friction --vehicle rav4-2009 --out with-dry_friction.yaml run"
    assert not Path("law.py").exists()
