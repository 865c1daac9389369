"""A file that is read is a regular one: a pipe would let the reader wait for ever."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ..support.slow import slow

COMMANDS = {
    "settings": ("status", "--config", "PIPE"),
    "vehicle": ("calibrate", "--vehicle", "PIPE"),
    "profile": ("iri", "PIPE"),
    "dump": ("replay", "PIPE", "--out", "out"),
    "log": ("report", "logs", "--out", "out.html"),
}


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    """A pipe that nobody writes to, as a settings file and as a log."""
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "logs").mkdir()
    os.mkfifo(tmp_path / "logs" / "00001-001.csv")
    return tmp_path / "pipe.yaml"


@pytest.mark.parametrize("what", ["vehicle", *slow(*(name for name in COMMANDS if name != "vehicle"))])
def test_a_pipe_is_refused_at_once_whatever_it_is_given_as(what: str, pipe: Path) -> None:
    words = [str(pipe) if word == "PIPE" else word for word in COMMANDS[what]]
    script = "from logger.commands.main import run; run()"
    done = subprocess.run([sys.executable, "-c", script, *words], cwd=pipe.parent, capture_output=True, text=True,
                          timeout=20, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "not a regular file" in done.stderr


def test_a_pipe_as_the_profile_of_a_sensor_is_refused(pipe: Path) -> None:
    script = f"from drivers.wire_profiles import load_profile; load_profile({str(pipe)!r})"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=20, check=False)
    assert "SettingsError" in done.stderr
    assert "not a regular file" in done.stderr


def test_a_pipe_in_place_of_a_sidecar_lets_no_check_wait(tmp_path: Path) -> None:
    (tmp_path / "00001-001.csv").write_text("x\n")
    os.mkfifo(tmp_path / "00001-001.json")
    script = "from logger.commands.main import run; run()"
    done = subprocess.run([sys.executable, "-c", script, "verify", str(tmp_path)], capture_output=True, text=True,
                          timeout=20, check=False)
    assert done.returncode == 1
    assert "sidecar: expected a readable file (not a regular file)" in done.stdout
