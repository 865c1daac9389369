"""What the studies of public records of test rigs share: files, runs, the lab's own path, and pictures.

Problem: a figure of a benchmark says something of the program only if its own path was gone. Solution: the record is
written as the run folders and the vehicle's file that a user would write; ``diagnose`` names what is missing,
``add_effect`` adds that, one after the other, and what is left here is the picture and the published figures beside.
Nothing of a set is kept here.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from logger.api.lab.bench import bench_with
from logger.api.lab.compare import AddedEffect, add_effect
from logger.api.lab.diagnose import Diagnosis, diagnose
from logger.api.lab.question import CompareQuestion
from logger.api.road_sets import expected_files, from_folder
from logger.api.vehicles import Model, read_vehicle
from logger.chart_data import Array, Curves, Line, line
from logger.errors import BadInput
from logger.files import make_folder, read_bounded, write_text, written_files
from logger.store.formats.csv_table import columns_of
from logger.store.formats.drive_file import write_table
from logger.store.formats.mat_file import read_arrays
from logger.store.formats.record_file import MAX_BYTES
from logger.studies.study import Column, Picture, Result, Table, Workload
from logger.vehicle.compose import compose

_BLOCKS = 16  # of a spectrum: its levels are known to a quarter


def rig_from_folder(called: str, download: str, read: Callable[[Path, Workload], Result]
                    ) -> Callable[[Workload], Result]:
    """As ``from_folder``, of a rig, which has a vehicle's file of its own."""
    of_folder = from_folder(called, download, read)

    def run(effort: Workload) -> Result:
        if effort.vehicle is not None:
            raise BadInput(f"study: expected no --vehicle, as the rig is known, found {effort.vehicle}")
        return of_folder(effort)

    return run


def columns_in(folder: Path, pattern: str, what: str, names: Mapping[str, Sequence[str]]) -> list[Array]:
    """Columns (n,) of the first file of a pattern anywhere below a folder, by its ending (``mat``, else a table, which
    may be packed) with these names. FileNotFoundError where there is none, BadInput for one that is something else."""
    path = expected_files(folder, pattern, what)[0]
    if path.suffix == ".mat":
        found = read_arrays(path, tuple(names["mat"]))
    else:
        data = read_bounded(path, MAX_BYTES)
        if path.suffix == ".gz":
            try:
                data = gzip.decompress(data)
            except (OSError, EOFError, zlib.error) as error:
                raise BadInput(f"{path}: expected a file packed by gzip, found {error}") from None
        found = columns_of(data, str(path), tuple(names["csv"]))
    if len({len(one) for one in found}) > 1:
        raise BadInput(f"{path}: expected columns of one length, found {', '.join(str(len(one)) for one in found)}")
    if not all(np.isfinite(one).all() for one in found):
        raise BadInput(f"{path}: expected a number in every row, found empty cells")
    return found


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder for files that are no results."""
    with written_files(), TemporaryDirectory() as place:
        yield Path(place)


def write_rig_run(folder: Path, rate_hz: float, drives: Mapping[str, Array], measured: Mapping[str, Array],
                  facts: str = "") -> Path:
    """A run's folder: columns (n,) that drive the rig, those that were measured, and its ``run.yaml``."""
    make_folder(folder)
    for name, columns in (("excitation.csv", drives), ("drive.csv", measured)):
        table = np.column_stack(list(columns.values()))
        write_table(folder / name, ("t_s", *columns), np.column_stack([np.arange(len(table)) / rate_hz, table]),
                    "%.10g")
    if facts:
        write_text(folder / "run.yaml", facts)
    return folder


@dataclass(frozen=True, eq=False)
class Improved:
    """A rig as it was described, refitted, and with what ``diagnose`` named.

    added      effects that were named, one after the other, those that help; empty: none
    refitted   the rig without them, its numbers fitted to the same runs
    """

    diagnosis: Diagnosis
    added: tuple[AddedEffect, ...]
    refitted: Model
    best: Model

    @property
    def effects(self) -> Table:
        """What was named, with the numbers that were found."""
        rows = [(one.effect, name, one.parameters[name], error)
                for one in self.added for name, error in one.standard_errors.items()]
        return Table("What diagnose named and add-effect found", (
            Column("effect"), Column("number"), Column("found", ".5g"), Column("its standard error", ".2g")),
            tuple(rows) or (("nothing", "", None, None),))

    def standard_error(self, name: str) -> float | None:
        """Of a number of the rig, with all effects."""
        return next((one.standard_error for step in self.added[-1:] for one in step.numbers if one.name == name), None)


def improved(vehicle: Path, runs: Sequence[Path]) -> Improved:
    """What the lab makes of a rig: ``diagnose`` once, then ``add-effect`` for each that it names, kept if it helps."""
    diagnosis = diagnose(vehicle, runs)
    model, refitted, added = read_vehicle(vehicle), None, list[AddedEffect]()
    for name in diagnosis.verdict:
        found = add_effect(name, model, runs)
        refitted = refitted or model.with_numbers({one.name: one.without for one in found.numbers})
        if found.helps:
            model = found.model
            added.append(found)
    return Improved(diagnosis, tuple(added), refitted or model, model)


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a rig measured and what models of it say, all (n,), in the band that is compared."""

    rate_hz: float
    measured: Array
    linear: Array
    better: Array

    def rms(self, model: Array, skip: int) -> float:
        """R.m.s. of what a model leaves, without the first samples."""
        return float(np.sqrt(np.mean((self.measured - model)[skip:] ** 2)))


def simulated(found: Improved, run: Path, measured: Array | None = None, thin: bool = False) -> Simulated:
    """Simulations of a run by the refitted rig and by that with its effects, at the recorded times; ``measured`` (n,)
    in place of the run's own, whose mean is left out where its zero is not known; ``thin``: at as few samples a second
    as the lab compares, which leave out the noise above."""
    def output(model: Model) -> tuple[float, Array, Array]:
        bench = bench_with(CompareQuestion(model, run), thin=thin)
        one = bench.runs.runs[0]
        return one.rate_hz, one.measured_mps2, one.main(bench.runs.predict(compose(model.vehicle, model.effects))[0])

    rate_hz, own, linear = output(found.refitted)
    return Simulated(rate_hz, own if measured is None else measured, linear, output(found.best)[2])


def pictures(title: str, found: Simulated, unit: str, seconds: float, skip: int) -> tuple[Picture, ...]:
    """What was measured, what both models say and what they leave: where it moves most, over all the time, and by
    frequency."""
    left: dict[str, Array] = {"as a linear rig": found.measured - found.linear,
                              "with the named effects": found.measured - found.better}
    whole: Array = np.arange(len(found.measured)) / found.rate_hz
    most = min(max(skip, int(np.argmax(np.abs(found.measured[skip:]))) + skip - round(seconds * found.rate_hz / 2)),
               max(skip, len(whole) - round(seconds * found.rate_hz)))
    part = slice(most, most + round(seconds * found.rate_hz))
    closely = Curves(f"{title}: where it moves most", "time [s]", unit, (
        Line("measured", whole[part], found.measured[part], dots=True),
        Line("as a linear rig", whole[part], found.linear[part]),
        Line("with the named effects", whole[part], found.better[part]),
        Line("residual with it", whole[part], left["with the named effects"][part])))
    over = Curves(f"{title}: residual", "time [s]", unit, tuple(
        line(name, whole[skip:], np.asarray(one[skip:])) for name, one in left.items()))
    size = (len(whole) - skip) // _BLOCKS
    taper = np.hanning(size)

    def spectrum(samples: Array) -> Array:
        blocks = samples[skip:skip + _BLOCKS * size].reshape(_BLOCKS, size)
        power = np.mean(np.abs(np.fft.rfft(taper * (blocks - blocks.mean(axis=1, keepdims=True)))) ** 2, axis=0)
        return np.asarray(10 * np.log10(np.maximum(2 * power / (found.rate_hz * (taper**2).sum()), 1e-30)))

    f_hz = np.fft.rfftfreq(size, 1 / found.rate_hz)
    by_hz = Curves(f"{title}: spectra", "frequency [Hz]", f"power spectral density [dB re 1 {unit}2/Hz]", tuple(
        line(name, np.asarray(f_hz[1:], np.float64), spectrum(one)[1:])
        for name, one in {"measured": found.measured, **left}.items()))
    return tuple(map(Picture, (closely, over, by_hz)))
