"""Predictions of runs by a car with effects.

Problem: a fit needs hundreds of predictions of the same runs, by cars that differ in a number or an effect. Solution:
``SimulatedRuns`` caches the road under the wheels of each run (``Passage``), also for the few other distance signals
(with a scale error, with a distance error) that were used last.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import numpy.typing as npt

from logger.profiles.track import WheelTracks
from logger.runs import Run, Signal
from logger.vehicle.compose import MOST_MPS2, Car, Response, respond, stepper_of
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.observe import recorded_signals
from logger.vehicle.simulate import FINE_RATE_HZ, Passage
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

_KEPT_PASSAGES = 4
_STEPPERS = 2
_HOP_HZ = 13.0  # of a car's wheels
_MOST_FINER = 16
# Dry friction jumps: it needs so many times the steps of other laws.
_FINER_WITH_FRICTION = 2


def steps_hz(vehicle: Vehicle, usual_hz: float = FINE_RATE_HZ) -> float:
    """Steps a second in which a vehicle is simulated: as usual for one whose wheels hop as those of cars do, twice as
    many for one an octave quicker, and so on up to four octaves."""
    quickest_hz = float(undamped_frequencies_hz(structure_of(vehicle))[-1])
    return usual_hz * float(np.clip(2 ** np.round(np.log2(quickest_hz / _HOP_HZ)), 1, _MOST_FINER))


class SimulatedRuns:
    """Runs, and predictions of them in at least so many steps a second. Threads may ask at the same time; cars with
    laws of their own are stepped in two threads besides."""

    def __init__(self, runs: Sequence[Run], fine_hz: float = FINE_RATE_HZ) -> None:
        self.runs, self.fine_hz = list(runs), fine_hz
        self._steppers = ThreadPoolExecutor(_STEPPERS)
        self._passages: list[dict[tuple[float, bytes, WheelTracks], Passage]] = [{} for _ in self.runs]

    def __len__(self) -> int:
        return len(self.runs)

    def predict(self, car: Car, distance_error_m: Sequence[Array] | None = None, rough: bool = False,
                tracks: Sequence[WheelTracks] | None = None) -> list[Array]:
        """Predicted record of each run, whole, in its pass band (n,) [m/s2]; of one with more signals all ((1 + s) n,).

        distance_error_m    distance driven minus distance recorded (n,), per run; None: 0
        rough               no finer steps for a car with dry friction: near enough for differences
        tracks              roads in place of the runs' own; each such object is cached by itself
        """
        with np.errstate(over="ignore", invalid="ignore"):
            passages = self._passages_of(car, distance_error_m, rough, tracks)
            for step_s in {one.step_s for one in passages if car.bends_laws}:
                stepper_of(car, step_s)  # made once, before both threads ask for it
        each: Iterable[Array] = (self._steppers.map if car.bends_laws else map)(
            partial(_recorded, car), passages, [run.signals for run in self.runs])
        return [run.in_band(one) for run, one in zip(self.runs, each, strict=True)]

    def respond(self, car: Car, distance_error_m: Sequence[Array] | None = None) -> list[Response]:
        """The response of the car in each run: its record, and the motions of suspensions and tires."""
        with np.errstate(over="ignore", invalid="ignore"):
            return [respond(car, passage) for passage in self._passages_of(car, distance_error_m)]

    def _passages_of(self, car: Car, distance_error_m: Sequence[Array] | None, rough: bool = False,
                     tracks: Sequence[WheelTracks] | None = None) -> list[Passage]:
        fine_hz = _FINER_WITH_FRICTION * self.fine_hz if car.rubs and not rough else self.fine_hz
        found = []
        for index, run in enumerate(self.runs):
            distance = run.distance_m if distance_error_m is None else run.distance_m + distance_error_m[index]
            distance = car.driven(distance)
            track: WheelTracks = run.track if tracks is None else tracks[index]
            key = fine_hz, distance.tobytes(), track
            passage = self._passages[index].get(key)  # another thread may put others in its place at any time
            if passage is None:
                passage = Passage(track, run.rate_hz, distance, fine_hz, index)
                kept = [*self._passages[index].items()][-_KEPT_PASSAGES + 1 :]
                self._passages[index] = dict(kept) | {key: passage}
            found.append(passage)
        return found


def _recorded(car: Car, passage: Passage, signals: tuple[Signal, ...]) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        found = recorded_signals(car, passage, signals)
    return np.clip(np.nan_to_num(found, nan=MOST_MPS2), -MOST_MPS2, MOST_MPS2)
