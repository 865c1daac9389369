"""The receiver's delay from drive to drive: what a drive begins with, what it learns, and the file in between.

Problem: ``gps.latency_s: auto`` shall mean what was learnt, and a replay shall make the same rows. Solution: what was
known when the service started counts until it ends, and is in the dump's header and the sidecars; what is learnt
meanwhile goes into ``FILE_NAME`` in the folder of the logs (``learnt_file``), for the next start.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.mounting import heading_deg
from logger.estimation.receiver_delay import Belief, combined
from logger.service.config import AccelerometerConfig, GpsConfig
from logger.service.learnt_file import LearntFile, drives_words, value_of
from logger.service.signal_chain import Axis

FILE_NAME = "receiver-delay"
_WHAT = "the receiver's delay"
UNKNOWN = Belief(0.14, 0.07)
"""Before anything was learnt: receivers are late by 0.05 to 0.3 s. Mean and deviation of what is as likely from each
value to twice that."""
MOST_DELAY_S = 2.0
_KEYS = ("latency_s", "latency_std_s", "latency_drives")


def at_start(gps: GpsConfig, learnt: Belief | None) -> Belief:
    """What a session goes by: the number in the settings, else what was learnt, else what is usual."""
    if gps.latency_s is not None:
        return Belief(gps.latency_s, 0.0)
    return learnt or UNKNOWN


def header_fields(known: Belief) -> dict[str, Any]:
    """For the dump's header and the sidecar."""
    return dict(zip(_KEYS, (known.delay_s, known.std_s, known.drives), strict=True))


def is_loggers(fields: Mapping[str, Any]) -> bool:
    """Whether a recording's header is by a logger that knew of the delay, and not written by hand or a simulation."""
    return _KEYS[0] in fields


def from_fields(fields: Mapping[str, Any]) -> Belief | None:
    """What ``header_fields`` said; None where nothing is said. ValueError for what cannot be."""
    if not isinstance(fields, Mapping):
        raise ValueError("expected an object")
    if _KEYS[0] not in fields:
        return None
    return Belief(*value_of(fields, _KEYS, 0.0, MOST_DELAY_S))


def read_learnt(folder: Path) -> Belief | None:
    """What earlier drives left; None where there is nothing that can be read."""
    learnt = LearntFile(folder / FILE_NAME, _WHAT).read(from_fields)
    return learnt if learnt is not None and learnt.std_s > 0 else None


class ReceiverLearning:
    """Carries a session's learning on.

    folder    of the logs
    known     what the session goes by
    learnt    what earlier drives left, also where the settings say a number
    """

    def __init__(self, folder: Path, alignment: DriveAlignment, known: Belief, learnt: Belief | None,
                 files: FileSystem | None = None) -> None:
        self._alignment = alignment
        self._learnt = learnt
        self._file = LearntFile(folder / FILE_NAME, _WHAT, files, header_fields(learnt) if learnt else None)
        self.known = known

    @property
    def now(self) -> Belief | None:
        """What is learnt by now, with this session; None: nothing yet."""
        now = combined(self._learnt or UNKNOWN, self._alignment.estimate())
        # An accelerometer behind a low-pass may be the later of the two, by an error or so.
        return replace(now, delay_s=max(0.0, now.delay_s)) if now.drives else None

    @property
    def shown(self) -> Belief:
        """The best that is known: a number in the settings, what is learnt by now, or what is usual."""
        return self.known if self.known.std_s == 0.0 else self.now or self.known

    def tend(self, now_us: int) -> None:
        """To be called now and then: saves what is new."""
        self._file.tend(now_us, self.save)

    def save(self) -> None:
        """Put what is learnt into its file."""
        if (now := self.now) is not None:
            self._file.save(header_fields(now))

    def words(self) -> str:
        """One line for ``ridelog status``."""
        now, known = self.now, self.known
        if known.std_s == 0.0:
            learnt = f", {_belief_words(now)}" if now is not None else ""
            return f"{known.delay_s:.2f} s by the settings{learnt}"
        if now is not None:
            later = "" if known.drives else "; from the next start on"
            return f"{_belief_words(now)}{later}"
        return f"{known.delay_s:.2f} +- {known.std_s:.2f} s, assumed: {self._alignment.estimate().reason}"

    def notices(self) -> tuple[str, ...]:
        """What is wrong with the mounting, and with a number in the settings that the drives contradict."""
        notices = [f"accelerometer: {words}" for words in self._alignment.complaints]
        now = self.now
        if now is not None and self.known.std_s == 0.0 and abs(now.delay_s - self.known.delay_s) > 4 * now.std_s:
            notices.append(f"GPS: latency_s is {self.known.delay_s:.2f} s in the settings, and {_belief_words(now)}: "
                           "set latency_s: auto")
        return tuple(notices)


def _belief_words(belief: Belief) -> str:
    return f"{belief.delay_s:.2f} +- {belief.std_s:.2f} s, {drives_words(belief.drives)}"


def drive_fields(alignment: DriveAlignment, config: AccelerometerConfig) -> dict[str, Any]:
    """What one drive showed of the delay, for a program: SI units in the names; None where it is not known."""
    found = alignment.estimate()
    axis = Axis.from_word(config.vertical_axis)
    turned_deg = heading_deg(found.forward, axis.column, axis.sign) if found.forward is not None else None
    return {
        "delay_s": found.delay_s,
        "delay_std_s": found.std_s,
        "unknown_because": found.reason,
        "sensor_turned_deg": turned_deg,
        "sensor_turned_std_deg": degrees(found.forward_std_rad) if found.forward_std_rad is not None else None,
        "mounting": list(alignment.complaints),
    }


def drive_words(fields: Mapping[str, Any], known: Belief) -> list[str]:
    """The same for a person, in lines; ``known``: what the rows were made with."""
    used = f"the rows were made with {known.delay_s:.2f} s" + (f" +- {known.std_s:.2f} s" if known.std_s else "")
    if fields["delay_s"] is None:
        lines = [f"Receiver's delay: not known, {fields['unknown_because']}; {used}"]
    else:
        lines = [f"Receiver's delay: {fields['delay_s']:.2f} +- {fields['delay_std_s']:.2f} s by this drive; {used}"]
    return lines + [f"Accelerometer: {words}" for words in fields["mounting"]]
