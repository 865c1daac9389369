"""Everything that goes wrong with a logger, tried: power, kills, disks, sensors, sticks, hostile input, a long day.

    python -m tests.benchmarks.faults [--quick] [--out FILE] [--inputs N] [--huge-gb G]
    python -m tests.benchmarks.faults --fuzzed FILE [--out FILE]

Runs the trials of each fault (``tests/support``; the tests run a few of each), prints goals, and writes the table
``docs/reference/trials.md``; exit 1 when a promise was broken. ``--quick`` takes a few cases of each fault, leaves the
long day out, and writes nothing but where ``--out`` says. Damaged input and the day are those of ``fuzz.py`` and
``soak.py``. With ``--fuzzed`` nothing is tried: the table that is there gets the counts of a long run of ``fuzz.py
--record FILE``.
"""

from __future__ import annotations

import argparse
import logging
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from ..support.faults import crashes, log_damage, small_files
from ..support.faults import disks as disk_faults
from ..support.faults import kills as killing
from ..support.faults import sensors as sensor_faults
from ..support.faults import sticks as stick_faults
from ..support.faults.trials import Hazard, Line, run
from ..support.fuzz.field_targets import FIELD_TARGETS
from ..support.fuzz.mutation import Counts, read_counts
from ..support.fuzz.targets import TARGETS
from .figures import Figures, read_figures

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs" / "reference" / "trials.md"
MEMORY = Path("/dev/shm")
"""The models of disks and sticks need no disk, and are quicker without."""

ON_DISK = (killing.KILLS, killing.WRITES_NO_MORE)
TRIED = {
    "Power cuts and kills": (*crashes.HAZARDS, killing.KILLS),
    "Damaged and unreadable files": (*log_damage.HAZARDS, *small_files.HAZARDS),
    "Disks": (*disk_faults.HAZARDS, killing.WRITES_NO_MORE),
    "Sensors": sensor_faults.HAZARDS,
    "USB sticks": stick_faults.HAZARDS,
}
ENOUGH_CRASHES = 1000
_HOSTILE = re.compile(r"## Hostile input\n.*?(?=\n## |\Z)", re.DOTALL)

HEAD = """\
# Faults: what was tried

Made by `python -m tests.benchmarks.faults`; the counts are those of the run that made it.
[What goes wrong in a car](../faults.md) says what ridelog promises.

- Power is cut in a model of the disk: what each write, fsync and rename leaves behind at that instant.
  Only so can a cut be tried at every single change.
- Sensors are bytes on simulated buses and ports, in simulated time.
- Kills, and a service that may write no more, are those of the real process.
- Sticks are folders behind a model of the system's calls, which forgets what FAT would.
- Time limits are in processor time, so that a busy machine breaks none.
"""


@dataclass(frozen=True)
class Group:
    """One table."""

    title: str
    words: str
    lines: Sequence[Line]


def main() -> int:
    """Try everything; write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a minute or two")
    parser.add_argument("--out", type=Path,
                        help="where the table goes (default: docs/reference/trials.md; none with --quick)")
    parser.add_argument("--fuzzed", type=Path, help="only put the counts of this record into the table")
    parser.add_argument("--inputs", type=int, help="damaged inputs per reader (default: 20000, with --quick 300)")
    parser.add_argument("--huge-gb", type=float, help="size of huge inputs (default: 10, with --quick 0.02)")
    args = parser.parse_args()
    if sys.flags.optimize:
        parser.error("expected Python without -O: the trials are assertions")
    if args.fuzzed:
        return _recount(args.fuzzed, args.out or TABLE)
    logging.disable(logging.CRITICAL)
    inputs = args.inputs or (300 if args.quick else 20_000)
    huge_gb = args.huge_gb or (0.02 if args.quick else 10.0)
    groups = [*_tried(args.quick), _hostile(inputs, huge_gb)] + ([] if args.quick else [_long_day()])
    figures = Figures()
    _judge(groups, 0 if args.quick else ENOUGH_CRASHES, figures)
    out = args.out or (None if args.quick else TABLE)
    if out is not None:
        out.write_text(_page(groups), encoding="utf-8")
    return 1 if figures.missed else 0


def _tried(quick: bool) -> list[Group]:
    """The groups of faults that are trials of functions, on two processes."""
    with ProcessPoolExecutor(2) as pool:
        runs = {title: [pool.submit(_run, hazard, quick) for hazard in hazards] for title, hazards in TRIED.items()}
        groups = []
        for title, pending in runs.items():
            lines = []
            for one in pending:
                line = one.result()
                print(f"{title}: {line.name}: {line.trials} trials; {line.happened}", flush=True)
                lines.append(line)
            groups.append(Group(title, "", lines))
        return groups


def _run(hazard: Hazard, quick: bool) -> Line:
    memory = MEMORY if MEMORY.is_dir() and hazard not in ON_DISK else None
    with tempfile.TemporaryDirectory(dir=memory) as name:
        return run(hazard, hazard.some() if quick else hazard.cases, Path(name))


def _hostile(inputs: int, huge_gb: float) -> Group:
    """``fuzz.py``, and a line for each reader."""
    command = [sys.executable, "-m", "tests.benchmarks.fuzz", "--inputs", str(inputs), "--huge-gb", str(huge_gb)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    print(done.stdout, end="", flush=True)
    huge = [line.split("\t") for line in done.stdout.splitlines() if line.count("\t") == 3]
    failed = tuple(f"{name}: {outcome}" for name, outcome, *_ in huge if outcome.startswith("FAILED"))
    lines = [Line(
        "huge input", f"files and pipes without end, lines of {huge_gb:g} GB, YAML and zip bombs, deep nesting",
        "an answer or a refusal; memory bounded by the largest file that a desk command takes (1 GB)",
        f"slowest {max(float(row[2]) for row in huge):.0f} s of work, memory +{max(int(row[3]) for row in huge)} MB"
        if not failed else f"**BROKEN**: {'; '.join(failed)}", len(huge), wrong=failed)]
    lines += _readers(read_counts(done.stdout))
    _check_ended(done, lines, len(TARGETS) + len(FIELD_TARGETS) + 1)
    return Group("Hostile input", _tool(inputs), lines)


def _readers(counts: dict[str, Counts]) -> list[Line]:
    return [Line(
        f"`{name}`", "damaged valid input", "read as it stands, or refused in one line; within 2 s",
        f"{one.accepted} read, {one.refused} refused, {one.ends} different outcomes, slowest {one.slowest_s:.2f} s, "
        f"memory +{one.memory_mb:.0f} MB" if not one.broken else f"**BROKEN**: {one.broken} inputs", one.inputs,
        wrong=(f"{name}: {one.broken} inputs",) * bool(one.broken)) for name, one in counts.items()]


def _tool(fewest: int) -> str:
    return (f"{fewest} damaged inputs or more for each reader, by `tests/benchmarks/fuzz.py`. The tool is our own: "
            "bits, bytes, spans, lines, fields and numbers of valid examples are changed, repeated and spliced, check "
            "values are mended half of the time, and inputs that end at a new place in the sources are damaged "
            "further.")


def _recount(record: Path, table: Path) -> int:
    """Put the counts of a record of ``fuzz.py`` into the table; 1 when a promise was broken."""
    counts = read_counts(record.read_text(encoding="utf-8"))
    page = table.read_text(encoding="utf-8")
    section = _HOSTILE.search(page)
    if missing := set(TARGETS) - set(counts):
        raise SystemExit(f"{record}: expected a line for each reader, none for {', '.join(sorted(missing))}")
    if section is None:
        raise SystemExit(f"{table}: expected the section 'Hostile input'")
    huge = [Line(*cells[:4], int(cells[4])) for row in section[0].splitlines() if row.startswith("| huge input")
            for cells in [row.strip("| ").split(" | ")]]
    lines = _readers({name: counts[name] for name in TARGETS})
    group = Group("Hostile input", _tool(min(counts[name].inputs for name in TARGETS)), [*huge, *lines])
    table.write_text(page.replace(section[0], _section(group)), encoding="utf-8")
    return 1 if any(line.wrong for line in lines) else 0


def _long_day() -> Group:
    """``soak.py``, and a line for each of its figures."""
    done = subprocess.run([sys.executable, "-m", "tests.benchmarks.soak"], cwd=ROOT, capture_output=True, text=True,
                          check=False)
    print(done.stdout, end="", flush=True)
    lines = [Line(name, "", goal, value if met else f"**MISSED**: {value}", 1,
                  wrong=() if met else (f"{name}: {value}",))
             for name, value, goal, met in read_figures(done.stdout)]
    _check_ended(done, lines, 1)
    return Group("Soak", (
        "A day of driving and parking, from New Year's Eve on, through the service's own code at many times real time: "
        "in the open, under ground, and with the sensors off; the host's clock is 20 ppm fast, and a raw dump alone "
        "would exceed the quota."), lines)


def _check_ended(done: subprocess.CompletedProcess[str], lines: Sequence[Line], fewest: int) -> None:
    """It said as much as it should, and what was wrong when it failed; else no table may be made of it."""
    if len(lines) < fewest or (done.returncode and not any(line.wrong for line in lines)):
        raise RuntimeError(f"{done.args[1]} ended with {done.returncode}: {done.stderr[-1000:]}")


def _judge(groups: Sequence[Group], enough: int, figures: Figures) -> None:
    for group in groups:
        broken = [words for line in group.lines for words in line.wrong]
        print("".join(f"    {words}\n" for words in broken[:20]), end="")
        figures.at_most(f"{group.title}: promises broken", len(broken), 0, "")
    injected = groups[0].lines
    figures.at_least("crashes injected", sum(line.trials for line in injected), enough, "")
    for name, words in (("rows_lost", "rows lost beyond the promise"), ("damaged_accepted", "damaged rows accepted")):
        figures.at_most(words, sum(line.figures[name].total for line in injected if name in line.figures), 0, "")


def _page(groups: Sequence[Group]) -> str:
    reported = dict.fromkeys(line.reported for group in groups for line in group.lines if line.reported)
    parts = [HEAD, "## What `ridelog status` says\n", "In these trials, among others (times and places differ):\n",
             "\n".join(f"- {words}" for words in reported) + "\n",
             "When nothing is wrong: \"Nothing: all is well.\" What each stick is doing, and whether it may be pulled, "
             "stands above all else.\n"]
    return "\n".join([*parts, *map(_section, groups)])


def _section(group: Group) -> str:
    trials = sum(line.trials for line in group.lines)
    head = f"## {group.title}\n\n" + (f"{group.words}\n\n" if group.words else "")
    if not any(line.injected for line in group.lines):
        return head + "\n".join(["| figure | measured | goal |", "| --- | --- | --- |", *(
            f"| {line.name} | {line.happened} | {line.promised} |" for line in group.lines)]) + "\n"
    return head + "\n".join([
        "| fault | how it is injected | what is promised | what happened | trials |",
        "| --- | --- | --- | --- | --- |",
        *(f"| {line.name} | {line.injected} | {line.promised} | {_cell(line.happened)} | {line.trials} |"
          for line in group.lines), f"| **all** | | | | **{trials}** |"]) + "\n"


def _cell(words: str) -> str:
    return words.replace("|", "\\|").replace("\n", " ")


if __name__ == "__main__":
    sys.exit(main())
