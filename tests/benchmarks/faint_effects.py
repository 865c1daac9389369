"""How faint an effect ``ridelog diagnose`` still names: effects at their usual strength in drives of a simulator that
shares nothing with the lab, under so much noise that they stand out by 5, 6 and 8 standard deviations, as planned.

    python -m tests.benchmarks.faint_effects
    python -m tests.benchmarks.faint_effects --effect dry_friction --deviations 5 --seeds 3

What can be named is bounded: noise alone may look like one of twenty effects in one search of a thousand. Where there
is noise alone, an effect with k numbers gains chi-squared with k degrees of freedom in minus twice the log-likelihood,
and each shape that it is sought at is one more trial: an effect of one number has to gain 16.4, which are 4.1
deviations, one of two numbers with six shapes 23.4 (4.8), one of three 26.5 (5.1). What is found scatters by one
deviation around what stands out. Effects that shift runs are judged by the bound of the evidence alone, which asks for
5.4.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import ridelog

from .figures import Figures
from .plan import NOISE_MPS2, VEHICLE, a_road, drives, planned

EFFECTS = ("dry_friction", "damper_asymmetry", "sensor_gain", "cg_shift", "occupant")
DEVIATIONS = (5.0, 6.0, 8.0)
NAMED = 0.5
"""Goal: of those that stand out by 5 deviations or more, where what is found scatters around what has to be gained."""
_TRIES = 4


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--effect", action="append", choices=EFFECTS, metavar="NAME", help=", ".join(EFFECTS))
    parser.add_argument("--deviations", action="append", type=float, metavar="D")
    parser.add_argument("--seeds", type=int, default=1, metavar="N")
    options = parser.parse_args(arguments)
    found: dict[float, list[bool]] = {}
    others = 0
    for wanted in options.deviations or DEVIATIONS:
        for name in options.effect or EFFECTS:
            noise_mps2 = noise_for(name, wanted)
            for seed in range(1, options.seeds + 1):
                said = ridelog.diagnose(VEHICLE, drives(name, noise_mps2, a_road(), seed))
                group = [*said.verdict, *(other for one in said.candidates if one.effect in said.verdict
                                          for other in one.confused_with)]
                found.setdefault(wanted, []).append(name in group)
                others += sum(one != name for one in said.verdict)
                chance = next(one.p_value for one in said.candidates if one.effect == name)
                print(f"{name} by {wanted:g} deviations, noise {noise_mps2:.2g} m/s2, seed {seed}: "
                      f"{', '.join(said.verdict) or 'nothing'} named; chance of {name} {chance:.2g}", flush=True)
    figures = Figures()
    for wanted, named in found.items():
        if wanted >= 5.0:
            figures.at_least(f"named where it stands out by {wanted:g} deviations", sum(named) / len(named), NAMED, "")
        else:
            print(f"named where it stands out by {wanted:g} deviations: {sum(named)} of {len(named)}")
    figures.at_most("other effects that were named", others, 0, "")
    return 1 if figures.missed else 0


def noise_for(name: str, deviations: float) -> float:
    """The sensor's noise under which a plan says that an effect stands out by so much [m/s2]."""
    noise_mps2 = NOISE_MPS2
    for _ in range(_TRIES):
        noise_mps2 *= planned(a_road(), noise_mps2, (name,)).detectability[name] / deviations
    return noise_mps2


if __name__ == "__main__":
    sys.exit(main())
