"""The part "field" of the examination: cases as recorded bytes, through ``ridelog extract`` and then before the lab.

    python -m tests.validation.field --sensor serial --cases 20
    python -m tests.validation.field --sensor bma220 --cases 20 --kind none

Each case is one to four dumps, each with a measured line (``cases.field_case``). Printed are what was hidden, what was
said, and how far off the places were; then the shares. Seeds as in ``examine``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from .cases.case_files import write_case
from .cases.field_case import SENSORS, START_S, noise_of, write_field
from .cases.random_case import Case, case
from .cases.seeds import DEVELOPMENT_SEEDS, RELEASE_SEEDS, seeds
from .marking.marks import hidden, right, said
from .marking.sitting import NoAnswer, Record, asked, kept_of

STANDS_OUT = 8.0
"""Deviations of the noise, from which on an effect should be named."""
GOALS = {"serial": 0.85, "bma220": 0.75}
PLACE_GOAL_M = 0.3


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sensor", choices=SENSORS, default=SENSORS[0])
    parser.add_argument("--kind", choices=("one", "none"), default="one")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--release", action="store_true", help="of the seeds that no development run has used")
    options = parser.parse_args()
    first = options.first_seed or (RELEASE_SEEDS if options.release else DEVELOPMENT_SEEDS)[0]
    named = strong = wrong = 0
    off: list[float] = []
    for seed in seeds(first, options.cases, options.release):
        made = case(options.kind, seed, None, noise_of(options.sensor))
        record, places_m = put(made, options.sensor)
        off += places_m
        stands_out = all(one["strength"] > STANDS_OUT for one in hidden(record)) and bool(hidden(record))
        is_right = right(record)
        strong, named = strong + stands_out, named + (stands_out and is_right)
        truth = {one["name"] for one in hidden(record)}
        wrong += bool(record["said"] and set(record["said"]["verdict"]) - truth and not is_right)
        words = ", ".join(f"{one['name']} {one['strength']:.1f}" for one in hidden(record)) or "nothing"
        print(f"{seed} {'right' if is_right else 'WRONG'}: {words} -> {said(record)}; places off "
              f"{', '.join(f'{one:.3f}' for one in places_m)} m", flush=True)
    share = named / strong if strong else float("nan")
    goal = GOALS[options.sensor]
    print(f"named of those above {STANDS_OUT:g} deviations: {named} of {strong} (goal {goal:.0%})")
    print(f"wrong names: {wrong} of {options.cases} (goal 5 %)")
    print(f"places off, r.m.s.: median {np.median(off):.3f} m, largest {max(off):.3f} m (goal {PLACE_GOAL_M:g})")
    return int(share < goal or wrong > 0.05 * options.cases or max(off) > PLACE_GOAL_M)


def put(made: Case, sensor: str) -> tuple[Record, list[float]]:
    """What the lab says of a case, and how far off the places of its runs are (r.m.s.) [m]."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record: Record = {"kind": made.kind, "seed": made.seed, "truth": write_case(made, folder / "exact"),
                          "said": None, "added": None, "failed": None}
        vehicle = (folder / "exact" / "vehicle.yaml").resolve()
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
        except NoAnswer as error:
            record["failed"] = str(error)
            print(json.dumps(record["failed"]))
    return record, places_m


if __name__ == "__main__":
    raise SystemExit(main())
