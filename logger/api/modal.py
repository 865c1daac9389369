"""The modes of the structure, or the vehicle, that a record was made on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.drive_questions import ModesCommand, ModesQuestion
from logger.api.question import function
from logger.api.ranges import COMMON_IRI, COMMON_SPEED_MPS, IRI, SPEED
from logger.api.shown import CommandResult
from logger.api.vehicles import Model, model_of
from logger.api.vibration_records import Channels, Found, name_of, read_channels
from logger.errors import BadInput
from logger.files import write_text
from logger.store.formats import channel_file

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.modal.mode import ModalResult

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_ONLY_DECAYS = ("era", "decrement")


@dataclass(frozen=True, eq=False, repr=False)
class Modes(CommandResult):
    """Natural frequencies, damping ratios and shapes of m modes, slowest first, at c channels.

    channels              names of those
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

    def write(self, path: Path, option: str = "--diagram") -> None:
        """Write the poles of all orders as CSV."""
        rows = [f"{order:.0f},{frequency_hz:.7g},{damping_ratio:.5g}\n"
                for order, frequency_hz, damping_ratio in self.poles.tolist()]
        write_text(path, "order,frequency_hz,damping_ratio\n" + "".join(rows), "ascii")

    def charts(self) -> Sequence[Chart]:
        """The stabilisation diagram: the poles of every order that was tried; nothing where there are none."""
        from logger.chart_data import Curves, Line

        if not len(self.poles):
            return ()
        return [Curves("Stabilisation diagram", "frequency [Hz]", "order", (
            Line("poles", self.poles[:, 1], self.poles[:, 0], dots=True),))]


def modes_of(question: ModesQuestion) -> Modes:
    """The answer to ``ModesQuestion``, which says what is raised."""
    return _modes_by(found_modes(question.record, question), Path(question.named()).name or "record")


modes = function("modes", ModesQuestion, modes_of)


def asked_modes(question: ModesCommand) -> CommandResult:
    """What the terminal asked: modes of a record, of a vehicle alone, or of the example."""
    from logger.report.five_storey_text import example_lines, five_storey

    if question.example is not None:
        example = five_storey()
        return CommandResult("\n".join(example_lines(example)), example)
    if question.vehicle is not None and question.record is None:
        return vehicle_modes(model_of(question.vehicle), question.iri_m_per_km or COMMON_IRI,
                             question.speed_mps or COMMON_SPEED_MPS)
    return modes_of(question)


def _modes_by(found: Found, name: str) -> Modes:
    """What was found of a record of this name, to be shown."""
    from logger.modal.mode import pole_rows
    from logger.report.modal_text import as_json, lines

    result, kept, many = found.result, found.record, found.result.modes
    frequency_hz, frequency_std_hz, damping_ratio, damping_std = (
        np.array([getattr(one, column) for one in many], dtype=np.float64)
        for column in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"))
    return Modes(
        "\n".join(lines(result, kept, name)), as_json(result, kept, found.method), kept.names, frequency_hz,
        frequency_std_hz, damping_ratio, damping_std,
        np.array([one.shape for one in many], dtype=np.complex128).reshape(len(many), len(kept.names)),
        tuple((one.frequency_hz, one.reason) for one in result.rejected), result.how, result.order, pole_rows(result))


@dataclass(frozen=True, eq=False, repr=False)
class VehicleModes(CommandResult):
    """Vibrations of a vehicle with its effects, m of them, slowest first.

    frequency_hz, damping_ratio           (m,) as in ``Modes``
    frequency_std_hz, damping_std         (m,) by the standard errors of the vehicle's numbers; NaN where they are not
                                          known
    """

    frequency_hz: Array
    frequency_std_hz: Array
    damping_ratio: Array
    damping_std: Array


def vehicle_modes(
    vehicle: Model | Path | str, iri_m_per_km: float = COMMON_IRI, speed_mps: float = COMMON_SPEED_MPS
) -> VehicleModes:
    """Natural frequencies and damping ratios of a vehicle with its effects, which laws that are not linear have on a
    road of this roughness at this speed.

    vehicle    a model, or a name or file as in ``read_vehicle``

    Raises BadInput for numbers out of range, and as ``read_vehicle``.

    >>> vehicle_modes("rav4-2009").frequency_hz.round(2).tolist()
    [1.12, 1.48, 10.74, 10.84]
    """
    from logger.estimation.car_response import WAVE_NUMBERS_CPM
    from logger.estimation.road_spectrum import RoadSpectrum
    from logger.report.modal_text import vehicle_json, vehicle_lines
    from logger.vehicle.linearise import known_vehicle
    from logger.vehicle.modes import mode_errors
    from logger.vehicle.uncertain import cars_off

    IRI.check("iri_m_per_km", iri_m_per_km)
    SPEED.check("speed_mps", speed_mps)
    model = model_of(vehicle)
    psd = RoadSpectrum.of_iri(iri_m_per_km).psd(WAVE_NUMBERS_CPM)
    try:
        known = known_vehicle(model.vehicle, model.effects)
        cars = [one.at(speed_mps, WAVE_NUMBERS_CPM, psd)
                for one in (known, *cars_off(model.vehicle, model.effects, model.errors))]
    except ValueError as error:
        raise BadInput(f"{model.vehicle.name}: {error}") from None
    found, frequency_std_hz, damping_std = mode_errors(cars[0], cars[1:])
    columns = (np.array([one.frequency_hz for one in found]), frequency_std_hz,
               np.array([one.damping_ratio for one in found]), damping_std)
    at = f", at {speed_mps:g} m/s on a road of {iri_m_per_km:g} m/km" if known.depends_on_motion else ""
    text = "\n".join(vehicle_lines(f"{model.vehicle.name}{at}", *columns))
    return VehicleModes(text, vehicle_json(*columns), *columns)


def found_modes(given: channel_file.ChannelRecord | Path | str, question: ModesQuestion) -> Found:
    """The modes of a record or of a file. BadInput as ``modes``."""
    from logger.api.driven_modes import modes_of_drive

    if question.vehicle is not None:
        return modes_of_drive(given, question)
    if question.speed_mps is not None:
        raise question.wrong("speed_mps", ": expected `vehicle` with it")
    _check(question)
    _check_stands(given, question)
    record, inputs = _asked(given, question)
    try:
        return Found(*_find(question, record, inputs), record)
    except ValueError as error:
        raise question.complaint(f"{name_of(given)}: {error}") from None


def _check_stands(given: channel_file.ChannelRecord | Path | str, question: ModesQuestion) -> None:
    """BadInput for a drive, unless what moved it was measured, or it is said to be a free decay."""
    drives = (bool({*given.names} & {*channel_file.NOT_SENSORS}) if isinstance(given, channel_file.ChannelRecord) else
              channel_file.is_drive(given))
    if drives and question.input_column is None and question.response != "decay":
        raise question.complaint(
            f"{name_of(given)}: expected `vehicle` with a drive: the road, and the second axle that "
            "follows the first, put peaks into its spectrum that are no modes; a stretch that rings freely can be "
            f"looked at with `response` decay")


def _check(question: ModesQuestion) -> None:
    """WrongOption for an option that the method has no use for."""
    method = question.method
    if method == "decrement" and question.order is not None:
        raise question.wrong("order", f": expected a method with poles, not `method` {method}")
    if question.input_column is not None:
        if question.response is not None:
            raise question.wrong("response", ": expected no `input_column`, which says what moves the structure")
        if method not in (None, "n4sid"):
            raise question.wrong("input_column", f": expected `method` n4sid with it, found {method}")


def _asked(given: channel_file.ChannelRecord | Path | str, question: ModesQuestion
           ) -> tuple[Channels, Array | None]:
    """The sensors' record, cut to the wished stretch, and the input's samples (n, 1) or None."""
    pushed, name = question.input_column, name_of(given)
    at = name if isinstance(given, channel_file.ChannelRecord) else f"{name}:1"
    wished = () if question.columns is None else tuple(question.columns)
    if question.columns is not None and (
            not wished or not all(wished) or len(set(wished)) < len(wished) or pushed in wished):
        raise question.wrong("columns", f" {','.join(wished)}: expected names with commas between them, each once, the "
                                        "input not among them")
    wanted = (*wished, pushed) if wished and pushed else wished
    record = _picked(given, wanted) if isinstance(given, channel_file.ChannelRecord) else read_channels(given, wanted)
    if pushed is not None and pushed not in record.names:
        raise BadInput(f"{at}: expected a column {pushed}, found {','.join(record.names)[:80]}")
    t_s = record.start_s + np.arange(len(record.samples)) / record.rate_hz
    inside = (t_s >= (t_s[0] if question.from_s is None else question.from_s)) & (
        t_s <= (t_s[-1] if question.to_s is None else question.to_s))
    if not inside.any():
        raise question.complaint(f"{name}: expected `from_s` before `to_s`, within {t_s[0]:g} "
                       f"to {t_s[-1]:g} s")
    samples = record.samples[inside]
    outputs = [place for place, one in enumerate(record.names) if one != pushed]
    if not outputs:
        raise BadInput(f"{at}: expected a column other than the input {pushed}")
    if not (samples.std(axis=0) > 0).all():
        raise question.complaint(f"{name}: expected every column to move between `from_s` and "
                       f"`to_s`")
    inputs = None if pushed is None else samples[:, [record.names.index(pushed)]]
    names = tuple(record.names[place] for place in outputs)
    return replace(record, names=names, start_s=float(t_s[inside][0]), samples=samples[:, outputs]), inputs


def _picked(given: channel_file.ChannelRecord, wanted: Sequence[str]) -> Channels:
    """These channels of a record, or all. BadInput for one that there is not."""
    if unknown := set(wanted) - set(given.names):
        raise BadInput(f"record: expected a channel {sorted(unknown)[0]}, found {','.join(given.names)[:80]}")
    places = [given.names.index(one) for one in wanted] or list(range(len(given.names)))
    return Channels(tuple(given.names[place] for place in places), given.start_s, given.rate_hz,
                    given.samples[:, places])


def _find(question: ModesQuestion, record: Channels, inputs: Array | None) -> tuple[ModalResult, str]:
    """What was found, and by which method. ValueError for a record that is too short or of another kind, an order that
    it cannot carry, or an input that shows nothing."""
    from logger.modal.analysis import decays, find_modes
    from logger.modal.decay import decrement_mode

    method = question.method
    decay = inputs is None and (decays(record.samples) if question.response is None else
                                question.response == "decay")
    if method in _ONLY_DECAYS and not decay:
        raise ValueError(f"expected a free decay for `method` {method}, found a motion that goes on: `method` ssi "
                         f"finds its modes; `response` decay if it is a decay")
    if method == "decrement":
        if len(record.names) > 1:
            raise ValueError(f"expected one column for the decrement (`columns`), found "
                             f"{','.join(record.names)}")
        return decrement_mode(record.samples[:, 0], record.rate_hz), method
    if question.order is not None and question.order < 2:
        raise ValueError(f"expected an order of 2 or more, found {question.order}")
    found = find_modes(record.samples, record.rate_hz, inputs, question.order, decay)
    return found, "era" if decay else "ssi" if inputs is None else "n4sid"
