"""Hostile input for every reader, on two processes; exit 1 when one of them breaks a promise.

    python fuzz.py [--inputs N] [--seconds S] [--huge-gb G] [--only NAME,...] [--seed K]

Each reader gets N damaged inputs, or as many as fit S seconds. The tool is the project's own
(``tests/support/fuzzing``): mutation of valid examples and tokens, guided by the places in the sources where inputs are
refused. With ``--huge-gb`` files that are huge or unpack to it come first. Prints one line per reader: inputs,
accepted, refused, different ends, the slowest input, growth of memory, promises broken; what broke one is kept in the
folder given by ``--keep``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

SUPPORT = Path(__file__).resolve().parents[1] / "support"
sys.path.append(str(SUPPORT))

from fuzz_targets import TARGETS, Workshop  # noqa: E402
from fuzzing import Tally, fuzz  # noqa: E402


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=20_000, help="per reader")
    parser.add_argument("--seconds", type=float, default=1e9, help="per reader at most")
    parser.add_argument("--huge-gb", type=float, default=0.0)
    parser.add_argument("--only", default=",".join(TARGETS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder for inputs that broke a promise")
    args = parser.parse_args()
    broken = _huge(args.huge_gb) if args.huge_gb else 0
    with ProcessPoolExecutor(2, max_tasks_per_child=1) as pool:
        runs = {name: pool.submit(_run, name, args.seed, args.inputs, args.seconds) for name in args.only.split(",")}
        for name, run in runs.items():
            tally, seconds = run.result()
            broken += len(tally.failures)
            print(f"{name:20} {tally.inputs:8} inputs {tally.accepted:8} accepted {tally.refused:8} refused "
                  f"{tally.places:4} ends  slowest {tally.slowest_s:.2f} s  memory +{tally.memory_mb:.0f} MB  "
                  f"{tally.inputs / seconds:.0f}/s  {len(tally.failures)} broken", flush=True)
            for words, data in tally.failures[:5]:
                print(f"    {words}\n    {data[:200]!r}")
            if args.keep and tally.failures:
                args.keep.mkdir(parents=True, exist_ok=True)
                for number, (_, data) in enumerate(tally.failures):
                    (args.keep / f"{name}-{number}").write_bytes(data)
    return 1 if broken else 0


def _run(name: str, seed: int, inputs: int, seconds: float) -> tuple[Tally, float]:
    began_s = time.monotonic()
    with Workshop() as folder:
        tally = fuzz(TARGETS[name](folder), seed, inputs, began_s + seconds)
    return tally, time.monotonic() - began_s


def _huge(gigabytes: float) -> int:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, SUPPORT / "huge_inputs.py", folder, str(gigabytes)]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
