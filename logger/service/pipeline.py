"""Samples and fixes in, records of windows out, which wait in a queue for their IRI.

Problem. Comfort is known when a window ends; the road under it is known some seconds later, once the rear axle and the
slow swing of the body have passed it. Rows must leave in order all the same. Solution: windows stand in a queue, the
readings go to the estimator, and the head of the queue leaves as soon as its estimate has come or can come no more.

The pipeline moves in steps of event time, so that what it does depends on the data alone and never on how the
data were delivered. Samples wait until the motion of the car at their instant is settled: between two fixes it
is known, over a short loss bridged, and when no fix has come for longer than that the samples are released as
`blind`. Nothing here reads a clock or a file.
"""

from collections import deque
from dataclasses import dataclass, replace
from math import hypot, isfinite, nan
from typing import Any

import numpy as np

from drivers.readings import AccelerationBlock, Fix
from logger.arrays import Array
from logger.comfort.uncertain_ride import NO_FIGURES
from logger.dsp.windows import GridSamples, Window, WindowCutter, runs_of_equal
from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.drive_spectra import DRIVE_SPECTRA, SpectraKeeper
from logger.estimation.rms_calibration import RmsRelation
from logger.estimation.sensor_noise import NoiseBelief
from logger.estimation.streaming import RoadEstimator, WindowEstimate
from logger.records import WindowRecord
from logger.roads.iso8608 import iri_class
from logger.service.doubted_spans import JudgedDrive
from logger.service.drive_readings import RangeUse
from logger.service.signal_chain import GRID_STEP_US, ComfortColumns, SignalChain
from logger.service.timebase import Odometer
from logger.units import US_PER_S


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

    def read(self, samples: GridSamples, distance_m: Array, leg: int) -> None:
        """Samples of one leg with their travelled distance [m]; the leg before has ended (``end_leg``)."""
        if leg != self._leg:
            self._leg, self._expected = leg, -1
        estimates = self._estimator.push(samples.each_mps2,
                                         samples.each_usable & (samples.present & ~samples.interpolated).reshape(-1, 1),
                                         samples.each_at_end, distance_m)
        self._take(estimates)

    def end_leg(self) -> None:
        """What the estimator still holds comes out; what it never saw to its end has no estimate."""
        self._take(self._estimator.finish())
        self._leg = None  # what waits from here on has no estimate to wait for

    @property
    def is_empty(self) -> bool:
        return not self._queue

    def add(self, waiting: list[Waiting]) -> None:
        """Windows that have ended, in order."""
        self._queue.extend(waiting)

    def ready(self) -> list[tuple[Waiting, WindowEstimate | None]]:
        """Windows whose estimate has come, or for which there will be none."""
        done = []
        while self._queue:
            window = self._queue[0].window
            if _is_whole(window) and window.leg == self._leg and window.number >= self._expected:
                break
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


def _is_whole(window: Window) -> bool:
    return not window.flags & {"partial", "blind"}


FIX_DELAY_US = 3_000_000
LONGEST_LAG_US = 9_000_000
"""A row is made at most so long after its window, once the motion in it is settled: the road behind is part of its
estimate."""

SHORT_WINDOW_SHARE = 0.5
_BLIND = -1


@dataclass(frozen=True)
class PipelineSettings:
    """Lengths and limits of the pipeline.

    bridge_s              longest loss of fix that is bridged [s]
    slow_mps              below this mean speed the r.m.s. relation says nothing [m/s]
    stationary_mps        below this speed the car counts as standing [m/s]
    drive_end_s           standing this long ends the drive [s]
    front_axle_ahead_m    of the GPS antenna, whose distance and place the windows go by [m]
    """

    window_m: float
    blind_window_s: float
    bridge_s: float
    slow_mps: float
    stationary_mps: float
    drive_end_s: float
    latency_s: float
    front_axle_ahead_m: float


def longest_wait_us(bridge_s: float) -> int:
    """The most that can lie between the end of a window and its row [us]. The samples wait for a fix as long as a loss
    may last that is bridged, and rows that were held back so come one estimator's lag after that at the latest."""
    return round(bridge_s * US_PER_S) + FIX_DELAY_US + LONGEST_LAG_US


class Pipeline(JudgedDrive):
    """The whole way from readings to records of one service run. ``alignment``, the use of the range and the
    spectra that are kept learn beside it and change no row."""

    def __init__(self, settings: PipelineSettings, chain: SignalChain, relation: RmsRelation, estimator: RoadEstimator,
                 alignment: DriveAlignment, comfort: ComfortColumns, range_use: RangeUse,
                 spectra: SpectraKeeper) -> None:
        super().__init__(alignment, settings.latency_s)
        self._settings, self._chain, self._estimator, self._relation = settings, chain, estimator, relation
        self._comfort = comfort
        self._roughness = RoughnessQueue(estimator)
        self._cutter = WindowCutter(settings.window_m, settings.blind_window_s, GRID_STEP_US)
        self._bridge_us = round(settings.bridge_s * US_PER_S)
        self._drive_end_us = round(settings.drive_end_s * US_PER_S)
        self._pending: list[GridSamples] = []
        self._start_us: int | None = None
        self._active_us: int | None = None
        self._segment = 0
        self._leg = _BLIND
        self.drive = 1
        self.odometer = Odometer(settings.bridge_s, settings.stationary_mps)
        self.range_use = range_use
        self._spectra = spectra

    def sidecar(self) -> dict[str, Any]:
        """What the sidecars keep of the drives by now."""
        fields = self._spectra.fields()
        return {DRIVE_SPECTRA: fields} if fields else {}

    @property
    def waiting_samples(self) -> int:
        """Samples on the grid that wait for their distance or their window."""
        return sum(map(len, self._pending))

    @property
    def noise(self) -> NoiseBelief | None:
        """What is believed of the accelerometer's noise now; None where it is not learned."""
        return self._estimator.road.noise

    @property
    def noise_stretches(self) -> int:
        """From how many stretches of road that was learned."""
        return self._estimator.road.noise_stretches

    def step(self, now_us: int, block: AccelerationBlock, fixes: list[Fix]) -> list[WindowRecord]:
        """Everything that happened before ``now_us`` [us, monotonic]; steps come in order of time."""
        if self._start_us is None:
            self._start_us = now_us
        for timed in self.judge(block, fixes):
            self.odometer.add(timed)
        self.range_use.take(block, fixes)
        self._pending += self._chain.push(block)
        self._pending += self._chain.advance(self._start_us, now_us)
        # Samples before this instant will not learn more about their motion.
        self._release(now_us - FIX_DELAY_US if self._is_lost(now_us) else self._last_known_us(now_us))
        ended = self._active_us is not None and now_us - self._active_us >= self._drive_end_us
        if ended:
            self._end_leg()
        records = self._records()
        if ended:
            self._active_us = None
            self._estimator.road.next_drive()
            self.drive += 1
        self._forget()
        return records

    def is_settled(self, stepped_us: int, heard_us: int) -> bool:
        """Tell whether nothing is under way after the step at ``stepped_us``, before which the last thing was heard at
        ``heard_us``. For as long as nothing is, the steps that follow come to the same as one at the end of them: the
        sensor is missing, the motion unknown, and no row waits for either."""
        return (stepped_us - heard_us > FIX_DELAY_US and self._is_lost(stepped_us) and self._leg == _BLIND
                and self._roughness.is_empty and not any(part.present.any() for part in self._pending))

    def skip_to(self, t_us: int) -> None:
        """Nothing was heard since the last step and until ``t_us``; the next step comes then."""
        self._pending += self._chain.skip_to(t_us)

    def finish(self) -> list[WindowRecord]:
        """The end of the stream: what waits is released, the window being filled is closed where it stands.

        The last second or two, for which the fix that would have given the motion can come no more, are left out.
        """
        self._pending += self._chain.flush()
        end_us = int(self._pending[-1].t_us[-1]) if self._pending else 0
        last_us = self.odometer.last_t_us
        until_us = last_us if last_us is not None and end_us - last_us <= FIX_DELAY_US else None
        self._release(until_us)
        self._end_leg()
        return self._records()

    @property
    def late_samples(self) -> int:
        """Samples that came after their time had been given up as missing."""
        return self._chain.late_samples

    @property
    def crowded_samples(self) -> int:
        """Samples left out because they came too soon after another."""
        return self._chain.crowded_samples

    def _is_lost(self, now_us: int) -> bool:
        """No fix has come for longer than is bridged."""
        return now_us - self._last_known_us(now_us) > self._bridge_us + FIX_DELAY_US

    def _last_known_us(self, now_us: int) -> int:
        if self.odometer.last_t_us is not None:
            return self.odometer.last_t_us
        return self._start_us if self._start_us is not None else now_us

    def _release(self, until_us: int | None) -> None:
        if not self._pending:
            return
        waiting = GridSamples.joined(self._pending)
        count = len(waiting) if until_us is None else int(np.searchsorted(waiting.t_us, until_us))
        self._pending = [waiting.of(slice(count, None))] if count < len(waiting) else []
        if count:
            self._cut(waiting.of(slice(count)))

    def _cut(self, samples: GridSamples) -> None:
        travel = self.odometer.travel(samples.t_us)
        for low, high in runs_of_equal(np.where(travel.known, travel.leg, _BLIND)):
            part = samples.of(slice(low, high))
            leg = int(travel.leg[low]) if travel.known[low] else _BLIND
            if leg != self._leg:
                self._end_leg()
                self._leg = leg
            if leg == _BLIND:
                self._active_us = int(part.t_us[-1])
                self._enqueue(self._cutter.push_blind(part))
                continue
            speed_mps, distance_m = travel.speed_mps[low:high], travel.distance_m[low:high]
            moving = np.flatnonzero(speed_mps > 0.0)
            if len(moving):
                self._active_us = int(part.t_us[moving[-1]])
            believed = replace(part, present=part.present & ~self.doubted(part.t_us))
            self._spectra.push(part.reading_mps2, speed_mps, believed.present & ~part.interpolated)
            self._roughness.read(believed, distance_m + self._settings.front_axle_ahead_m, leg)
            self._enqueue(self._cutter.push_known(part, distance_m, speed_mps, travel.bridged[low:high], leg))

    def _end_leg(self) -> None:
        """Close the window being filled where it stands, and have the estimator give what it can."""
        self._enqueue(self._cutter.break_off())
        self._roughness.end_leg()
        self._spectra.break_off()
        self._leg = _BLIND

    def _enqueue(self, windows: list[Window]) -> None:
        self._roughness.add([Waiting(window, self._place(window)) for window in windows])

    def _forget(self) -> None:
        """Let go of fixes that no waiting sample and no open window needs."""
        last_us = self.odometer.last_t_us
        if last_us is None:
            return
        oldest_us = int(self._pending[0].t_us[0]) if self._pending else last_us
        opened = self._cutter.oldest_open()
        self.odometer.forget_before(min(oldest_us, opened[0]) if opened else oldest_us,
                                    opened[1] if opened else float("inf"))

    def _records(self) -> list[WindowRecord]:
        records = [self._record(waiting, estimate) for waiting, estimate in self._roughness.ready()]
        self.range_use.count(records)
        return records

    def _record(self, waiting: Waiting, estimate: WindowEstimate | None) -> WindowRecord:
        window, place = waiting.window, waiting.place
        offset_us = self.timebase.utc_offset_us()
        flags = set(window.flags)
        if offset_us is None:
            flags.add("time_unset")
        end_us = window.t_us + round(window.duration_s * US_PER_S)
        for word, found in (("frozen", self.stillness), ("repeated", self.repetition)):
            if found.spans.covers(window.t_us, end_us):
                flags.add(word)
                window = window.without_figures()
        if window.start_m is not None and self.speed_check.spans.covers(window.t_us, end_us):
            flags.add("speed_doubtful")
        unsure_us = self.timebase.unsure_until_us
        if window.start_m is not None and unsure_us is not None and window.t_us <= unsure_us:
            flags.add("gps_late")
        if flags & {"frozen", "repeated", "speed_doubtful"}:
            estimate = estimate and replace(estimate, iri_m_per_km=nan, iri_std_m_per_km=nan, ride=NO_FIGURES)
        if estimate is not None:
            flags |= estimate.flags
        elif window.start_m is not None and "partial" not in flags:
            flags.add("unsettled")
        iri = _known(estimate.iri_m_per_km) if estimate is not None else None
        comfort = self._comfort.of(window, estimate, self.noise)
        if comfort.is_hidden:
            flags.add("hidden")
        ride = comfort.ride
        crest = window.peak_mps2 / window.a_w_mps2 if window.a_w_mps2 > 0.0 else float("nan")
        self._segment += 1
        return WindowRecord(segment=self._segment, drive=self.drive, t_us=window.t_us,
                            utc_us=None if offset_us is None else window.t_us + offset_us, duration_s=window.duration_s,
                            distance_start_m=window.start_m, distance_end_m=window.end_m,
                            lat_deg=place[0] if place else None, lon_deg=place[1] if place else None,
                            speed_mps=_known(window.speed_mps), iri_m_per_km=iri,
                            iri_rms_m_per_km=self._iri_by_rms(window, flags), a_w_mps2=_known(ride.a_w.value),
                            mtvv_mps2=_known(ride.mtvv.value), vdv_mps175=_known(ride.vdv.value),
                            crest_factor=_known(crest), comfort=comfort.word,
                            iri_class=iri_class(iri) if iri is not None else "",
                            accel_rms_mps2=_known(window.accel_rms_mps2), samples=window.samples,
                            clipped_samples=window.clipped, flags=tuple(sorted(flags)),
                            a_w_std_mps2=_known(ride.a_w.std), mtvv_std_mps2=_known(ride.mtvv.std),
                            vdv_std_mps175=_known(ride.vdv.std), a_w_raw_mps2=_known(window.a_w_mps2),
                            mtvv_raw_mps2=_known(window.mtvv_mps2), vdv_raw_mps175=_known(window.vdv_mps175),
                            **_iri_errors(estimate, bool(flags & {"gps_lost", "gps_late"})))

    def _iri_by_rms(self, window: Window, flags: set[str]) -> float | None:
        """IRI by the r.m.s. relation [m/km]; flags say why there is none."""
        if window.start_m is None or window.end_m is None or not isfinite(window.accel_rms_mps2):
            return None
        if "speed_doubtful" in flags:
            return None
        if window.speed_mps < self._settings.slow_mps:
            flags.add("slow")
            return None
        if window.end_m - window.start_m < SHORT_WINDOW_SHARE * self._settings.window_m:
            return None
        iri = self._relation.iri(window.accel_rms_mps2, window.speed_mps)
        if not isfinite(iri):
            flags.add("fast")
            return None
        return iri

    def _place(self, window: Window) -> tuple[float, float] | None:
        if window.start_m is None or window.end_m is None:
            return None
        return self.odometer.place(0.5 * (window.start_m + window.end_m), window.leg)


def _iri_errors(estimate: WindowEstimate | None, is_guessed: bool) -> dict[str, float | None]:
    """Columns of the IRI's standard error and its parts [m/km], with what it costs to carry the speed through a loss of
    fix, or to have that of some seconds before: neighbours have the same wrong speed."""
    # Of the IRI: in simulated drives with losses of 2 to 9 s and changing speed the bias was 2 to 20 %.
    bridged_error = 0.2
    if estimate is None or not isfinite(estimate.iri_m_per_km):
        return dict.fromkeys(("iri_std_m_per_km", "iri_level_std_m_per_km", "iri_common_std_m_per_km",
                              "iri_place_std_m_per_km"))
    bridging = bridged_error * estimate.iri_m_per_km if is_guessed else 0.0
    return {"iri_std_m_per_km": _known(hypot(estimate.iri_std_m_per_km, bridging)),
            "iri_level_std_m_per_km": _known(hypot(estimate.iri_level_std_m_per_km, bridging)),
            "iri_common_std_m_per_km": _known(estimate.iri_common_std_m_per_km),
            "iri_place_std_m_per_km": _known(estimate.iri_place_std_m_per_km)}


def _known(value: float) -> float | None:
    return value if isfinite(value) else None
