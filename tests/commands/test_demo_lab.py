"""``ridelog demo --lab --unpack``: what is said of the drives is true, and nobody's files are written over."""

from __future__ import annotations

import re
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from logger.api.inputs import run_on_road as read_run
from logger.commands import demo

from ..support.command import called
from ..support.drives import lab_drives

DOC = Path(__file__).parents[2] / "docs" / "lab.md"


def unpack(folder: Path) -> CompletedProcess[str]:
    return called("demo", "--lab", "--unpack", "--out", folder / "lab")


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_drives_are_on_two_streets_and_the_texts_say_so(tmp_path: Path) -> None:
    slow, brisk = map(read_run, demo.unpack(tmp_path))
    common = min(len(slow.track.elevation_m), len(brisk.track.elevation_m))
    apart_m = slow.track.elevation_m[:common] - brisk.track.elevation_m[:common]
    assert np.sqrt(np.mean(apart_m**2)) > 0.01
    assert slow.speed_mps.mean() < 0.7 * brisk.speed_mps.mean()
    for text in (demo._INTRODUCTION, DOC.read_text("utf-8"), str(lab_drives.__doc__)):
        words = " ".join(text.split())
        assert "two poor town streets" in words
        assert not re.search(r"\bstreet\b|\btwice along", words)


def test_the_same_drives_again_are_fine(tmp_path: Path) -> None:
    assert unpack(tmp_path).returncode == 0
    (tmp_path / "lab" / "brisk" / "drive.csv").unlink()
    before = files_in(tmp_path)
    done = unpack(tmp_path)
    assert (done.returncode, done.stderr.count("Wrote ")) == (0, 4)
    assert files_in(tmp_path).items() > before.items()


@pytest.mark.parametrize(("kept", "words"), [
    ("slow/drive.csv", "another folder"), ("brisk/profile.csv", "another folder"), ("brisk", "expected a folder"),
    ("slow/profile.csv/mine.txt", "another folder"),
])
def test_a_file_of_the_users_own_stays(kept: str, words: str, tmp_path: Path) -> None:
    mine = tmp_path / "lab" / kept
    mine.parent.mkdir(parents=True)
    mine.write_text("t_s,mine\n", "utf-8")
    done = unpack(tmp_path)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert f"{tmp_path / 'lab' / '/'.join(kept.split('/')[:2])}: " in done.stderr and words in done.stderr
    assert files_in(tmp_path) == {f"lab/{kept}": b"t_s,mine\n"}
