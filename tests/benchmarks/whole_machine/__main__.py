"""ridelog on a whole machine: builds a Debian image, boots it, tries what is promised, and writes the page.

python -m tests.benchmarks.whole_machine [--quick] [--only NAME,...] [--list] [--work DIR] [--tree DIR] [--out FILE.md]

Needs root and the packages user-mode-linux, uml-utilities, mmdebstrap, qemu-system-x86, qemu-system-arm,
qemu-user-static, e2fsprogs, fdisk, dosfstools, exfatprogs; and this package's Python with ridelog in it.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from importlib import import_module
from pathlib import Path

from .bench import Bench
from .catalogue import CATALOGUE, read_report
from .page import write_page

# in the order in which they are carried out and stand on the page
for module in ("installation", "power", "sticks", "sensors", "machine", "usb", "arm"):
    import_module(f".trials.{module}", __package__)
WORK = Path("/var/tmp/ridelog-whole-machine")


def main() -> int:
    """Run the trials that are asked for; exit 1 when something did not hold."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.whole_machine",
                                     description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer repetitions")
    parser.add_argument("--only", metavar="NAME,...", help="only these trials")
    parser.add_argument("--list", action="store_true", help="name the trials and stop")
    parser.add_argument("--work", type=Path, default=WORK, help=f"images and guests (default {WORK})")
    parser.add_argument("--tree", type=Path, default=Path.cwd(), help="the checkout whose commit is tried")
    parser.add_argument("--out", type=Path, help="write the page of all results in the work folder")
    args = parser.parse_args()
    if args.list:
        for trial in CATALOGUE.values():
            print(f"{trial.name:34} {trial.guest:5} {trial.promise}")
        return 0
    names = args.only.split(",") if args.only else list(CATALOGUE)
    unknown = [name for name in names if name not in CATALOGUE]
    if unknown:
        parser.error(f"no trial {', '.join(unknown)}; see --list")
    if os.geteuid() != 0:
        parser.error("expected to be run as root: it makes images and boots machines")
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # guests are ended on the way out
    bench = Bench(args.work.resolve(), args.tree.resolve(), args.quick)
    results = bench.work / "results"
    reports = []
    for name in names:
        report = CATALOGUE[name].carry_out(bench)
        report.save(results)
        reports.append(report)
    if args.out is not None:
        saved = [read_report(results / f"{name}.json") for name in CATALOGUE if (results / f"{name}.json").exists()]
        write_page(args.out, saved)
    return 0 if all(report.held or report.cannot for report in reports) else 1


if __name__ == "__main__":
    sys.exit(main())
