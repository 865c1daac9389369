"""A bench quarter car whose numbers nobody knows: is the effect that its file lacks named, and are its numbers right?

Rigs of 2.5 kg are drawn, with friction of the wheel's guide, of the body's guide or of the suspension, with a spring
that hardens or has play, and with none of these; the masses and springs of their file are off by up to a factor of
two, one alone, the sprung mass, was weighed. Each is shaken twice by one sweep of 30 s, by an integrator that shares
nothing with ridelog. One draw takes minutes:

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

import ridelog

from ..support.drives.bench_rig import Rig, shaken, swept_table, write_run
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


HEADER = "hidden,seed,right,named,off_sd,seconds"


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    results = Path(sys.argv[1] if len(sys.argv) > 1 else f"{mkdtemp()}/results.csv")
    draws = int(sys.argv[2]) if len(sys.argv) > 2 else DRAWS
    if not results.exists():
        results.write_text(f"{HEADER}\n", "utf-8")
    done = {tuple(line.split(",")[:2]) for line in results.read_text("utf-8").splitlines()[1:]}
    for seed in range(draws):
        for words, (effect, number, hidden, size) in HIDDEN.items():
            if (words, str(seed)) in done:
                continue
            began_s = time.perf_counter()
            with TemporaryDirectory() as folder:
                names, off_sd = one(Path(folder), effect, number, hidden, size, seed)
            right = names == ((effect,) if effect else ()) and off_sd < SURE
            with results.open("a", encoding="utf-8") as file:
                file.write(f"{words},{seed},{right:d},{'+'.join(names)},{off_sd:.2f},"
                           f"{time.perf_counter() - began_s:.0f}\n")
    return shown([line.split(",") for line in results.read_text("utf-8").splitlines()[1:]])


def shown(lines: list[list[str]]) -> int:
    """Print what all draws came to; 1 when a goal is missed."""
    figures = Figures()
    for words, (effect, *_) in HIDDEN.items():
        mine = [line for line in lines if line[0] == words]
        if mine:
            figures.at_least(f"{words}: {'named, within three standard errors' if effect else 'nothing named'}",
                             sum(line[2] == "1" for line in mine) / len(mine), 0.95 if effect else 1.0,
                             f"of {len(mine)}")
            figures.at_most(f"{words}: a diagnosis takes", sum(float(line[5]) for line in mine) / len(mine), 120.0, "s")
    return 1 if figures.missed else 0


def one(folder: Path, effect: str, number: str, hidden: str, size: float, seed: int
        ) -> tuple[tuple[str, ...], float]:
    """What is named on one draw, and by how many standard errors the number of the effect is off; 0 where it is not
    among them."""
    rng = np.random.default_rng(seed)

    def near(value: float, factor: float) -> float:
        return float(value * factor ** rng.uniform(-1, 1))

    rig = Rig(near(2.5, 1.25), near(1.0, 1.25), near(900, 1.25), near(7.5, 1.25), near(6000, 1.25),
              tire_damper=near(38, 1.25), **({hidden: near(size, 1.5)} if hidden else {}))
    vehicle = folder / "rig.yaml"
    vehicle.write_text(
        f"name: bench\nmodel: quarter_car\nsprung_mass_kg: {rig.body_kg * 1.01} +- 2%\nfront:\n"
        f"  unsprung_mass_kg: {near(rig.wheel_kg, 2)} +- 100%\n"
        f"  suspension_stiffness_n_per_m: {near(rig.spring, 2)} +- 100%\n"
        f"  suspension_damping_n_s_per_m: {near(rig.damper, 2)} +- 100%\n"
        f"  tire_stiffness_n_per_m: {near(rig.tire, 2)} +- 100%\ncontact_patch_m: 0\n"
        f"effects: [{{name: tire_damping, tire_damping_n_s_per_m: {near(rig.tire_damper, 2)}}}]\n", "utf-8")
    seen = shaken(rig, swept_table(LASTS_S, 1.0, 15.0, 0.006))
    for run in range(2):
        write_run(folder / f"run{run}", seen, NOISE_MPS2, 100 * seed + run)
    found = ridelog.diagnose(vehicle, [folder / "run0", folder / "run1"])
    there = next((one for one in found.candidates if effect and one.effect == effect), None)
    if there is None or effect not in found.verdict:
        return tuple(found.verdict), 0.0
    error = there.standard_errors[number]
    return tuple(found.verdict), abs(there.parameters[number] - getattr(rig, hidden)) / error


if __name__ == "__main__":
    sys.exit(main())
