"""Rigs and cars whose numbers nobody knows: is the effect that their file lacks named, and are its numbers right?

Rigs of 2.5 kg are drawn, with friction of the wheel's guide, of the body's guide or of the suspension, with a spring
that hardens or has play, and with none of these; the masses and springs of their file are off by up to a factor of
two, one alone, the sprung mass, was weighed. Each is shaken twice by one sweep of 30 s, by an integrator that shares
nothing with ridelog. Half cars on roads are those of the examination, with one effect or none, whose file knows masses
to 10 %, lengths, and nothing else. One draw takes minutes:

    nice python -m tests.benchmarks.unknown_numbers RESULTS.csv [DRAWS]

Each draw is a line of RESULTS.csv, written when it is done; a run that was stopped goes on where it was, one of each
rig in turn, and what is there is printed.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

import numpy as np
import yaml

import ridelog

from ..support.drives.bench_rig import Rig, shaken, swept_table, write_run
from ..validation.cases.case_files import write_case
from ..validation.cases.random_case import case
from .figures import Figures

LASTS_S, NOISE_MPS2, DRAWS, SURE = 30.0, 0.02, 20, 3.0
HIDDEN = {
    "wheel guide": ("frame_friction", "friction_force_n", "wheel_guide_n", 4.6),
    "body guide": ("frame_friction", "body_friction_force_n", "body_guide_n", 1.5),
    "suspension": ("dry_friction", "friction_force_n", "friction_n", 1.0),
    "cubic spring": ("progressive_spring", "cubic_stiffness_n_per_m3", "cubic", 4e6),
    "play": ("play", "half_gap_m", "gap_m", 5e-4),
    "nothing": ("", "", "", 0.0),
}
"""Effect, its number, that of the rig, and its size."""
ROADS = {"a road, one effect": "one", "a road, nothing": "none"}
"""Kinds of the development cases of the examination, from this seed on; of rigs any seeds do."""
FIRST_SEED, MASSES = 6860, 0.1
GOALS = {**{words: 0.95 if effect else 1.0 for words, (effect, *_) in HIDDEN.items()},
         **dict(zip(ROADS, (0.80, 0.98), strict=True))}

HEADER = "hidden,seed,right,named,off_sd,seconds"


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    results = Path(sys.argv[1] if len(sys.argv) > 1 else f"{mkdtemp()}/results.csv")
    draws = int(sys.argv[2]) if len(sys.argv) > 2 else DRAWS
    if not results.exists():
        results.write_text(f"{HEADER}\n", "utf-8")
    done = {tuple(line.split(",")[:2]) for line in results.read_text("utf-8").splitlines()[1:]}
    for seed in range(draws):
        for words in GOALS:
            if (words, str(seed)) in done:
                continue
            began_s = time.process_time()
            with TemporaryDirectory() as folder:
                expected, names, off_sd = rig(Path(folder), words, seed) if words in HIDDEN else car(
                    Path(folder), ROADS[words], seed)
            right = names == expected and off_sd < SURE
            with results.open("a", encoding="utf-8") as file:
                file.write(f"{words},{seed},{right:d},{'+'.join(names)},{off_sd:.2f},"
                           f"{time.process_time() - began_s:.0f}\n")
    return shown([line.split(",") for line in results.read_text("utf-8").splitlines()[1:]])


def shown(lines: list[list[str]]) -> int:
    """Print what all draws came to; 1 when a goal is missed."""
    figures = Figures()
    for words, goal in GOALS.items():
        mine = [line for line in lines if line[0] == words]
        if mine:
            figures.at_least(f"{words}: right", sum(line[2] == "1" for line in mine) / len(mine), goal,
                             f"of {len(mine)}")
            figures.at_most(f"{words}: a diagnosis takes", sum(float(line[5]) for line in mine) / len(mine), 120.0,
                            "s of processor")
    return 1 if figures.missed else 0


def car(folder: Path, kind: str, seed: int) -> tuple[tuple[str, ...], tuple[str, ...], float]:
    """The effects of a case of the examination, and what is named where its file knows masses and lengths alone."""
    truth, rng = write_case(case(kind, FIRST_SEED + seed), folder), np.random.default_rng(seed)
    path = folder / "vehicle.yaml"

    def known(name: str, value: object) -> object:
        if isinstance(value, dict):
            return {each: known(each, inner) for each, inner in value.items()}
        if "mass" in name:
            return f"{value * np.exp(MASSES * rng.standard_normal()):.4g} +- {MASSES:.0%}"
        return "unknown" if isinstance(value, float) and not name.endswith("_m") else value

    path.write_text(yaml.safe_dump(known("", yaml.safe_load(path.read_text("utf-8")))), "utf-8")
    found = ridelog.diagnose(path, sorted(folder.glob("run*")))
    return tuple(one["name"] for one in truth["effects"]), tuple(found.verdict), 0.0


def rig(folder: Path, words: str, seed: int) -> tuple[tuple[str, ...], tuple[str, ...], float]:
    """The effect of a draw, what is named, and by how many standard errors the number of the effect is off; 0 where it
    is not among them."""
    effect, number, hidden, size = HIDDEN[words]
    expected = (effect,) if effect else ()
    rng = np.random.default_rng(seed)

    def near(value: float, factor: float) -> float:
        return float(value * factor ** rng.uniform(-1, 1))

    drawn = Rig(near(2.5, 1.25), near(1.0, 1.25), near(900, 1.25), near(7.5, 1.25), near(6000, 1.25),
                tire_damper=near(38, 1.25), **({hidden: near(size, 1.5)} if hidden else {}))
    vehicle = folder / "rig.yaml"
    vehicle.write_text(
        f"name: bench\nmodel: quarter_car\nsprung_mass_kg: {drawn.body_kg * 1.01} +- 2%\nfront:\n"
        f"  unsprung_mass_kg: {near(drawn.wheel_kg, 2)} +- 100%\n"
        f"  suspension_stiffness_n_per_m: {near(drawn.spring, 2)} +- 100%\n"
        f"  suspension_damping_n_s_per_m: {near(drawn.damper, 2)} +- 100%\n"
        f"  tire_stiffness_n_per_m: {near(drawn.tire, 2)} +- 100%\ncontact_patch_m: 0\n"
        f"effects: [{{name: tire_damping, tire_damping_n_s_per_m: {near(drawn.tire_damper, 2)}}}]\n", "utf-8")
    seen = shaken(drawn, swept_table(LASTS_S, 1.0, 15.0, 0.006))
    for run in range(2):
        write_run(folder / f"run{run}", seen, NOISE_MPS2, 100 * seed + run)
    found = ridelog.diagnose(vehicle, [folder / "run0", folder / "run1"])
    there = next((one for one in found.candidates if effect and one.effect == effect), None)
    if there is None or effect not in found.verdict:
        return expected, tuple(found.verdict), 0.0
    error = there.standard_errors[number]
    return expected, tuple(found.verdict), abs(there.parameters[number] - getattr(drawn, hidden)) / error


if __name__ == "__main__":
    sys.exit(main())
