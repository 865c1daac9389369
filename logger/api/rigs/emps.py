"""EMPS: a measured linear axis with Coulomb friction, driven by a motor through a screw.

A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019 Workshop on Nonlinear System Identification
Benchmarks. Their model: M q'' + Fv q' + Fc sign(q') + offset = force, by inverse dynamics and least squares.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from logger.api import data_sets
from logger.api.lab.compare import AddedEffect
from logger.chart_data import Array
from logger.errors import BadInput
from logger.files import write_text
from logger.studies.study import Item, Result, Statement, Table, Value, Word, Workload

RATE_HZ = 1000.0
DRIVE_N_PER_V = 35.15065
"""Force of the motor for each volt of its drive: the data's gtau."""
VEHICLE = """name: emps
model: component
mass_kg: 100 +- 20%
stiffness_n_per_m: 0
damping_n_s_per_m: 250 +- 50%
preload_n: unknown
"""
PUBLISHED = (("mass [kg]", 95.1089), ("viscous friction [N s/m]", 203.5034), ("Coulomb friction [N]", 20.3935))
_NEAR, _SHOWN_S, _SKIP_S, _FEWEST_S = 0.01, 2.0, 2.0, 8.0
EFFECT, FRICTION = "dry_friction", "friction_force_n"


@data_sets.study_of(
    "the EMPS record", "download the EMPS files from nonlinearbenchmark.org and unpack them; DATA_EMPS is read",
    "A linear axis with friction: what its model lacks", "Parameters of the axis",
    "The training record is written as a user would write it: a component that its bench moves (the encoder's "
    "position) while its force is measured. The file knows the mass to 20 % and viscous friction to 50 %. Published "
    "parameters are compared with those found with friction alone, as in the published model.",
    Item("EMPS friction", Word.AGREES, "diagnose names Coulomb friction, which halves the error of the force."),
    Item("EMPS parameters", Word.AGREES, "Mass, viscous and Coulomb friction within 1 %."),
    source="A. Janot, M. Gautier, M. Brunot, Nonlinear System Identification Benchmarks, 2019", is_rig=True)
def emps(folder: Path, effort: Workload) -> Result:
    force_n, place_m = _record(folder)
    count = effort.count(len(force_n), round(_FEWEST_S * RATE_HZ))
    steps = effort.each(["diagnosed", "simulated"])
    with data_sets.scratch() as place:
        axis = place / "axis.yaml"
        write_text(axis, VEHICLE)
        next(steps)
        bench = data_sets.write_rig_run(place / "axis", RATE_HZ, {"displacement_m": place_m[:count]},
                                       {"force_n": force_n[:count]})
        found = data_sets.improved(axis, [bench])
        next(steps)
        made = data_sets.simulated(found, bench, thin=True)
    list(steps)
    skip = round(_SKIP_S * made.rate_hz)
    size = float(np.sqrt(np.mean(made.measured[skip:] ** 2)))
    linear, better = (made.rms(one, skip) / size for one in (made.linear, made.better))
    first = found.added[0] if found.added else None
    numbers = (first.model if first else found.best).numbers
    ours = (numbers["mass_kg"], numbers["damping_n_s_per_m"], first.parameters.get(FRICTION, 0.0) if first else 0.0)
    return Result((_beside(first, ours), found.effects), _verdict(found, linear, better),
                  data_sets.pictures("Force of the axis", made, "N", _SHOWN_S, skip), (
        Statement("dry_friction is named first (1: yes)", "Coulomb friction",
                  float(found.diagnosis.verdict[:1] == (EFFECT,)), 1, 1, of=("EMPS friction",)),
        Statement("NRMSE of the force", "Coulomb friction", better, 0.0, linear / 2,
                  of=("EMPS friction",)),
        *(Value(name, printed, value, _NEAR * printed, of=("EMPS parameters",))
          for (name, printed), value in zip(PUBLISHED, ours, strict=True))))


def _record(folder: Path) -> tuple[Array, Array]:
    """Force [N] and place [m], both (n,)."""
    drive, place_m = data_sets.columns_in(folder, "DATA_EMPS*", "the training record DATA_EMPS.mat", {
        "csv": ("vir_V", "qm_m"), "mat": ("vir", "qm")})
    if len(drive) < _FEWEST_S * RATE_HZ:
        raise BadInput(f"{folder}: expected {_FEWEST_S * RATE_HZ:g} samples or more, found {len(drive)}")
    return DRIVE_N_PER_V * drive, place_m


def _verdict(found: data_sets.Improved, linear: float, better: float) -> str:
    names = " and ".join(found.diagnosis.verdict) or "nothing"
    return (f"diagnose names {names}. The error of the force that moves the axis is {better:.3f} of its r.m.s., "
            f"{linear:.3f} with mass and viscous friction alone.")


def _beside(first: AddedEffect | None, ours: Sequence[float]) -> Table:
    """Published numbers and those with friction alone, as the published model has it."""
    errors = {one.name: one.standard_error for one in first.numbers} | dict(first.standard_errors) if first else {}
    rows = tuple((name, printed, value, error, 100 * (value / printed - 1))
                 for (name, printed), value, error in zip(PUBLISHED, ours, map(errors.get, (
                     "mass_kg", "damping_n_s_per_m", FRICTION)), strict=True))
    return Table("Parameters of the axis", ("parameter", "published .5g", "ridelog .5g", "its standard error .2g",
                                            "difference [%] +.1f"), rows)

STUDIES = (emps,)
