"""The part "filtered" of the examination: records that somebody low-passed at 8 to 40 Hz before they came to the lab.

    python -m tests.validation.filtered --cases 10
    python -m tests.validation.filtered --cases 10 --kind one

Each case is one of the examination's, with nothing missing or with one effect, filtered as ``cases.filtered_case``
says. Printed are what was done and hidden, and what was said; then the shares beside the goals. A name is wrong unless
it is the hidden effect's, or ``sensor_bandwidth`` for a filter that delays, with a cut-off within 15 % of where the
filter has taken 3 dB. Seeds as in ``examine``.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from .cases.case_files import write_case
from .cases.filtered_case import LOW_PASS, draw_filter, filtered, wrong_names
from .cases.random_case import Case, case
from .cases.seeds import add_seed_options, first_seed, seeds
from .marking.sitting import NoAnswer, asked
from .simulator.effects import EFFECTS

STANDS_OUT = 8.0
"""Deviations of the noise, from which on an effect should be named."""
HIDDEN = [name for name in EFFECTS if name != LOW_PASS]


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=("none", "one"), default="none")
    parser.add_argument("--cases", type=int, default=10)
    add_seed_options(parser)
    options = parser.parse_args()
    wrong = strong = named = 0
    for seed in seeds(first_seed(options), options.cases, options.release):
        by = draw_filter(options.kind, seed)
        made = case(options.kind, seed, HIDDEN[seed % len(HIDDEN)] if options.kind == "one" else None)
        said, rest = put(filtered(made, by))
        hidden = {one.effect.name: one.strength for one in made.hidden}
        bad = wrong_names(by, set(hidden), said)
        wrong += bool(bad)
        stands_out = bool(hidden) and min(hidden.values()) > STANDS_OUT
        strong, named = strong + stands_out, named + (stands_out and set(hidden) <= set(said))
        words = ", ".join(f"{name} {value:.1f}" for name, value in hidden.items()) or "nothing"
        print(f"{seed} {'WRONG' if bad else 'right'}: {by}; {words} -> {_said(said)}{rest}", flush=True)
    print(f"wrong names: {wrong} of {options.cases} cases (goal 0)")
    if options.kind == "one":
        print(f"named of those above {STANDS_OUT:g} deviations before the filter: {named} of {strong}")
    return int(wrong > 0)


def put(made: Case) -> tuple[dict[str, dict[str, float]], str]:
    """The verdict on a case, with numbers; and what else is worth a look."""
    with tempfile.TemporaryDirectory() as folder:
        write_case(made, folder)
        runs = [str(Path(folder) / f"run{number}") for number in range(1, len(made.recordings) + 1)]
        try:
            answer, cost = asked(["diagnose", "--json", "--vehicle", str(Path(folder) / "vehicle.yaml"), *runs],
                                 in_process=False)
        except NoAnswer as error:
            return {}, f" NO ANSWER: {error}"
    numbers = {one["effect"]: one["parameters"] for one in answer["candidates"]}
    band = answer.get("pass_band_hz")
    compared = "" if band is None else f"; compared up to {band[1]:.1f} Hz"
    return ({name: numbers[name] for name in answer["verdict"]},
            f"{compared}{'; unexplained' * answer['unexplained']}; {cost['wall_s']:.0f} s")


def _said(said: dict[str, dict[str, float]]) -> str:
    return ", ".join(f"{name} ({', '.join(f'{key} {value:.3g}' for key, value in numbers.items())})"
                     for name, numbers in said.items()) or "nothing"


if __name__ == "__main__":
    raise SystemExit(main())
