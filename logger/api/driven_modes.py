"""Modes of a car out of a drive: its file, its speed and the vehicle, put before the fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.api.drive_questions import ModesQuestion
from logger.api.drives import read_run
from logger.api.vehicles import model_of
from logger.api.vibration_records import Channels, Found, name_of, read_channels
from logger.errors import BadInput
from logger.runs import READING, SKIP_S
from logger.store.formats.channel_file import SPEED as SPEED_COLUMN
from logger.store.formats.channel_file import ChannelRecord
from logger.store.formats.drive_file import header_of
from logger.store.formats.record_file import VERTICAL

Array = npt.NDArray[np.float64]

METHOD = "vehicle"
_UNUSED = ("order", "response", "input_column")


def modes_of_drive(given: ChannelRecord | Path | str, question: ModesQuestion) -> Found:
    """The modes of the vehicle near the one of the question that was driven. BadInput as ``logger.api.modal.modes``."""
    from logger.modal.driven_car import car_modes

    assert question.vehicle is not None
    model = model_of(question.vehicle)
    if model.effects:
        raise BadInput(f"{model.vehicle.name}: expected a car without effects where the road was not measured, found "
                       f"{', '.join(one.effect.name for one in model.effects)}")
    for option in _UNUSED:
        if getattr(question, option) is not None:
            raise question.wrong(option, ": expected a record without `vehicle`")
    if question.method is not None:
        raise question.wrong("method", f" {question.method}: expected none with `vehicle`, whose "
                                       "numbers are fitted to the spectrum")
    name, start_s, rate_hz, samples, speed_mps, usable = _record(given, question)
    time_s = start_s + np.arange(len(samples)) / rate_hz
    first_s = time_s[0] + SKIP_S if question.from_s is None else question.from_s
    inside = (time_s >= first_s) & (time_s <= (time_s[-1] if question.to_s is None else question.to_s))
    if not inside.any():
        raise question.complaint(f"{name}: expected `from_s` before `to_s`, within "
                       f"{time_s[0]:g} to {time_s[-1]:g} s")
    if not np.ptp(samples[inside]) > 0:
        raise BadInput(f"{name}: expected an acceleration that moves, found {samples[inside][0]:g} m/s2 all along")
    try:
        found = car_modes(model.vehicle, samples[inside], speed_mps[inside], usable[inside], rate_hz)
    except ValueError as error:
        raise BadInput(f"{name}: {error}") from None
    return Found(found, METHOD, Channels((VERTICAL,), float(time_s[inside][0]), rate_hz, samples[inside][:, None]))


def _record(given: ChannelRecord | Path | str, question: ModesQuestion
            ) -> tuple[str, float, float, Array, Array, npt.NDArray[np.bool_]]:
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
