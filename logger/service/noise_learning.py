"""The accelerometer's noise from drive to drive: what a drive begins with, what it learns, and the file in between.

Problem: nobody states the noise of this very sensor, so it is learnt, and a replay shall make the same rows. Solution:
where the service begins is in the dump's header and the sidecars; from there on the pipeline learns from the readings
themselves, in a replay as on board. What it comes to goes into ``FILE_NAME`` in the folder of the logs
(``learnt_file``), for the next start, with what the sensor was set to: of another range it says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log
from pathlib import Path
from typing import Any, Protocol

from drivers.disk import FileSystem
from logger.estimation.noise_belief import NoiseBelief
from logger.estimation.sensor_noise import Sensor
from logger.service.config import AUTO, LEAST_NOISE_MPS2, MOST_NOISE_MPS2, AccelerometerConfig
from logger.service.learnt_file import LearntFile, drives_words, value_of

FILE_NAME = "sensor-noise"
_WHAT = "the sensor's noise"
_KEYS = ("noise_mps2", "noise_std_mps2", "noise_drives")
_OF = "of"
LEAST_STD_SHARE = 1e-3
"""No drive tells the noise better; a smaller standard error is no logger's, and its density has no logarithm."""


@dataclass(frozen=True)
class KnownNoise:
    """What is believed of the noise of a reading, over how many drives it was learnt."""

    belief: NoiseBelief
    drives: int = 0


class LearnsNoise(Protocol):
    """That which learns while it drives."""

    @property
    def noise(self) -> NoiseBelief | None: ...
    @property
    def noise_stretches(self) -> int: ...


def header_fields(known: KnownNoise) -> dict[str, Any]:
    """For the dump's header and the sidecar."""
    belief = known.belief
    return dict(zip(_KEYS, (belief.noise_rms_mps2, belief.std_mps2, known.drives), strict=True))


def from_fields(fields: Mapping[str, Any]) -> KnownNoise | None:
    """What ``header_fields`` said; None where nothing is said. ValueError for what cannot be."""
    if not isinstance(fields, Mapping):
        raise ValueError("expected an object")
    if _KEYS[1] not in fields:
        return None
    noise, std, drives = value_of(fields, _KEYS, LEAST_NOISE_MPS2, MOST_NOISE_MPS2)
    if std < LEAST_STD_SHARE * noise:
        raise ValueError(f"expected {_KEYS[1]} of at least {LEAST_STD_SHARE:g} of {_KEYS[0]}")
    return KnownNoise(NoiseBelief(log(noise), std / noise), drives)


def read_learnt(folder: Path, config: AccelerometerConfig) -> KnownNoise | None:
    """What earlier drives left of this sensor as it is set; None where there is nothing that can be read."""
    def meaning(fields: Any) -> KnownNoise | None:
        known = from_fields(fields)
        return known if known is not None and fields.get(_OF) == _identity(config) else None

    return LearntFile(folder / FILE_NAME, _WHAT).read(meaning)


def at_start(folder: Path, config: AccelerometerConfig) -> KnownNoise | None:
    """What a session begins with, where the noise is to be learnt: what earlier drives left in the folder, a little
    less certain than it was then. None: nothing is known, or it is not to be learnt."""
    learnt = read_learnt(folder, config) if config.noise_mps2 == AUTO else None
    return learnt and KnownNoise(learnt.belief.next_drive(), learnt.drives)


def _identity(config: AccelerometerConfig) -> dict[str, Any]:
    """What the sensor is and how it is read, as far as its noise depends on that."""
    readings = config.kind.readings(config.settings)
    is_of_each = readings.oversample > 1 and Sensor(readings.noise_mps2, readings.step_mps2).is_coarse
    return {"driver": config.driver, **config.kind.header(config.settings),
            **({"reads": readings.oversample} if is_of_each else {})}


class NoiseLearning:
    """Carries a session's learning on.

    folder     of the logs
    pipeline   that which learns
    config     of the accelerometer
    known      what the session began with; None: nothing was known
    """

    def __init__(self, folder: Path, pipeline: LearnsNoise, config: AccelerometerConfig, known: KnownNoise | None,
                 files: FileSystem | None = None) -> None:
        self._pipeline, self._config, self._known = pipeline, config, known
        self._file = LearntFile(folder / FILE_NAME, _WHAT, files)

    @property
    def now(self) -> KnownNoise | None:
        """What is known by now, with this session; None: nothing yet, or it is not to be learnt."""
        belief = self._pipeline.noise
        if belief is None or not self._pipeline.noise_stretches:
            return self._known
        return KnownNoise(belief, 1 + (self._known.drives if self._known else 0))

    def tend(self, now_us: int) -> None:
        """To be called now and then: saves what is new."""
        self._file.tend(now_us, self.save)

    def save(self) -> None:
        """Put what is learnt into its file."""
        now = self.now
        if now is not None and now is not self._known:
            self._file.save({**header_fields(now), _OF: _identity(self._config)})

    def fields(self) -> dict[str, Any]:
        """The same for a program: noise and standard error in m/s2, None where they are not learnt."""
        now = self.now
        return header_fields(now) if now is not None else dict(zip(_KEYS, (None, None, 0), strict=True))

    def words(self) -> str:
        """One line for ``ridelog status``."""
        noise, now = self._config.noise_mps2, self.now
        if isinstance(noise, float):
            return f"{noise:.3g} m/s2 by the settings"
        if now is None:
            usual = self._config.kind.readings(self._config.settings).noise_mps2
            return f"{usual:.2g} m/s2 assumed{'; it is learnt while driving' if noise == AUTO else ''}"
        return f"{now.belief.noise_rms_mps2:.2g} +- {now.belief.std_mps2:.1g} m/s2, {drives_words(now.drives)}"
