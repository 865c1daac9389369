"""The lab without a profile, examined: drives of one car over one road at two or three speeds.

    python -m tests.validation.same_road --sensor serial --drives 3 --cases 2 dry_friction none
    python -m tests.validation.same_road --sensor bma220 --drives 2 --cases 4 --extracted none

Each case hides one effect (or nothing), of a simulator that shares nothing with ridelog. With ``--extracted`` the
drives are recorded bytes, extracted without a profile. An answer is right if what it names first, or says that it
cannot be distinguished from that, is what was hidden, and it names no more; false if it names another; undecided if it
names nothing. Seeds as in ``examine``.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path

from .cases.case_files import write_case
from .cases.field_case import SENSORS, noise_of, write_field
from .cases.same_road import same_road_case
from .cases.seeds import add_seed_options, first_seed, seeds
from .marking.sitting import asked

SPEEDS_MPS = {2: (9.0, 15.0), 3: (8.0, 13.0, 19.0)}
FALSE, SECONDS = 0.05, 60.0
"""Goals: share of answers that are false; seconds of processor that a diagnosis takes."""


def verdict_on(said: dict[str, object], hidden: str | None) -> str:
    """``right``, ``false`` or ``undecided``, of an answer as the lab prints it."""
    verdict = said["verdict"]
    assert isinstance(verdict, list)
    if not verdict:
        return "undecided" if hidden else "right"
    candidates = said["candidates"]
    assert isinstance(candidates, list)
    alike = next(one["confused_with"] for one in candidates if one["effect"] == verdict[0])
    return "right" if hidden in (verdict[0], *alike) and len(verdict) == 1 else "false"


def main() -> int:
    """Print each answer and how many there are of each kind; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="+", help="names of effects, or none")
    parser.add_argument("--sensor", choices=SENSORS, default=SENSORS[0])
    parser.add_argument("--drives", type=int, choices=tuple(SPEEDS_MPS), default=2)
    parser.add_argument("--cases", type=int, default=1, help="of each effect")
    parser.add_argument("--strength", type=float, default=8.0, help="of an effect, over the noise")
    parser.add_argument("--length", type=float, default=200.0, help="of the road [m]")
    parser.add_argument("--extracted", action="store_true")
    add_seed_options(parser)
    options = parser.parse_args()
    counts: Counter[tuple[bool, str]] = Counter()
    longest_s = 0.0
    for seed in seeds(first_seed(options), options.cases, options.release):
        for word in options.effects:
            hidden = None if word == "none" else word
            made = same_road_case(seed, hidden, options.strength, options.length, SPEEDS_MPS[options.drives],
                                  noise_by=noise_of(options.sensor))
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                write_case(made, folder / "exact")
                vehicle = (folder / "exact" / "vehicle.yaml").resolve()
                runs = [str(one) for one in sorted((folder / "exact").glob("run*"))]
                if options.extracted:
                    dumps = [str(dump) for dump, _ in
                             write_field(made, options.sensor, vehicle, folder, one_road=True)]
                    found, _ = asked(["extract", *dumps, "--out", str(folder / "runs"), "--json"], in_process=False)
                    runs = [one["run"] for one in found["runs"]]
                said, took = asked(["diagnose", "--same-road", "--json", "--vehicle", str(vehicle), *runs],
                                   in_process=False)
            kind = verdict_on(said, hidden)
            counts[hidden is not None, kind] += 1
            longest_s = max(longest_s, took["cpu_s"])
            first = next((one for one in said["candidates"] if one["effect"] in said["verdict"]), None)
            alike = f" or {', '.join(first['confused_with'])}" if first and first["confused_with"] else ""
            print(f"{seed} {kind}: {word} -> {', '.join(said['verdict']) or 'nothing'}{alike}; maybe "
                  f"{', '.join(said['undecided']) or 'nothing'}; {said['residual_over_noise']:.2f} of the noise; error "
                  f"{', '.join(format(one['error'], '.3f') for one in said['errors'][:-1])}, of the noise alone "
                  f"{said['noise_floor_error']:.3f}; {took['cpu_s']:.0f} s of the processor", flush=True)
    false = sum(count for (_, kind), count in counts.items() if kind == "false")
    for hides, words in ((True, "one effect"), (False, "nothing")):
        each = {kind: counts[hides, kind] for kind in ("right", "false", "undecided")}
        if total := sum(each.values()):
            print(f"{words} hidden, {total} cases: " + ", ".join(f"{count} {kind}" for kind, count in each.items()))
    print(f"false: {false} of {counts.total()}, goal at most {FALSE:.0%}")
    print(f"diagnosis: longest {longest_s:.0f} s of the processor, goal {SECONDS:g} s")
    return int(false > FALSE * counts.total() or longest_s > SECONDS)


if __name__ == "__main__":
    raise SystemExit(main())
