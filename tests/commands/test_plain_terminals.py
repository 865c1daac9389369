"""Terminals that have no sign for plus or minus, nor for the names of somebody else's files."""

import subprocess
import sys
from pathlib import Path

import pytest

import ridelog

from ..support.slow import slow


@pytest.mark.parametrize(("encoding", "sign"), [
    ("ascii", "+-"), ("cp437", "±"), *slow(("koi8-r", "+-"), ("utf-8", "±"))])
def test_every_character_can_be_shown(tmp_path: Path, encoding: str, sign: str) -> None:
    road = tmp_path / "straße €.csv"
    ridelog.write_profile(road, ridelog.random_road(gd_n0_cm3=128.0, length_m=150.0))
    program = [sys.executable, "-c", "from logger.commands.main import run; run()", "road", "classify"]
    encoded = {"PYTHONIOENCODING": encoding}
    done, missing = (subprocess.run([*program, path], env=encoded, capture_output=True, check=False)
                     for path in (road, tmp_path / "€.csv"))
    assert done.returncode == 0
    assert f" {sign} " in done.stdout.decode(encoding)
    assert missing.returncode == 2
    complaint = missing.stderr.decode(encoding)
    assert ("€" if encoding == "utf-8" else r"\u20ac") in complaint
    assert complaint.count("\n") == 1
