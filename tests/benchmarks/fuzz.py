"""Hostile input for every reader; exit 1 when one of them breaks a promise.

    python -m tests.benchmarks.fuzz [--inputs N] [--seconds S] [--record FILE] [--jobs J] [--huge-gb G]
                                    [--only NAME,...] [--seed K]

Each reader gets N damaged inputs, or as many as all of them together get in S seconds. The tool is the project's own
(``tests/support/fuzz``): mutation of valid examples and tokens, guided by the places in the sources where inputs are
refused. Names that begin with ``fields:`` are readers, and with ``command:`` whole commands, on valid files in which a
field, a column or some lines were changed; ``--only`` takes "fields" and "commands" for all of a kind, and commands,
which take longer, are tried only there. No input may take more than 500 MB. With ``--huge-gb`` files that are huge or
unpack to it come first. Prints one line per reader: inputs, accepted, refused, different ends, the slowest input,
growth of memory, promises broken; what broke one is kept in the
folder given by ``--keep``. With ``--record`` a line for every so many inputs goes to a file as well, and what that
file counts already is not done again: a long run may be stopped and gone on with.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from ..support.fuzz.command_targets import COMMAND_TARGETS
from ..support.fuzz.field_targets import FIELD_TARGETS
from ..support.fuzz.mutation import Counts, Tally, fuzz, read_counts
from ..support.fuzz.targets import TARGETS as BYTE_TARGETS
from ..support.fuzz.targets import Workshop

TARGETS = {**BYTE_TARGETS, **FIELD_TARGETS, **COMMAND_TARGETS}
ROOT = Path(__file__).resolve().parents[2]
AT_ONCE = 50_000
"""So many inputs a reader gets in one process; then it is the next reader's turn."""


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=20_000, help="per reader")
    parser.add_argument("--seconds", type=float, default=1e9, help="for all readers, at most")
    parser.add_argument("--record", type=Path, help="file to add the counts to, and to go on from")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--huge-gb", type=float, default=0.0)
    parser.add_argument("--only", default=",".join([*BYTE_TARGETS, "fields"]))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder for inputs that broke a promise")
    args = parser.parse_args()
    until_s = time.monotonic() + args.seconds
    broken = _huge(args.huge_gb) if args.huge_gb else 0
    kinds = {"fields": FIELD_TARGETS, "commands": COMMAND_TARGETS}
    names = [name for word in args.only.split(",") for name in kinds.get(word, (word,))]
    known = read_counts(args.record.read_text()) if args.record and args.record.exists() else {}
    counts = {name: known.get(name, Counts()) for name in names}
    with ProcessPoolExecutor(args.jobs, max_tasks_per_child=1) as pool:
        while time.monotonic() < until_s and (due := [name for name in names if counts[name].inputs < args.inputs]):
            runs = {name: pool.submit(_run, name, args.seed + counts[name].inputs,
                                      min(AT_ONCE, args.inputs - counts[name].inputs), until_s) for name in due}
            for name, run in runs.items():
                tally, seconds = run.result()
                done = Counts.of(tally, seconds)
                counts[name] = counts[name].plus(done)
                if args.record and done.inputs:
                    with args.record.open("a") as record:
                        record.write(f"{done.line(name)}\n")
                _tell_failures(name, tally, args.keep)
    for name in names:
        print(counts[name].line(name), flush=True)
    broken += sum(one.broken for one in counts.values())
    return 1 if broken else 0


def _run(name: str, seed: int, inputs: int, until_s: float) -> tuple[Tally, float]:
    began_s = time.monotonic()
    with Workshop() as folder:
        tally = fuzz(TARGETS[name](folder), seed, inputs, until_s)
    return tally, time.monotonic() - began_s


def _tell_failures(name: str, tally: Tally, keep: Path | None) -> None:
    for words, data in tally.failures[:5]:
        print(f"    {name}: {words}\n    {data[:200]!r}", flush=True)
    if keep and tally.failures:
        keep.mkdir(parents=True, exist_ok=True)
        for number, (_, data) in enumerate(tally.failures):
            (keep / f"{name}-{number}").write_bytes(data)


def _huge(gigabytes: float) -> int:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tests.support.fuzz.huge_inputs", folder, str(gigabytes)]
        return subprocess.run(command, cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
