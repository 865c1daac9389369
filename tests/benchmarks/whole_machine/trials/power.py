"""Power cuts: what was promised before, against what is there after."""

from __future__ import annotations

import random
import statistics
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from ..bench import Bench, Car
from ..catalogue import Report, trial
from ..guest import GuestFailed
from ..rows import Looks, Outcome, compare, read_looks

CUTS, QUICK_CUTS = 104, 6
GUESTS = 2
EARLY_SHARE = 0.15
"""Share of the cuts that come while it boots, repairs or starts."""

FIRST_ROW_LIMIT_S = 180.0
ROWS_BEFORE = 4
"""The first row is of the time before the first fix; from the fourth on they flow."""


@dataclass
class Cuts:
    """What a series of cuts gave."""

    outcomes: list[Outcome] = field(default_factory=list)
    early: int = 0
    first_row_s: list[float] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    verify: str = ""

    def total(self, name: str) -> int:
        """The sum of one field of the outcomes."""
        return sum(getattr(outcome, name) for outcome in self.outcomes)


@trial("no row older than a second is lost by a power cut, and no damaged row is taken for a good one; "
       "the disk drops what was not flushed, and writes some of it in any order")
def power_cuts(bench: Bench, report: Report) -> None:
    """Cuts at random moments, also while it boots and repairs, in guests side by side."""
    count = QUICK_CUTS if bench.quick else CUTS
    _ = bench.installed, bench.drive
    with ThreadPoolExecutor(GUESTS) as pool:
        series = list(pool.map(lambda number: cut_often(bench, f"cuts-{number}", count // GUESTS, "honest"),
                               range(GUESTS)))
    cuts = joined(series)
    report.times = len(cuts.outcomes) + cuts.early
    lost = cuts.total("lost")
    report.check("promised rows that were lost", lost == 0, f"{lost} of {cuts.total('promised')} promised, in "
                 f"{len(cuts.outcomes)} cuts while rows came and {cuts.early} while it booted, repaired or started")
    report.check("rows were promised before the cuts", cuts.total("promised") > len(cuts.outcomes),
                 f"{cuts.total('promised')} rows")
    report.check("rows with a right check value that differ from what was seen", cuts.total("strange") == 0,
                 cuts.total("strange"))
    report.check("damaged lines in repaired files", cuts.total("damaged") == 0, cuts.total("damaged"))
    report.check("starts that named a problem with the repair", not cuts.problems, "; ".join(cuts.problems[:3]) or 0)
    report.check("ridelog verify of all logs after the last cut", "WRONG" not in cuts.verify, cuts.verify)
    report.check("power on to first row [s]", bool(cuts.first_row_s), spread(cuts.first_row_s))
    report.measure("newer rows that the cuts cost (nothing is promised)", f"{cuts.total('newer_lost')} rows")


@trial("the trial above is able to fail: on a disk that ignores flushes, promised rows are lost")
def power_cuts_on_a_disk_that_lies(bench: Bench, report: Report) -> None:
    """The control."""
    report.times = 2 if bench.quick else 4
    cuts = cut_often(bench, "cuts-lies", report.times, "lies")
    report.check("promised rows that were lost", cuts.total("lost") > 0,
                 f"{cuts.total('lost')} of {cuts.total('promised')}")


def spread(seconds: list[float]) -> str:
    """Least, median and greatest of some times."""
    if not seconds:
        return "none"
    return f"{min(seconds):.0f} to {max(seconds):.0f}, median {statistics.median(seconds):.0f}"


def joined(series: list[Cuts]) -> Cuts:
    """Several series as one."""
    return Cuts([outcome for cuts in series for outcome in cuts.outcomes], sum(cuts.early for cuts in series),
                [s for cuts in series for s in cuts.first_row_s], [text for cuts in series for text in cuts.problems],
                "; ".join(cuts.verify for cuts in series))


def cut_often(bench: Bench, name: str, count: int, card: str) -> Cuts:
    """Boot, drive, cut, again and again on the same disk; all that was ever promised is looked for at the end."""
    rng = random.Random(name)
    cuts = Cuts()
    seen: list[Looks] = []
    with bench.car(name, chip="dump", card=card, watch=True) as car:
        looks = car.guest.share / "looks.txt"
        while len(seen) + cuts.early < count:
            looks.unlink(missing_ok=True)
            if rng.random() < EARLY_SHARE and seen:
                car.start()
                time.sleep(rng.uniform(2, 25))
                cuts.early += 1
            else:
                cuts.first_row_s.append(drive_until_rows(car, looks, rng.uniform(0, 10)))
            car.guest.cut_power()
            text = looks.read_text() if looks.exists() else ""
            if read_looks(text).ages_s or len(seen) + cuts.early == 0:
                seen.append(read_looks(text))
                (car.guest.folder / f"looks-{len(seen)}.txt").write_text(text)
            print(f"  {name}: cut {len(seen) + cuts.early}, {len(read_looks(text).promised)} rows promised", flush=True)
        files = logs_after(car, cuts)
    cuts.outcomes = [compare(looks, _of_session(files, looks)) for looks in seen]
    return cuts


def drive_until_rows(car: Car, looks: Path, more_s: float) -> float:
    """Boot and drive until rows have come for ``more_s``; seconds from power on to the first row."""
    car.start()
    first_s = 0.0
    end_s = time.monotonic() + FIRST_ROW_LIMIT_S
    while (rows := len(read_looks(looks.read_text()).ages_s) if looks.exists() else 0) < ROWS_BEFORE:
        if rows and not first_s:
            first_s = time.monotonic() - car.guest.started_s
        if time.monotonic() > end_s or not car.guest.is_on:
            raise GuestFailed(f"no {ROWS_BEFORE} rows within {FIRST_ROW_LIMIT_S:.0f} s; see {car.guest.folder}")
        time.sleep(0.3)
    time.sleep(more_s)
    return first_s or time.monotonic() - car.guest.started_s


def logs_after(car: Car, cuts: Cuts) -> dict[str, str]:
    """The logs after one more boot, with what the journal and verify say of them."""
    car.boot()
    car.wait_for("the service", "systemctl is-active ridelog.service", 180)
    car.guest.must("systemctl stop ridelog && rm -rf /host/logs && mkdir /host/logs && "
                   "cp /var/lib/ridelog/*.csv* /var/lib/ridelog/*.json /host/logs/", 120)
    journal = car.guest.run("journalctl -u ridelog -o cat | grep -iE 'problem=[^ ]|traceback|could not be repaired' "
                            "| tail -5").out
    cuts.problems = [line for line in journal.splitlines() if "problem=None" not in line]
    cuts.verify = " ".join(car.guest.run("ridelog verify /var/lib/ridelog 2>&1 | sed -n 1p; "
                                         "ridelog verify /var/lib/ridelog | grep WRONG | head -3", 300).out.split())
    (car.guest.folder / "journal.txt").write_text(car.guest.run("journalctl -u ridelog -o short", 300).out)
    return {path.name: path.read_text() for path in (car.guest.share / "logs").glob("*.csv*")}


def _of_session(files: dict[str, str], looks: Looks) -> dict[str, str]:
    sessions = {name.split("-")[0] for name, _ in looks.ages_s}
    return {name: text for name, text in files.items() if name.split("-")[0] in sessions}
