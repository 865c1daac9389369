"""Is anything lost that was promised? Crashes and failing disks by the thousand; one line per fault.

* The storage of the service (log, sidecars, counter, raw dump) cut after every change of the disk: the process killed,
  or the power gone, with what was not synced dropped, torn, reordered or changed, and names early and late; three of
  ten repairs are cut as well.
* A disk that refuses every kind of change, once or for a while, from each round of the main loop on.
* The real ``ridelog run`` killed at random under load.
"""

from __future__ import annotations

import argparse
import errno
import logging
import random
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from figures import Figures

sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))
from crashes import ERRORS, KINDS, Life, Outcome, crash, outage
from killing import kill_many

STEPS = 30
SERVICES = 8
MEMORY = Path("/dev/shm")
"""The model of the disk needs no disk, and is quicker without."""


def main() -> int:
    """Print the table; exit 1 when a promise was broken."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lives", type=int, default=12, help="sessions that are cut after every change")
    parser.add_argument("--kills", type=int, default=208, help=f"of the real process, in {SERVICES} services; 0: none")
    parser.add_argument("--longest", type=float, default=20.0, metavar="S", help="most seconds before a kill")
    args = parser.parse_args()
    logging.disable(logging.CRITICAL)
    figures = Figures()
    injected = 0
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as name:
        for power in (False, True):
            outcomes = _crashes(Path(name), args.lives, power)
            injected += len(outcomes)
            _tell(figures, "power cut" if power else "process killed", outcomes)
        for error in ERRORS:
            _tell(figures, f"disk refuses: {errno.errorcode[error]}", _outages(Path(name), error))
    if args.kills:
        with tempfile.TemporaryDirectory() as name:
            injected += _kills(figures, Path(name), args.kills, args.longest)
    figures.at_least("crashes injected", injected, 1000, "")
    return 1 if figures.missed else 0


def _crashes(folder: Path, lives: int, power: bool) -> list[Outcome]:
    outcomes = []
    for seed in range(lives):
        (folder / "life").mkdir()
        life = Life(folder / "life", seed, STEPS)
        rng = random.Random(seed)
        outcomes += [crash(life, count, power, rng, folder / "after")
                     for count in range(len(life.files.journal) + 1) for _ in range(2 if power else 1)]
        shutil.rmtree(folder / "life")
    return outcomes


def _outages(folder: Path, error: int) -> list[Outcome]:
    outcomes = []
    for kinds in [*((kind,) for kind in KINDS), KINDS]:
        for begin in range(3, 16):
            for length in (1, 12):
                outcomes.append(outage(folder / "outage", error, kinds, begin, length))
                shutil.rmtree(folder / "outage")
    return outcomes


def _tell(figures: Figures, fault: str, outcomes: Sequence[Outcome]) -> None:
    promised = sum(outcome.rows_promised for outcome in outcomes)
    print(f"{fault}: {len(outcomes)} trials; rows promised {promised}, found "
          f"{sum(outcome.rows_found for outcome in outcomes)}; events promised "
          f"{sum(outcome.events_promised for outcome in outcomes)}, found "
          f"{sum(outcome.events_found for outcome in outcomes)}; damaged lines seen and refused "
          f"{sum(outcome.torn_or_damaged for outcome in outcomes)}")
    wrong = [outcome.wrong for outcome in outcomes if outcome.wrong]
    print("".join(f"    {words}\n" for words in wrong[:10]), end="")
    figures.at_most(f"{fault}: promises broken", len(wrong), 0, "")


def _kills(figures: Figures, folder: Path, kills: int, longest_s: float) -> int:
    found = kill_many(folder, -(-kills // SERVICES), SERVICES, longest_s, seed=1)
    wrong = [words for service in found for words in service.wrong]
    count = sum(service.kills for service in found)
    print(f"real process killed: {count} trials; rows left {sum(service.rows for service in found)}, of them told by "
          f"status before {sum(service.rows_told for service in found)}; torn rows {sum(s.torn_tails for s in found)}; "
          f"dumps cut off {sum(service.dumps for service in found)}")
    print("".join(f"    {words}\n" for words in wrong[:10]), end="")
    figures.at_most("real process killed: promises broken", len(wrong), 0, "")
    return count


if __name__ == "__main__":
    sys.exit(main())
