"""The part "field" of the examination: cases as recorded bytes, through ``ridelog extract`` and then before the lab.

    python -m tests.validation.field --sensor serial --cases 20
    python -m tests.validation.field --sensor bma220 --cases 20 --kind none

Each case is one to four dumps, each with a measured line (``cases.field_case``). Printed are what was hidden, what was
said, and how far off the places were; then each figure beside its goal. Seeds as in ``examine``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .cases.case_files import write_case
from .cases.field_case import SENSORS, START_S, noise_of, write_field
from .cases.random_case import Case, case
from .cases.seeds import add_seed_options, first_seed, seeds
from .cases.visibility import deviations
from .marking.marks import above, all_found, hidden, near, numbers, right, said
from .marking.sitting import NoAnswer, Record, added, asked, kept_of

STANDS_OUT = 8.0
"""Deviations of the noise, over what the car's numbers and the places can do, from which on an effect should be
named."""
_START_M = 2.0  # of a receiver: starts as far off as that are all the same to the lab
NAMED = {"serial": 0.85, "bma220": 0.75}
WRONG, KNOWN, NEAR_SHARE, PLACE_M, SECONDS = 0.05, 0.95, 0.90, 0.3, 60.0
"""Goals: shares of cases with a false name, of numbers within three standard errors, and of errors within a tenth of
the true model's; of every place [m]; and of a diagnosis [s]."""


@dataclass
class Tally:
    """How many of how many."""

    words: str
    goal: str
    count: int = 0
    of: int = 0

    def take(self, holds: bool) -> None:
        """One more."""
        self.count, self.of = self.count + holds, self.of + 1

    def __str__(self) -> str:
        share = f" ({self.count / self.of:.0%})" if self.of else ""
        return f"{self.words}: {self.count} of {self.of}{share}, goal {self.goal}"


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sensor", choices=SENSORS, default=SENSORS[0])
    parser.add_argument("--kind", choices=("one", "none"), default="one")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no case after so many")
    add_seed_options(parser)
    options = parser.parse_args()
    goal = NAMED[options.sensor]
    named = Tally(f"named, of effects above {STANDS_OUT:g} deviations", f"at least {goal:.0%}")
    wrong = Tally("cases with a false name", f"at most {WRONG:.0%}")
    known = Tally("numbers within 3 standard errors, of effects that were named", f"at least {KNOWN:.0%}")
    close = Tally("errors after adding within 10 % of the true model's", f"at least {NEAR_SHARE:.0%}")
    off: list[float] = []
    seconds: list[float] = []
    cpu_s: list[float] = []
    begun = time.monotonic()
    for seed in seeds(first_seed(options), options.cases, options.release):
        if time.monotonic() - begun > 60 * options.minutes:
            print(f"time is up before {seed}")
            break
        made = case(options.kind, seed, None, noise_of(options.sensor))
        stands_out = deviations(made, _START_M)
        record, places_m = put(made, options.sensor)
        off += places_m
        is_right = right(record)
        if stands_out and min(stands_out) > STANDS_OUT:
            named.take(is_right)
        truth = {one["name"] for one in hidden(record)}
        names = record["said"]["verdict"] if record["said"] else []
        alike = is_right and names and names[0] not in truth  # it says that it cannot distinguish it from the truth
        wrong.take(bool(set(names[1:] if alike else names) - truth))
        found = list(numbers(record)) if record["said"] and all_found(record) else []
        for one in found:
            known.take(one.found is not None and abs(one.found - one.true) <= 3 * (one.standard_error or 0.0))
        ended = ""
        if record["added"] and found:
            close.take(near(record, "attainable_error"))
            ended = f"; error {above(record, 'attainable_error'):.3f} of the true model's"
        if record["said"]:
            seconds.append(record["diagnosing"]["wall_s"])
            cpu_s.append(record["diagnosing"]["cpu_s"])
        words = ", ".join(f"{one['name']} {deviation:.0f}" for one, deviation in zip(
            hidden(record), stands_out, strict=True)) or "nothing"
        took = f"; {seconds[-1]:.0f} s, {cpu_s[-1]:.0f} of the processor" if record["said"] else ""
        print(f"{seed} {'right' if is_right else 'WRONG'}: {words} -> {said(record)}; {len(places_m)} runs, places off "
              f"{', '.join(f'{one:.3f}' for one in places_m)} m{took}{ended}", flush=True)
        for one in found:
            print(f"    {one.words}", flush=True)
    for one in (named, wrong, known, close):
        print(one)
    if not off or not seconds:
        return 1
    placed = max(off) <= PLACE_M
    within = sum(one <= PLACE_M for one in off)
    print(f"places off, r.m.s.: median {np.median(off):.3f} m, largest {max(off):.3f} m, {within} "
          f"of {len(off)} runs within the goal of {PLACE_M:g} m")
    print(f"diagnosis: median {np.median(seconds):.0f} s, longest {max(seconds):.0f} s (of the processor: median "
          f"{np.median(cpu_s):.0f} s, longest {max(cpu_s):.0f} s), goal {SECONDS:g} s")
    met = (named.count >= goal * named.of, wrong.count <= WRONG * wrong.of, known.count >= KNOWN * known.of,
           close.count >= NEAR_SHARE * close.of, placed, max(seconds) <= SECONDS)
    return int(not all(met))


def put(made: Case, sensor: str) -> tuple[Record, list[float]]:
    """What the lab says of a case, and how far off the places of its runs are (r.m.s.) [m]."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        exact = folder / "exact"
        record: Record = {"kind": made.kind, "seed": made.seed, "truth": write_case(made, exact),
                          "said": None, "added": None, "failed": None}
        vehicle = (exact / "vehicle.yaml").resolve()
        runs: list[str] = []
        places_m: list[float] = []
        try:
            for drive, (dump, line) in zip(
                    made.scene.drives, write_field(made, sensor, vehicle, folder), strict=True):
                found, _ = asked(["extract", str(dump), "--out", str(folder / "runs"), "--profile", str(line),
                                  "--json"], in_process=False)
                for one in found["runs"]:
                    runs.append(one["run"])
                    table = np.genfromtxt(Path(one["run"]) / "drive.csv", delimiter=",", names=True)
                    wrong_m = table["distance_m"] - drive.distance_m(table["t_s"] - START_S)
                    places_m.append(float(np.sqrt(np.mean(wrong_m**2))))
            answer, record["diagnosing"] = asked(["diagnose", "--json", "--vehicle", str(vehicle), *runs],
                                                 in_process=False)
            record["said"] = kept_of(answer)
            record["added"] = added(exact, runs, record["said"], in_process=False)
        except NoAnswer as error:
            record["failed"] = str(error)
            print(json.dumps(record["failed"]))
    return record, places_m


if __name__ == "__main__":
    raise SystemExit(main())
