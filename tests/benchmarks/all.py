"""Run every benchmark of this folder, one after the other; exit 1 when a goal is missed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ONE_THREAD = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
NOT_BENCHMARKS = ("__init__", "all", "figures")
PART_OF_FAULTS = ("fuzz", "soak")


def main() -> int:
    """Run them all."""
    folder = Path(__file__).resolve().parent
    missed = 0
    for script in sorted(folder.glob("*.py")):
        if script.stem not in NOT_BENCHMARKS + PART_OF_FAULTS:
            print(f"== {script.stem}", flush=True)
            command = [sys.executable, "-m", f"{__package__}.{script.stem}"]
            missed += subprocess.run(command, cwd=folder.parents[1], check=False, env=ONE_THREAD).returncode != 0
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
