"""Make cases of the examination.

    python -m tests.validation.make --kind one --count 20 --first-seed 1 --out DIR --truth DIR2

writes DIR/one-0001 ... and DIR2/one-0001.json ... ; --effect NAME fixes the effect (of `two`, the first one).
Kinds: none, one, two (both on the list), outsider (not on the list), two_outsider (one of each). Seeds that are kept
for releases (``cases.seeds``) are refused without --release.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .cases.case_files import write_case, write_truth
from .cases.random_case import KINDS, case
from .cases.seeds import seeds
from .simulator.effects import EFFECTS
from .simulator.outsiders import OUTSIDERS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=KINDS, required=True)
    parser.add_argument("--count", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--effect", choices=[*EFFECTS, *OUTSIDERS])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--release", action="store_true", help="of the seeds that are kept for releases")
    options = parser.parse_args()
    try:
        asked = seeds(options.first_seed, options.count, options.release)
    except ValueError as error:
        parser.error(str(error))
    for seed in asked:
        name = "-".join([options.kind, *([options.effect] if options.effect else []), f"{seed:04d}"])
        answer = write_case(case(options.kind, seed, options.effect), options.out / name)
        write_truth(answer, options.truth / f"{name}.json")
        hidden = [f"{each['name']} {each['strength']:.2f}" for each in [*answer["effects"], *answer["outsiders"]]]
        print(f"{name}: {', '.join(hidden) or 'nothing'}; noise floor {answer['noise_floor_error']:.3f}, attainable "
              f"{answer['attainable_error']:.3f}, without effects {answer['error_without_effects']:.3f}", flush=True)


if __name__ == "__main__":
    main()
