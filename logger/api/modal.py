"""The modes of the structure, or the vehicle, that a record was made on, with their words and JSON.

Vibration records of many sensors; a car's modes out of a drive, from its file, its speed and the vehicle.
"""

from __future__ import annotations

from cmath import phase
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.drive_questions import ModesQuestion
from logger.api.inputs import Model, model_of, read_run
from logger.api.shown import CommandResult, Shown, table
from logger.arrays import Bools, Complex
from logger.chart_data import Array, Chart, Curves, Line, line
from logger.errors import BadInput, as_bad_input
from logger.estimation.car_response import WAVE_NUMBERS_CPM
from logger.estimation.road_spectrum import RoadSpectrum
from logger.modal.analysis import decays, find_modes
from logger.modal.decay import decrement_mode
from logger.modal.driven_car import car_modes
from logger.modal.mode import FoundMode, ModalResult, pole_rows
from logger.printable import counted
from logger.question import IRI, SPEED, function
from logger.report.blocks import SHOWN_ROWS, Block, Blocks, Lines, Section, Table
from logger.report.quantities import known, measured
from logger.runs import READING, SKIP_S
from logger.store.formats import record_checks
from logger.store.formats.drive_file import header_of
from logger.store.formats.record_checks import SPEED as SPEED_COLUMN
from logger.store.formats.record_checks import ChannelRecord
from logger.store.formats.record_file import VERTICAL
from logger.store.formats.vehicle_file import check_moves_itself
from logger.units import COMMON_IRI, COMMON_SPEED_MPS
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.modes import mode_errors
from logger.vehicle.uncertain import cars_off

_ONLY_DECAYS = ("era", "decrement")


@dataclass(frozen=True, eq=False, repr=False)
class Modes(CommandResult):
    """Natural frequencies, damping ratios and shapes of m modes, slowest first, at c channels.

    channels              names of those; of a vehicle alone there are none
    frequency_hz          (m,) natural frequencies without regard to damping, ``frequency_std_hz`` (m,) their standard
                          deviations [Hz]
    damping_ratio         (m,) shares of critical damping, ``damping_std`` (m,) likewise; NaN where it cannot be
                          measured
    shapes                (m, c) motion of the channels, the largest 1; complex where they are not in step
    rejected              frequencies that were found and not believed [Hz], each with the reason
    how                   the way that it was done, in words; ``order`` of the model, 0 where there is none
    poles                 (k, 3) of every order that was tried: order, frequency [Hz], damping ratio
    """

    channels: tuple[str, ...]
    frequency_hz: Array
    frequency_std_hz: Array
    damping_ratio: Array
    damping_std: Array
    shapes: Complex
    rejected: tuple[tuple[float, str], ...]
    how: str
    order: int
    poles: Array

    title: ClassVar[str] = "Modes"

    def charts(self) -> Sequence[Chart]:
        """The stabilisation diagram: the poles of every order that was tried; nothing where there are none."""
        if not len(self.poles):
            return ()
        return [Curves("Stabilisation diagram", "frequency [Hz]", "order", (
            Line("poles", self.poles[:, 1], self.poles[:, 0], dots=True),))]


@function(ModesQuestion)
def modes(question: ModesQuestion) -> Modes:
    if question.record is None:
        assert question.vehicle is not None
        return vehicle_modes(model_of(question.vehicle), speed_mps=question.speed_mps or COMMON_SPEED_MPS)
    return _modes_by(found_modes(question.record, question), Path(question.named()).name or "record")


def _modes_by(found: Found, name: str) -> Modes:
    """What was found of a record of this name, to be shown."""
    result, kept, many = found.result, found.record, found.result.modes
    frequency_hz, frequency_std_hz, damping_ratio, damping_std = (
        np.array([getattr(one, column) for one in many], dtype=np.float64)
        for column in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"))
    return Modes(
        Blocks(blocks(result, kept, name)), as_json(result, kept, found.method), kept.names, frequency_hz,
        frequency_std_hz, damping_ratio, damping_std,
        np.array([one.shape for one in many], dtype=np.complex128).reshape(len(many), len(kept.names)),
        tuple((one.frequency_hz, one.reason) for one in result.rejected), result.how, result.order, pole_rows(result))


def vehicle_modes(
    vehicle: Model | Path | str, iri_m_per_km: float = COMMON_IRI, speed_mps: float = COMMON_SPEED_MPS
) -> Modes:
    """Natural frequencies and damping ratios of a vehicle with its effects, which laws that are not linear have on a
    road of this roughness at this speed.

    vehicle    a model, or a name or file as in ``read_vehicle``

    Raises BadInput for numbers out of range, and as ``read_vehicle``.

    >>> vehicle_modes("rav4-2009").frequency_hz.round(2).tolist()
    [1.12, 1.48, 10.74, 10.84]
    """
    IRI.check("iri_m_per_km", iri_m_per_km)
    SPEED.check("speed_mps", speed_mps)
    model = model_of(vehicle)
    check_moves_itself(model.vehicle)
    psd = RoadSpectrum.of_iri(iri_m_per_km).psd(WAVE_NUMBERS_CPM)
    with as_bad_input(model.vehicle.name):
        known = known_vehicle(model.vehicle, model.effects)
        cars = [one.at(speed_mps, WAVE_NUMBERS_CPM, psd)
                for one in (known, *cars_off(model.vehicle, model.effects, model.errors))]
    found, frequency_std_hz, damping_std = mode_errors(cars[0], cars[1:])
    columns = (np.array([one.frequency_hz for one in found]), frequency_std_hz,
               np.array([one.damping_ratio for one in found]), damping_std)
    at = f", at {speed_mps:g} m/s on a road of {iri_m_per_km:g} m/km" if known.depends_on_motion else ""
    rows = list(zip(*(one.tolist() for one in columns), strict=True))
    content = Blocks([Lines([f"{model.vehicle.name}{at}"]), Table(_HEADS, list(_mode_rows(rows)))])
    return Modes(content, {"modes": [_mode_json(*row) for row in rows]}, (), *columns,
                 np.empty((len(rows), 0), complex), (), "eigenvalues of the vehicle", 0, np.empty((0, 3)))


def found_modes(given: record_checks.ChannelRecord | Path | str, question: ModesQuestion) -> Found:
    """The modes of a record or of a file. BadInput as ``modes``."""
    if question.vehicle is not None:
        return modes_of_drive(given, question)
    if question.speed_mps is not None:
        raise question.wrong("speed_mps", ": expected `vehicle` with it")
    if question.input_column is not None and question.method not in (None, "n4sid"):
        raise question.wrong("input_column", f": expected `method` n4sid with it, found {question.method}")
    _check_stands(given, question)
    record, inputs = _asked(given, question)
    try:
        return Found(*_find(question, record, inputs), record)
    except ValueError as error:
        raise question.complaint(f"{name_of(given)}: {error}") from None


def _check_stands(given: record_checks.ChannelRecord | Path | str, question: ModesQuestion) -> None:
    """BadInput for a drive, unless what moved it was measured, or it is said to be a free decay."""
    drives = (bool({*given.names} & {*record_checks.NOT_SENSORS}) if isinstance(given, record_checks.ChannelRecord) else
              record_checks.is_drive(given))
    if drives and question.input_column is None and question.method not in _ONLY_DECAYS:
        raise question.complaint(
            f"{name_of(given)}: expected `vehicle` with a drive: the road, and the second axle that "
            "follows the first, add peaks to its spectrum that are not modes. A stretch of free decay can be "
            "analysed with `method` era")


def _asked(given: record_checks.ChannelRecord | Path | str, question: ModesQuestion) -> tuple[Channels, Array | None]:
    """The sensors' record, cut to the wished stretch, and the input's samples (n, 1) or None."""
    pushed, name = question.input_column, name_of(given)
    at = name if isinstance(given, record_checks.ChannelRecord) else f"{name}:1"
    wished = () if question.columns is None else tuple(question.columns)
    if question.columns is not None and (
            not wished or not all(wished) or len(set(wished)) < len(wished) or pushed in wished):
        raise question.wrong("columns", f" {','.join(wished)}: expected names with commas between them, each once, the "
                                        "input not among them")
    wanted = (*wished, pushed) if wished and pushed else wished
    record = _picked(given, wanted) if isinstance(given, record_checks.ChannelRecord) else read_channels(given, wanted)
    if pushed is not None and pushed not in record.names:
        raise BadInput(f"{at}: expected a column {pushed}, found {','.join(record.names)[:80]}")
    t_s = record.start_s + np.arange(len(record.samples)) / record.rate_hz
    inside = (t_s >= (t_s[0] if question.from_s is None else question.from_s)) & (
        t_s <= (t_s[-1] if question.to_s is None else question.to_s))
    if not inside.any():
        raise question.complaint(f"{name}: expected `from_s` before `to_s`, within {t_s[0]:g} to {t_s[-1]:g} s")
    samples = record.samples[inside]
    outputs = [place for place, one in enumerate(record.names) if one != pushed]
    if not outputs:
        raise BadInput(f"{at}: expected a column other than the input {pushed}")
    if not (samples.std(axis=0) > 0).all():
        raise question.complaint(f"{name}: expected every column to vary between `from_s` and `to_s`")
    inputs = None if pushed is None else samples[:, [record.names.index(pushed)]]
    names = tuple(record.names[place] for place in outputs)
    return replace(record, names=names, start_s=float(t_s[inside][0]), samples=samples[:, outputs]), inputs


def _picked(given: record_checks.ChannelRecord, wanted: Sequence[str]) -> Channels:
    """These channels of a record, or all. BadInput for one that there is not."""
    if unknown := set(wanted) - set(given.names):
        raise BadInput(f"record: expected a channel {sorted(unknown)[0]}, found {','.join(given.names)[:80]}")
    places = [given.names.index(one) for one in wanted] or list(range(len(given.names)))
    return Channels(tuple(given.names[place] for place in places), given.start_s, given.rate_hz,
                    given.samples[:, places])


def _find(question: ModesQuestion, record: Channels, inputs: Array | None) -> tuple[ModalResult, str]:
    """What was found, and by which method. ValueError for a record that is too short or of another kind, or an input
    that shows nothing."""
    method = question.method
    decay = inputs is None and decays(record.samples)
    if method in _ONLY_DECAYS and not decay:
        raise ValueError(f"expected a free decay for `method` {method}, found a motion that goes on: `method` ssi "
                         "finds its modes; `from_s` and `to_s` cut out a decay")
    if method == "decrement":
        if len(record.names) > 1:
            raise ValueError(f"expected one column for the decrement (`columns`), found {','.join(record.names)}")
        return decrement_mode(record.samples[:, 0], record.rate_hz), method
    found = find_modes(record.samples, record.rate_hz, inputs, decay)
    return found, "era" if decay else "ssi" if inputs is None else "n4sid"


METHOD = "vehicle"


def modes_of_drive(given: ChannelRecord | Path | str, question: ModesQuestion) -> Found:
    """The modes of the vehicle near the one of the question that was driven. BadInput as ``logger.api.modal.modes``."""
    assert question.vehicle is not None
    model = model_of(question.vehicle)
    if model.effects:
        raise BadInput(f"{model.vehicle.name}: expected a car without effects where the road was not measured, found "
                       f"{', '.join(one.effect.name for one in model.effects)}")
    if question.input_column is not None:
        raise question.wrong("input_column", ": expected a record without `vehicle`")
    if question.method is not None:
        raise question.wrong("method", f" {question.method}: expected none with `vehicle`, whose "
                                       "parameters are fitted to the spectrum")
    name, start_s, rate_hz, samples, speed_mps, usable = _record(given, question)
    time_s = start_s + np.arange(len(samples)) / rate_hz
    first_s = time_s[0] + SKIP_S if question.from_s is None else question.from_s
    inside = (time_s >= first_s) & (time_s <= (time_s[-1] if question.to_s is None else question.to_s))
    if not inside.any():
        raise question.complaint(f"{name}: expected `from_s` before `to_s`, within {time_s[0]:g} to {time_s[-1]:g} s")
    if not np.ptp(samples[inside]) > 0:
        raise BadInput(f"{name}: expected an acceleration that varies, found {samples[inside][0]:g} m/s2 throughout")
    with as_bad_input(name):
        found = car_modes(model.vehicle, samples[inside], speed_mps[inside], usable[inside], rate_hz)
    return Found(found, METHOD, Channels((VERTICAL,), float(time_s[inside][0]), rate_hz, samples[inside][:, None]))


def _record(given: ChannelRecord | Path | str, question: ModesQuestion
            ) -> tuple[str, float, float, Array, Array, Bools]:
    """Name, start [s], rate [Hz], readings, speeds [m/s] and whether each is a reading."""
    path = given if isinstance(given, Path | str) else None
    if path is not None and (Path(path).is_dir() or SPEED_COLUMN in header_of(Path(path))):
        drive = read_run(path)
        if question.speed_mps is not None:
            raise question.wrong("speed_mps", f": expected a record without speeds, {drive.path} has them")
        if question.columns is not None and tuple(question.columns) != (VERTICAL,):
            raise question.wrong("columns", f" {','.join(question.columns)}: expected {VERTICAL} of a drive")
        if drive.speed_mps.max() == 0:
            raise BadInput(f"{drive.path}: expected a drive, found a car that stands")
        usable = np.ones(len(drive.time_s), bool) if drive.usable is None else drive.usable == READING
        return (str(drive.path), float(drive.time_s[0]), drive.rate_hz, drive.accel_z_mps2, drive.speed_mps, usable)
    name = name_of(given)
    if question.speed_mps is None:
        raise question.complaint(f"{name}: expected a column {SPEED_COLUMN}, or `speed_mps` M/S")
    record = read_channels(path, question.columns or (VERTICAL,)) if path is not None else given
    assert isinstance(record, ChannelRecord)
    if len(record.names) != 1:
        raise question.complaint(f"{name}: expected one sensor (`columns`)")
    count = len(record.samples)
    return (name, record.start_s, record.rate_hz, record.samples[:, 0], np.full(count, question.speed_mps),
            np.ones(count, bool))


@dataclass(frozen=True, eq=False, repr=False)
class Channels(record_checks.ChannelRecord, Shown):
    """A record of c sensors, evenly sampled.

    names      of the channels
    start_s    time of the first sample [s]; ``rate_hz`` samples a second
    samples    (n, c), in any unit
    """

    def __repr__(self) -> str:
        deviations = self.samples.std(axis=0).tolist()
        return table("Channels", [
            ("time", len(self.samples) / self.rate_hz, "s"), ("rate", self.rate_hz, "Hz"),
            ("samples", len(self.samples), ""),
            *((f"{name}, standard deviation", one, "") for name, one in zip(self.names, deviations, strict=True))])

    def charts(self) -> Sequence[Chart]:
        """The channels over time."""
        time_s = self.start_s + np.arange(len(self.samples)) / self.rate_hz
        return [Curves("Channels", "time [s]", "reading", tuple(
            line(name, time_s, one) for name, one in zip(self.names, self.samples.T, strict=True)))]


def read_channels(path: Path | str, columns: Sequence[str] = ()) -> Channels:
    """Read a CSV record with ``t_s`` and one column per sensor: these columns, or all.

    Raises BadInput (``file:line: expected ..., found ...``) for anything else, and for a column that never moves.

    >>> read_channels(folder / "drive.csv", ["accel_z_mps2"]).samples.shape
    (1115, 1)
    """
    return Channels(**vars(record_checks.read_channels(path, columns)))


def make_channels(samples: Mapping[str, npt.ArrayLike], *, rate_hz: float, start_s: float = 0.0) -> Channels:
    """A record from arrays (n,), by the names of their channels.

    rate_hz    samples a second; the first was taken at ``start_s`` [s]

    Raises BadInput for arrays of different lengths, values that are not finite, or fewer than two samples.

    >>> make_channels({"top": [0.0, 1.0, 0.0], "middle": [0.0, 0.5, 0.0]}, rate_hz=100.0).samples.shape
    (3, 2)
    """
    arrays = [np.asarray(one, dtype=np.float64) for one in samples.values()]
    if not arrays or arrays[0].ndim != 1 or any(one.shape != arrays[0].shape for one in arrays):
        raise BadInput("channels: expected arrays of one length and one axis")
    if not (len(arrays[0]) > 1 and rate_hz > 0 and np.isfinite(start_s) and np.isfinite(arrays).all()):
        raise BadInput("channels: expected two finite values or more in each, and a rate above 0 Hz")
    return Channels(tuple(samples), start_s, rate_hz, np.stack(arrays, axis=1))


@dataclass(frozen=True, eq=False)
class Found:
    """What was found, by which method; ``record``: of the sensors alone, the stretch that was looked at."""

    result: ModalResult
    method: str
    record: Channels


def name_of(given: record_checks.ChannelRecord | Path | str) -> str:
    """How a complaint names a record."""
    return "record" if isinstance(given, record_checks.ChannelRecord) else str(given)


_IN_STEP = 0.02  # a shape whose parts are nearer to in step than this is shown with signs alone


def as_json(result: ModalResult, record: ChannelRecord, method: str) -> dict[str, Any]:
    """The agreed fields of each mode first, then its shape; null where the method cannot tell."""
    return {
        "modes": [mode_json(mode, record.names) for mode in result.modes],
        "rejected": [{"frequency_hz": one.frequency_hz, "damping_ratio": known(one.damping_ratio),
                      "reason": one.reason} for one in result.rejected],
        "method": method, "how": result.how, "order": result.order, "rate_hz": record.rate_hz,
        "samples": len(record.samples),
    }


def mode_json(mode: FoundMode, names: tuple[str, ...]) -> dict[str, Any]:
    """One mode; ``names`` of the channels."""
    return {**_mode_json(mode.frequency_hz, mode.frequency_std_hz, mode.damping_ratio, mode.damping_std),
            "shape": [{"channel": name, "amplitude": float(abs(part)), "phase_deg": degrees(phase(part))}
                      for name, part in zip(names, mode.shape.tolist(), strict=True)]}


def _mode_json(hz: float, hz_std: float, ratio: float, ratio_std: float) -> dict[str, Any]:
    return {"frequency_hz": hz, "damping_ratio": known(ratio), "frequency_std_hz": known(hz_std),
            "damping_std": known(ratio_std)}


_HEADS = ("mode", "frequency Hz", "damping %")


def _mode_rows(modes: Iterable[tuple[float, float, float, float]]) -> Iterator[tuple[str, str, str]]:
    for number, (hz, hz_std, ratio, ratio_std) in enumerate(modes, start=1):
        yield str(number), measured(hz, hz_std), measured(100 * ratio, 100 * ratio_std)


def blocks(result: ModalResult, record: ChannelRecord, name: str) -> Iterator[Block]:
    """What a person reads; ``name`` is that of the file."""
    seconds = len(record.samples) / record.rate_hz
    order = f", order {result.order}" if result.order else ""
    yield Lines([f"{name}: {seconds:.4g} s at {record.rate_hz:.6g} Hz, {counted(len(record.names), 'channel')}",
                 f"{result.how}{order}"])
    if result.modes:
        said = _mode_rows((one.frequency_hz, one.frequency_std_hz, one.damping_ratio, one.damping_std)
                          for one in result.modes)
        yield Table((*_HEADS, "shape"), [(*row, _shape_words(one)) for row, one in
                                         zip(said, result.modes, strict=True)], (3,))
        yield Lines([f"± is one standard deviation. Shape: {', '.join(record.names)[:200]}; the largest is 1."])
    else:
        yield "No mode: nothing in this record exceeds noise."
    yield Section("Rejected", [Table(("Hz", ""), [
        (f"{one.frequency_hz:.4g}", one.reason) for one in result.rejected], (1,), SHOWN_ROWS)])


def _shape_words(mode: FoundMode) -> str:
    if max(abs(part.imag) for part in mode.shape.tolist()) < _IN_STEP * len(mode.shape):
        return " ".join(f"{part.real:6.3f}" for part in mode.shape.tolist())
    return " ".join(f"{abs(part):.3f}@{degrees(phase(part)):.0f}°" for part in mode.shape.tolist())
