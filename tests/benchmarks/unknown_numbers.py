"""A bench quarter car whose numbers nobody knows: is the effect that its file lacks named, and are its numbers right?

Rigs of 2.5 kg are drawn, with friction of the wheel's guide, of the body's guide or of the suspension, with a spring
that hardens, and with none of these; the masses and springs of their file are off by up to a factor of two, one alone,
the sprung mass, was weighed. Each is shaken twice by one sweep of 30 s, by an integrator that shares nothing with
ridelog. ``python -m tests.benchmarks.unknown_numbers [DRAWS]``: one draw takes minutes.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import ridelog

from ..support.drives.bench_rig import Rig, shaken, swept_table, write_run
from .figures import Figures

LASTS_S, NOISE_MPS2, DRAWS = 30.0, 0.02, 20
HIDDEN = {
    "wheel guide": ("frame_friction", "friction_force_n", "wheel_guide_n", 4.6),
    "body guide": ("frame_friction", "body_friction_force_n", "body_guide_n", 1.5),
    "suspension": ("dry_friction", "friction_force_n", "friction_n", 1.0),
    "cubic spring": ("progressive_spring", "cubic_stiffness_n_per_m3", "cubic", 4e6),
    "nothing": ("", "", "", 0.0),
}
"""Effect, its number, that of the rig, and its size."""


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures, draws = Figures(), int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    for words, (effect, number, hidden, size) in HIDDEN.items():
        began_s, right = time.perf_counter(), 0
        for seed in range(draws):
            with TemporaryDirectory() as folder:
                right += one(Path(folder), effect, number, hidden, size, seed)
        took_s = (time.perf_counter() - began_s) / draws
        figures.at_least(f"{words}: {'named, within three standard errors' if effect else 'nothing named'}",
                         right / draws, 0.95 if effect else 1.0, "of draws")
        figures.at_most(f"{words}: a diagnosis takes", took_s, 120.0, "s")
    return 1 if figures.missed else 0


def one(folder: Path, effect: str, number: str, hidden: str, size: float, seed: int) -> bool:
    """Whether the diagnosis of one draw is right."""
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
    names, truth = tuple(found.verdict), getattr(rig, hidden) if hidden else 0.0
    print(f"  {effect or 'nothing'} {seed}: {', '.join(names) or 'nothing'} named", flush=True)
    if not effect or names != (effect,):
        return not effect and not names
    there = found.candidates[0]
    return abs(there.parameters[number] - truth) < 3 * there.standard_errors[number]


if __name__ == "__main__":
    sys.exit(main())
