"""What drives taught, from one start of the service to the next: the accelerometer's noise, the receiver's delay.

Problem: nobody states the noise of this very sensor, ``gps.latency_s: auto`` shall mean what was learned, and a replay
shall make the same rows. Solution: what was known when the service started is in the dump's header and the sidecars.
From there on the pipeline learns the noise from the readings themselves, in a replay as on board; of the delay what was
known counts until the service ends. What is learned goes into a small file in the folder of the logs, for the next
start: the noise with what the sensor was set to, as of another range it says nothing.

The file is written every few minutes, as a car cuts the power. One that cannot be read is as none, and one that cannot
be written is tried again.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import degrees, log
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from drivers.disk import FileSystem
from logger.estimation.drive_alignment import DriveAlignment, heading_deg
from logger.estimation.receiver_delay import UNKNOWN, CarriedDelay, combined
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.files import STATE_BYTES
from logger.printable import counted
from logger.question import READING_NOISE
from logger.service.config import AUTO, AccelerometerConfig, GpsConfig
from logger.service.signal_chain import Axis
from logger.store.log.atomic_file import replace_file
from logger.units import US_PER_S

if TYPE_CHECKING:
    from logger.service.pipeline import Pipeline

SAVE_EVERY_US = 120 * US_PER_S
LEAST_STD_SHARE = 1e-3
"""No drive tells the noise better; a smaller standard error is no logger's, and its density has no logarithm."""
MOST_DELAY_S = 2.0
_MOST_DRIVES = 10**9
_OF = "of"

logger = logging.getLogger(__name__)
Known = TypeVar("Known")


@dataclass(frozen=True)
class KnownNoise:
    """What is believed of the noise of a reading, over how many drives it was learned."""

    belief: NoiseBelief
    drives: int = 0


@dataclass(frozen=True)
class LearnedQuantity(Generic[Known]):
    """One thing that is learned.

    what          it is, for messages: "the receiver's delay"
    keys          of its value, its standard error and the number of drives; nothing is said where ``key`` is not there
    least_share   smallest standard error, as a share of the value
    numbers       those three of what is known, and ``known`` the way back
    """

    file_name: str
    what: str
    keys: tuple[str, str, str]
    key: str
    least: float
    most: float
    least_share: float
    numbers: Callable[[Known], tuple[float, float, int]]
    known: Callable[[float, float, int], Known]

    def fields(self, known: Known | None) -> dict[str, Any]:
        """For the dump's header, the sidecar and programs; None, None, 0 where nothing is known."""
        return dict(zip(self.keys, (None, None, 0) if known is None else self.numbers(known), strict=True))

    def from_fields(self, fields: Mapping[str, Any]) -> Known | None:
        """What ``fields`` said; None where nothing is said. ValueError for what cannot be."""
        if not isinstance(fields, Mapping):
            raise ValueError("expected an object")
        if self.key not in fields:
            return None
        value, std, drives = (fields.get(key, 0) for key in self.keys)
        numbers = [one for one in (value, std) if isinstance(one, (int, float)) and not isinstance(one, bool)]
        if len(numbers) < 2 or not (self.least <= value <= self.most and 0 <= std <= self.most) \
                or isinstance(drives, bool) or not isinstance(drives, int) or not 0 <= drives < _MOST_DRIVES:
            raise ValueError(f"expected {self.keys[0]} and {self.keys[1]} from {self.least:g} to {self.most:g}, and a "
                             "number of drives")
        if std < self.least_share * value:
            raise ValueError(f"expected {self.keys[1]} of at least {self.least_share:g} of {self.keys[0]}")
        return self.known(float(value), float(std), drives)

    def read(self, folder: Path, is_of_this: Callable[[Mapping[str, Any]], bool] = lambda _: True) -> Known | None:
        """What earlier drives left in the folder of the logs; None where there is nothing that can be read, or it is
        not ``is_of_this``."""
        path = folder / self.file_name
        try:
            with FileSystem().open(path) as file:
                fields = json.loads(file.read(STATE_BYTES))
            known = self.from_fields(fields)
            return known if known is not None and is_of_this(fields) else None
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, RecursionError) as error:
            logger.warning("%s: what was learned of %s cannot be read, it is learned again (%s)", path, self.what,
                           error)
            return None


NOISE = LearnedQuantity("sensor-noise", "the sensor's noise", ("noise_mps2", "noise_std_mps2", "noise_drives"),
                       "noise_std_mps2", *READING_NOISE[:2], LEAST_STD_SHARE,
                       lambda known: (known.belief.noise_rms_mps2, known.belief.std_mps2, known.drives),
                       lambda noise, std, drives: KnownNoise(NoiseBelief(log(noise), std / noise), drives))
DELAY = LearnedQuantity(
    "receiver-delay", "the receiver's delay", ("latency_s", "latency_std_s", "latency_drives"), "latency_s",
    0.0, MOST_DELAY_S, 0.0, lambda known: (known.delay_s, known.std_s, known.drives), CarriedDelay)


class CarriedLearning(Generic[Known]):
    """Carries a session's learning of a quantity on, and keeps it in its file in the folder of the logs.

    known    what the session began with; None: nothing was known
    saved    what is in the file already
    """

    def __init__(self, quantity: LearnedQuantity[Known], folder: Path, known: Known | None, files: FileSystem | None,
                 saved: Mapping[str, Any] | None = None) -> None:
        self._quantity, self._path, self._known = quantity, folder / quantity.file_name, known
        self._files = files or FileSystem()
        self._saved = saved
        self._tried_us: int | None = None
        self._failed = False

    @property
    def now(self) -> Known | None:
        """What is known by now, with this session; None: nothing yet, or it is not to be learned."""
        raise NotImplementedError

    def tend(self, now_us: int) -> None:
        """To be called now and then: saves every few minutes what is new."""
        if self._tried_us is None:
            self._tried_us = now_us
        if now_us - self._tried_us >= SAVE_EVERY_US:
            self._tried_us = now_us
            self.save()

    def save(self) -> None:
        """Put what is learned into its file, whole, if it is new."""
        now = self.now
        fields = {**self._quantity.fields(now), **self._beside()}
        if now is None or now is self._known or fields == self._saved:
            return
        try:
            replace_file(self._files, self._path, [(json.dumps(fields) + "\n").encode("ascii")])
            self._saved, self._failed = fields, False
        except OSError as error:
            if not self._failed:
                logger.warning("%s: what was learned of %s cannot be written: %s", self._path, self._quantity.what,
                               error.strerror)
            self._failed = True

    def _beside(self) -> dict[str, Any]:
        """What else stands in the file."""
        return {}


def read_noise(folder: Path, config: AccelerometerConfig) -> KnownNoise | None:
    """What earlier drives left of this sensor as it is set; None where there is nothing that can be read."""
    return NOISE.read(folder, lambda fields: fields.get(_OF) == _identity(config))


def noise_at_start(folder: Path, config: AccelerometerConfig) -> KnownNoise | None:
    """What a session begins with, where the noise is to be learned: what earlier drives left in the folder, a little
    less certain than it was then. None: nothing is known, or it is not to be learned."""
    learned = read_noise(folder, config) if config.noise_mps2 == AUTO else None
    return learned and KnownNoise(learned.belief.next_drive(), learned.drives)


def _identity(config: AccelerometerConfig) -> dict[str, Any]:
    """What the sensor is and how it is read, as far as its noise depends on that."""
    readings = config.kind.readings(config.settings)
    is_of_each = readings.oversample > 1 and Sensor(readings.noise_mps2, readings.step_mps2).is_coarse
    return {"driver": config.driver, **config.kind.header(config.settings),
            **({"reads": readings.oversample} if is_of_each else {})}


class NoiseLearning(CarriedLearning[KnownNoise]):
    """Of the accelerometer's noise, by a ``pipeline`` that learns it; ``config`` of the accelerometer."""

    def __init__(self, folder: Path, pipeline: Pipeline, config: AccelerometerConfig, known: KnownNoise | None,
                 files: FileSystem | None = None) -> None:
        super().__init__(NOISE, folder, known, files)
        self._pipeline, self._config = pipeline, config

    @property
    def now(self) -> KnownNoise | None:
        """What is known by now, with this session; None: nothing yet, or it is not to be learned."""
        belief = self._pipeline.noise
        if belief is None or not self._pipeline.noise_stretches:
            return self._known
        return KnownNoise(belief, 1 + (self._known.drives if self._known else 0))

    def _beside(self) -> dict[str, Any]:
        return {_OF: _identity(self._config)}

    def fields(self) -> dict[str, Any]:
        """The same for a program: noise and standard error in m/s2, None where they are not learned."""
        return NOISE.fields(self.now)

    def words(self) -> str:
        """One line for ``ridelog status``."""
        noise, now = self._config.noise_mps2, self.now
        if isinstance(noise, float):
            return f"{noise:.3g} m/s2 by the settings"
        if now is None:
            usual = self._config.kind.readings(self._config.settings).noise_mps2
            return f"{usual:.2g} m/s2 assumed{'; it is learned while driving' if noise == AUTO else ''}"
        return (f"{now.belief.noise_rms_mps2:.2g} ± {now.belief.std_mps2:.1g} m/s2, learned over "
                f"{counted(now.drives, 'drive')}")


def delay_at_start(gps: GpsConfig, learned: CarriedDelay | None) -> CarriedDelay:
    """What a session goes by: the number in the settings, else what was learned, else what is usual."""
    if gps.latency_s is not None:
        return CarriedDelay(gps.latency_s, 0.0)
    return learned or UNKNOWN


def is_loggers(fields: Mapping[str, Any]) -> bool:
    """Whether a recording's header is by a logger that knew of the delay, and not written by hand or a simulation."""
    return DELAY.key in fields


def read_delay(folder: Path) -> CarriedDelay | None:
    """What earlier drives left; None where there is nothing that can be read."""
    learned = DELAY.read(folder)
    return learned if learned is not None and learned.std_s > 0 else None


class ReceiverLearning(CarriedLearning[CarriedDelay]):
    """Of the receiver's delay.

    known     what the session goes by
    learned    what earlier drives left, also where the settings say a number
    """

    def __init__(self, folder: Path, alignment: DriveAlignment, known: CarriedDelay, learned: CarriedDelay | None,
                 files: FileSystem | None = None) -> None:
        super().__init__(DELAY, folder, known, files, DELAY.fields(learned) if learned else None)
        self._alignment, self._learned, self.known = alignment, learned, known

    @property
    def now(self) -> CarriedDelay | None:
        """What is learned by now, with this session; None: nothing yet."""
        now = combined(self._learned or UNKNOWN, self._alignment.estimate())
        # An accelerometer behind a low-pass may be the later of the two, by an error or so.
        return replace(now, delay_s=max(0.0, now.delay_s)) if now.drives else None

    @property
    def shown(self) -> CarriedDelay:
        """The best that is known: a number in the settings, what is learned by now, or what is usual."""
        return self.known if self.known.std_s == 0.0 else self.now or self.known

    def words(self) -> str:
        """One line for ``ridelog status``."""
        now, known = self.now, self.known
        if known.std_s == 0.0:
            learned = f", {_belief_words(now)}" if now is not None else ""
            return f"{known.delay_s:.2f} s by the settings{learned}"
        if now is not None:
            later = "" if known.drives else "; from the next start on"
            return f"{_belief_words(now)}{later}"
        return f"{known.delay_s:.2f} ± {known.std_s:.2f} s, assumed: {self._alignment.estimate().reason}"

    def notices(self) -> tuple[str, ...]:
        """What is wrong with the mounting, and with a number in the settings that the drives contradict."""
        notices = [f"accelerometer: {words}" for words in self._alignment.complaints]
        now = self.now
        if now is not None and self.known.std_s == 0.0 and abs(now.delay_s - self.known.delay_s) > 4 * now.std_s:
            notices.append(f"GPS: latency_s is {self.known.delay_s:.2f} s in the settings, and {_belief_words(now)}: "
                           "set latency_s: auto")
        return tuple(notices)


def _belief_words(belief: CarriedDelay) -> str:
    return f"{belief.delay_s:.2f} ± {belief.std_s:.2f} s, learned over {counted(belief.drives, 'drive')}"


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


def drive_words(fields: Mapping[str, Any], known: CarriedDelay) -> list[str]:
    """The same for a person, in lines; ``known``: what the rows were made with."""
    used = f"the rows used {known.delay_s:.2f} s" + (f" ± {known.std_s:.2f} s" if known.std_s else "")
    if fields["delay_s"] is None:
        lines = [f"GPS delay: not known, {fields['unknown_because']}; {used}"]
    else:
        lines = [f"GPS delay: {fields['delay_s']:.2f} ± {fields['delay_std_s']:.2f} s from this drive; {used}"]
    return lines + [f"Accelerometer: {words}" for words in fields["mounting"]]
