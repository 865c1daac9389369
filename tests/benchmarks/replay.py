"""Replay speed and memory: the demonstration drive through the whole chain, with files, on one core."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from importlib import resources
from pathlib import Path

from .figures import Figures


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    dump = resources.files("logger.demo") / "drive.dump.gz"
    ridelog = Path(sys.executable).with_name("ridelog")
    speeds, demos_s = [], []
    for _ in range(3):
        with tempfile.TemporaryDirectory() as out:
            command = [ridelog, "replay", str(dump), "--out", out, "--json"]
            outcome = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
            speeds.append(outcome["played_s"] / outcome["wall_s"])
            started_s = time.monotonic()
            subprocess.run([ridelog, "demo", "--out", out, "--json"], check=True, capture_output=True)
            demos_s.append(time.monotonic() - started_s)
    figures.at_least("replay, median of 3", sorted(speeds)[1], 300, "x real")
    figures.at_most("ridelog demo, whole command, median of 3", sorted(demos_s)[1], 15, "s")
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    figures.at_most("peak memory of replay and demo", peak_mb, 80, "MB")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
