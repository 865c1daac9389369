"""Silverbox: a measured mass on a hardening spring, as an electrical circuit with that equation.

T. Wigren and J. Schoukens, Three free data sets for development and benchmarking in nonlinear system identification,
European Control Conference 2013. Volts in and volts out stand for newtons and metres. The published split: of samples
40650 to 127400 (ten random multisines) the first three quarters are for fitting and the rest is a test; so is the
arrow, samples 100 to 40575, a filtered noise that grows beyond what the fit has seen from its sample 32000 on.
"""

from pathlib import Path

import numpy as np

from logger.api import data_sets
from logger.errors import BadInput
from logger.files import write_text
from logger.studies.study import Item, Result, Statement, Table, Value, Word, Workload

RATE_HZ = 1e7 / 2**14
FIT, TEST, ARROW = slice(40650, 40650 + 65062), slice(40650 + 65062, 127400), slice(100, 40575)
WITHIN = slice(ARROW.start, ARROW.start + 32000)
FITTED = 20_000
"""So many samples are fitted to: a third of what the split allows."""
_SKIP = 50  # samples of a test that the published errors leave out
_SHOWN_S = 0.1
VEHICLE = """name: silverbox
model: single_mass
mass_kg: 5.4e-6 +- 20%
stiffness_n_per_m: 1.0 +- 20%
damping_n_s_per_m: 2.2e-4 +- 50%
"""
PUBLISHED_MV = (("GRU", 1.49, 2.80, 0.95), ("LSTM", 1.50, 2.68, 0.96), ("RNN", 1.64, 4.88, 1.73),
                ("FIR-MLP", 18.9, 20.2, 15.3))
"""R.m.s. error on the multisine, the arrow, and the arrow without extrapolation [mV]."""
TESTS = (("Silverbox multisine", TEST), ("Silverbox arrow", ARROW), ("Silverbox arrow without extrapolation", WITHIN))
EFFECT = "progressive_spring"


@data_sets.study_of(
    "the Silverbox", "download SilverboxFiles.zip from nonlinearbenchmark.org and unpack it; SNLS80mV is read",
    "A mass on a hardening spring: what its model lacks, and how well it then predicts",
    "Errors of the benchmark's tests",
    "The record is written as a user would write it: run folders with the force and the displacement. The file of a "
    f"single mass knows mass and spring to 20 % and the damper to 50 %. The lab sees the first {FITTED} samples of the "
    f"part for fitting, and nothing of the tests. The first {_SKIP} samples of each test are left out, as published.",
    Item("Silverbox equation", Word.AGREES, "diagnose names the cubic spring of the circuit."),
    *(Item(name, Word.BETTER, "The simulated output is closer to the record than that of the best published network.")
      for name, _ in TESTS),
    source="T. Wigren, J. Schoukens, ECC 2013; networks: M. D. Champneys et al., arXiv 2405.10779", is_rig=True)
def silverbox(folder: Path, effort: Workload) -> Result:
    volts = np.column_stack(data_sets.columns_in(folder, "SNLS80mV.*", "the record SNLS80mV.csv or SNLS80mV.mat",
                                                {"csv": ("V1", "V2"), "mat": ("V1", "V2")}))
    if len(volts) < TEST.stop:
        raise BadInput(f"{folder}: expected {TEST.stop} samples or more, found {len(volts)}")
    steps = effort.each(["diagnosed", "simulated", "simulated", "simulated"])
    with data_sets.scratch() as place:
        car = place / "box.yaml"
        write_text(car, VEHICLE)

        def written(name: str, samples: slice) -> Path:
            return data_sets.write_rig_run(place / name, RATE_HZ, {"force_n": volts[samples, 0]},
                                          {"displacement_m": volts[samples, 1]}, "forces: {force_n: {on: body}}\n")

        next(steps)
        fitted = slice(FIT.start, FIT.start + effort.count(FITTED, 6000))
        found = data_sets.improved(car, [written("fit", fitted)])
        zero = float(volts[fitted, 1].mean())  # of the output: as the fit has it, not as a test has it
        made = [data_sets.simulated(found, written(name, samples), volts[samples, 1] - zero)
                for (name, samples), _ in zip(TESTS, steps, strict=False)]
        next(steps, None)
    linear, better = ([1e3 * one.rms(getattr(one, which), _SKIP) for one in made] for which in ("linear", "better"))
    best = np.array([row[1:] for row in PUBLISHED_MV], float).min(axis=0)
    values = tuple(Value(f"{name}, r.m.s. error [mV]", float(printed), ours, 0.0, Word.BETTER, of=(name,))
                   for (name, _), printed, ours in zip(TESTS, best, better, strict=True))
    named = Statement("progressive_spring is named first (1: yes)", "a hardening spring",
                      float(found.diagnosis.verdict[:1] == (EFFECT,)), 1, 1, of=("Silverbox equation",))
    rows = (*PUBLISHED_MV, ("ridelog, as a linear rig", linear[0], linear[1], linear[2]),
            ("ridelog, with the named effects", better[0], better[1], better[2]))
    table = Table("R.m.s. error of the simulated output [mV]", (
        "model", *(f"{name.removeprefix('Silverbox ')} .3g" for name, _ in TESTS)), rows)
    return Result((table, found.effects), _verdict(found, linear, better), tuple(
        picture
        for place in (0, 1) for picture in data_sets.pictures(TESTS[place][0], made[place], "V", _SHOWN_S, _SKIP)),
        (named, *values))


def _verdict(found: data_sets.Improved, linear: list[float], better: list[float]) -> str:
    names = " and ".join(found.diagnosis.verdict) or "nothing"
    return (f"diagnose names {names}. On the multisine, which no fit used, the simulated output is off by "
            f"{better[0]:.2f} mV, {linear[0]:.2f} mV as a linear rig; on the arrow by {better[1]:.2f} mV instead of "
            f"{linear[1]:.2f} mV. Beyond a linear model it has {len(found.effects.rows)} fitted parameters, and it "
            "holds outside the amplitudes of the fit, where a black box has to extrapolate.")

STUDIES = (silverbox,)
