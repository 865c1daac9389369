"""Windows wait here for their roughness.

Problem. Comfort is known when a window ends; the road under it is known some seconds later, once the rear axle and the
slow swing of the body have passed it. Rows must leave in order all the same. Solution: windows stand in a queue, the
readings go to the estimator, and the head of the queue leaves as soon as its estimate has come or can come no more.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from logger.dsp.windows import Floats, GridSamples, Window
from logger.estimation.noise_belief import NoiseBelief
from logger.estimation.streaming import RoadEstimator, WindowEstimate


@dataclass(frozen=True)
class Waiting:
    """A window and what was known of it when it ended: its middle as latitude and longitude [deg]."""

    window: Window
    place: tuple[float, float] | None


class RoughnessQueue:
    """The queue in front of the log."""

    def __init__(self, estimator: RoadEstimator) -> None:
        self._estimator = estimator
        self._queue: deque[Waiting] = deque()
        self._estimates: dict[tuple[int, int], WindowEstimate] = {}
        self._leg: int | None = None
        self._expected = -1

    def read(self, samples: GridSamples, distance_m: Floats, leg: int) -> None:
        """Samples of one leg with their travelled distance [m]; the leg before has ended (``end_leg``)."""
        if leg != self._leg:
            self._leg, self._expected = leg, -1
        estimates = self._estimator.push(
            samples.each_mps2,
            samples.each_usable & (samples.present & ~samples.interpolated).reshape(-1, 1),
            samples.each_at_end,
            distance_m,
        )
        self._take(estimates)

    def end_leg(self) -> None:
        """What the estimator still holds comes out; what it never saw to its end has no estimate."""
        self._take(self._estimator.finish())
        self._leg = None  # what waits from here on has no estimate to wait for

    def next_drive(self) -> None:
        """The drive has ended."""
        self._estimator.next_drive()

    @property
    def noise(self) -> NoiseBelief | None:
        """What is believed of the sensor's noise now; None where it is not learnt."""
        return self._estimator.noise

    @property
    def noise_stretches(self) -> int:
        """From how many stretches of road that was learnt."""
        return self._estimator.noise_stretches

    @property
    def is_empty(self) -> bool:
        """No window waits."""
        return not self._queue

    def add(self, waiting: list[Waiting]) -> None:
        """Windows that have ended, in order."""
        self._queue.extend(waiting)

    def ready(self) -> list[tuple[Waiting, WindowEstimate | None]]:
        """Windows whose estimate has come, or for which there will be none."""
        done = []
        while self._queue and self._has_settled(self._queue[0].window):
            waiting = self._queue.popleft()
            key = (waiting.window.leg, waiting.window.number)
            done.append((waiting, self._estimates.pop(key, None) if _is_whole(waiting.window) else None))
        if not self._queue:
            self._estimates.clear()
        return done

    def _take(self, estimates: list[WindowEstimate]) -> None:
        for estimate in estimates:
            if self._leg is not None:
                self._estimates[self._leg, estimate.number] = estimate
            self._expected = estimate.number + 1

    def _has_settled(self, window: Window) -> bool:
        return not _is_whole(window) or window.leg != self._leg or window.number < self._expected


def _is_whole(window: Window) -> bool:
    return not window.flags & {"partial", "blind"}
