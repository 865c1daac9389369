"""The Silverbox, a measured mass on a hardening spring, by whole commands: the named effect and errors on its tests.

    python -m tests.benchmarks.silverbox SNLS80mV.csv[.gz]

The file is that of T. Wigren and J. Schoukens, Three free data sets for development and benchmarking in nonlinear
system identification, European Control Conference 2013 (nonlinearbenchmark.org): volts in, volts out, at 1e7 / 2^14
Hz. They stand for newtons and metres. Split as published: of samples 40650 to 127400 the first three quarters are for
fitting, of which the first 20,000 are used, and the rest is a test, as is the arrow, samples 100 to 40575. The
vehicle's file says mass and spring to 20 % and the damper to 50 %. ``diagnose`` and ``add-effect`` see the first part
alone; errors are those of the simulated output by ``compare``, without the first 2 s.

Published (M. D. Champneys et al., arXiv 2405.10779) on multisine, arrow, and arrow without extrapolation [mV]: GRU
1.49, 2.80, 0.95; LSTM 1.50, 2.68, 0.96; FIR-MLP 18.9, 20.2, 15.3.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

from ..support.command import called
from .figures import Figures

RATE_HZ = 1e7 / 2**14
FIT, TEST, ARROW = slice(40650, 60650), slice(40650 + 65062, 127400), slice(100, 40575)
VEHICLE = ("name: silverbox\nmodel: single_mass\nmass_kg: 5.4e-6 +- 20%\nstiffness_n_per_m: 1.0 +- 20%\n"
           "damping_n_s_per_m: 2.2e-4 +- 50%\n")


def written(folder: Path, samples: npt.NDArray[np.float64]) -> Path:
    """A run (n, 2): force and displacement."""
    folder.mkdir()
    time_s = np.arange(len(samples)) / RATE_HZ
    for name, column, words in (("excitation.csv", 0, "force_n"), ("drive.csv", 1, "displacement_m")):
        np.savetxt(folder / name, np.column_stack([time_s, samples[:, column]]), "%.10g", ",", header=f"t_s,{words}",
                   comments="")
    (folder / "run.yaml").write_text("forces: {force_n: {on: body}}\n", "utf-8")
    return folder


def answer(*words: object) -> dict[str, Any]:
    """What a command says."""
    found = called(*words, "--json")
    if found.returncode:
        raise SystemExit(found.stderr)
    return dict(json.loads(found.stdout))


def main() -> int:
    """Print all figures."""
    samples = np.genfromtxt(sys.argv[1], delimiter=",", skip_header=1, usecols=(0, 1))
    figures = Figures()
    with TemporaryDirectory() as name:
        place = Path(name)
        car = place / "box.yaml"
        car.write_text(VEHICLE, "utf-8")
        fit = written(place / "fit", samples[FIT])
        verdict = answer("diagnose", "--vehicle", car, fit)["verdict"]
        print(f"named: {', '.join(verdict)}", flush=True)
        figures.at_least("progressive_spring is named first", float(verdict[:1] == ["progressive_spring"]), 1.0, "")
        better = place / "better.yaml"
        found = called("add-effect", "progressive_spring", "--vehicle", car, "--out", better, fit)
        if found.returncode:
            raise SystemExit(found.stderr)
        for words, part, goal in (("multisine", TEST, 1.0), ("arrow", ARROW, 1.0),
                                  ("arrow without extrapolation", slice(ARROW.start, ARROW.start + 32000), 0.8)):
            run = written(place / words.replace(" ", "-"), samples[part])
            before, after = (answer("compare", "--vehicle", one, run) for one in (car, better))
            measured = float(np.std(samples[part][int(2 * RATE_HZ):, 1]))
            print(f"{words}: {1e3 * measured * before['error']:.3g} mV as a linear car")
            figures.at_most(f"{words}, r.m.s. of the simulated output", 1e3 * measured * after["error"], goal, "mV")
    return figures.missed


if __name__ == "__main__":
    sys.exit(bool(main()))
