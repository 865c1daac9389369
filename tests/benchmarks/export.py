"""An export of very many files: how its time grows, and the memory of the process that the unit would run.

    python -m tests.benchmarks.export [--files N] [--at FOLDER]

Exports N files (65,000), half and a quarter of them, each time to an empty stick, and once more when all is there. The
folder is in memory by default, so that what is measured is our own work and no disk. Then to a stick that somebody
prepared.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from logger.store.export import manifest
from logger.store.export.manifest import Manifest, manifest_blocks

from .figures import Figures

MEMORY = Path("/dev/shm")
UNIT_MEMORY_MB = 150
PATIENCE_S = 500
LINEAR = 1.3
"""Twice the files in at most twice the time, and three tenths for a busy machine."""

EXPORT = """
import re, sys, time
from pathlib import Path
from logger.commands.main import command
parser, run = command("export")
begun = time.process_time()
status = run(parser.parse_args(sys.argv[1:]))
most_kb = re.search(r"VmHWM:\\s*(\\d+)", Path("/proc/self/status").read_text())[1]
print(status, time.process_time() - begun, int(most_kb) / 1000, sep="\\n")
"""


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=65_000)
    parser.add_argument("--at", type=Path, default=MEMORY if MEMORY.is_dir() else None, help="where the folders go")
    args = parser.parse_args()
    figures = Figures()
    seconds = []
    for files in (args.files // 4, args.files // 2, args.files):
        with tempfile.TemporaryDirectory(dir=args.at) as name:
            logs, stick = _filled(Path(name), files)
            first_s, first_mb = _export(logs, stick)
            again_s, again_mb = _export(logs, stick)
        seconds.append(first_s)
        figures.at_most(f"{files} files, processor time", first_s, PATIENCE_S, "s")
        figures.at_most("    memory", first_mb, UNIT_MEMORY_MB, "MB")
        figures.at_most("    once more, all there: processor time", again_s, PATIENCE_S, "s")
        figures.at_most("    memory", again_mb, UNIT_MEMORY_MB, "MB")
    figures.at_most("time for the last half, to that for the first", seconds[2] / seconds[1] - 1, LINEAR, "")
    with tempfile.TemporaryDirectory(dir=args.at) as name:
        logs, stick = _filled(Path(name), 20)
        _export(logs, stick)
        _hostile(next((stick / manifest.FOLDER).iterdir()))
        figures.at_most("hostile manifest and names: memory", _export(logs, stick)[1], UNIT_MEMORY_MB, "MB")
    return 1 if figures.missed else 0


def _hostile(own: Path) -> None:
    """A whole manifest of 63 MB in the logger's folder on a stick, and 300,000 long names beside it."""
    listed = {f"{number:05d}-00000.csv": "0" * 64 for number in range(760_000)}
    (own / manifest.NAME).write_bytes(b"".join(manifest_blocks(Manifest(own.name, listed))))
    for number in range(300_000):
        (own / f"{number:06d}-{'x' * 240}").touch()


def _filled(folder: Path, files: int) -> tuple[Path, Path]:
    """A folder of logs and an empty stick. What is in them is small: it is their number that costs."""
    logs, stick = folder / "log", folder / "stick"
    for place in (logs, stick):
        place.mkdir()
    for number in range(files // 2):
        for ending in ("csv", "json"):
            (logs / f"{number:05d}-001.{ending}").write_bytes(b"%d\n" % number)
    return logs, stick


def _export(logs: Path, stick: Path) -> tuple[float, float]:
    """Processor time [s] and most memory [MB] of an export in a process of its own."""
    words = [sys.executable, "-c", EXPORT, "--from", str(logs), "--to", str(stick), "--note", str(stick / "note.json")]
    *said, status, seconds, megabytes = subprocess.run(words, capture_output=True, text=True, check=True,
                                                       ).stdout.split("\n")[:-1]
    if status != "0":
        raise SystemExit("\n".join(said))
    return float(seconds), float(megabytes)


if __name__ == "__main__":
    sys.exit(main())
