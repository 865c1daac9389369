"""Stretches of a drive that are not believed: a sensor that stands still or repeats itself, a wrong speed; and what
readings and fixes are judged by as they come."""

from collections import deque
from collections.abc import Sequence
from math import sqrt

import numpy as np

from drivers.readings import AccelerationBlock, Fix
from logger.arrays import Array, Bools, Whole
from logger.bounds import MOVING_MPS
from logger.dsp.repeated_samples import LEAST_SHARE, are_fresh, find_repeats, fresh_samples
from logger.estimation.drive_alignment import DEVIATIONS, DriveAlignment
from logger.geodesy import apart_m
from logger.service.timebase import Timebase, TimedFix
from logger.units import US_PER_S

_KEPT = 64


class DoubtedSpans:
    """The last spans, each from the first to the last instant that is doubted, both included [us]."""

    def __init__(self) -> None:
        self._spans: deque[tuple[int, int]] = deque(maxlen=_KEPT)

    @property
    def last_us(self) -> int | None:
        """Where the newest ends; None: there is none."""
        return self._spans[-1][1] if self._spans else None

    def begin(self, first_us: int, last_us: int) -> None:
        """One more span, as far as it has come."""
        self._spans.append((first_us, last_us))

    def end_at(self, last_us: int) -> None:
        """The newest lasts, or lasted, until then."""
        self._spans[-1] = (self._spans[-1][0], last_us)

    def covers(self, begin_us: int, end_us: int) -> bool:
        """Tell whether some of [begin, end) is doubted."""
        return any(begin_us <= last_us and first_us < end_us for first_us, last_us in self._spans)

    def during(self, t_us: Whole) -> Bools:
        """Tell of instants (n,) [us] whether they are doubted."""
        doubted = np.zeros(len(t_us), dtype=np.bool_)
        for first_us, last_us in self._spans:
            doubted |= (first_us <= t_us) & (t_us <= last_us)
        return doubted


FROZEN_S = 30.0
LONGEST_BETWEEN_FIXES_US = 3 * US_PER_S


class Stillness:
    """Follows readings and fixes, each in order of time.

    Problem: a chip that has frozen goes on giving the reading it had, and a road of no roughness at all is what comes
    out. But with steps of 0.6 m/s2 a car that is parked gives one and the same reading for hours too, and nothing is
    wrong.

    Solution: the receiver shows which of the two it is. Only time counts through which every fix said that the car
    moved, and not one axis of one reading changed. After ``FROZEN_S`` of it the sensor is frozen until a reading
    changes, with a fix or without, and its windows are flagged and left without figures: from where it began, as far as
    they have not been written yet. Before that nothing is said. A sensor without any noise, at an even speed on a
    perfect road, can be silent for half a minute too; what it says then is too little to judge a road by.

    spans    in which the sensor was frozen
    """

    def __init__(self) -> None:
        self._last: tuple[float, ...] | None = None
        self._changed_us = 0
        self._heard_us = 0
        self._moving_us: int | None = None
        self._fix_us = 0
        self.spans = DoubtedSpans()
        self._lasting = False

    def take(self, block: AccelerationBlock, fixes: Sequence[Fix]) -> None:
        for fix in fixes:
            self._take_fix(fix)
        if len(block):
            self._take_block(block)
        if not self._lasting and self.frozen_s:
            self._lasting = True
            self.spans.begin(self._span_us()[0], self._heard_us)

    @property
    def frozen_s(self) -> float:
        """For how long the car has been driving on one reading [s]; 0 while that is no longer than it may be."""
        begin_us, end_us = self._span_us()
        still_s = (end_us - begin_us) / US_PER_S
        return still_s if still_s >= FROZEN_S else 0.0

    def _span_us(self) -> tuple[int, int]:
        if self._moving_us is None:
            return 0, 0
        return max(self._changed_us, self._moving_us), min(self._heard_us, self._fix_us)

    def _take_fix(self, fix: Fix) -> None:
        moves = fix.valid and fix.speed_mps is not None and fix.speed_mps >= MOVING_MPS
        if not moves:
            self._moving_us = None
        elif self._moving_us is None or fix.t_us - self._fix_us > LONGEST_BETWEEN_FIXES_US:
            self._moving_us = fix.t_us
        self._fix_us = fix.t_us

    def _take_block(self, block: AccelerationBlock) -> None:
        readings = block.accel_mps2
        is_new = np.ones(len(block), dtype=np.bool_)
        is_new[1:] = (readings[1:] != readings[:-1]).any(axis=1)
        was_silent = int(block.t_us[0]) - self._heard_us > LONGEST_BETWEEN_FIXES_US
        is_new[0] = self._last != tuple(readings[0]) or (was_silent and not self._lasting)
        changes_us = block.t_us[is_new]
        self._last = tuple(readings[-1])
        self._heard_us = int(block.t_us[-1])
        if self._lasting:
            self.spans.end_at(int(changes_us[0]) - 1 if len(changes_us) else self._heard_us)
        if len(changes_us):
            self._changed_us = int(changes_us[-1])
            self._lasting = False


WINDOW = 2048
FALSE_ALARM = 1e-10  # For each window: in ten years of driving 8 hours a day at 100 Hz, once in a thousand cars
PROOF_LASTS = 15
"""Windows, five minutes: a coarse sensor that rightly repeats some samples on a quiet road cannot show that it is well
again; what it was found to do does not count for longer."""


class Repetition:
    """Follows readings in order of time. What it finds does not depend on how they were cut into blocks.

    Problem: a bridge that writes 200 lines a second of a sensor that takes 51 readings gives plausible numbers at an
    even rate. Between the held readings stand steps that no car makes: a quiet road reads up to a quarter too rough.
    Solution: samples are judged ``WINDOW`` at a time by the pattern of what repeats (``logger.dsp.repeated_samples``),
    which a coarse sensor that rightly stays on one code does not have. From the window in which repeats were found
    until one in which hardly any are, or which shows that none are held, or until no window has shown them for some
    minutes, rows are flagged ``repeated`` and left without figures, as far as they have not been written yet.

    spans    in which samples were repeated
    share    of the samples of the last window that repeat the one before, while they are found to; else 0
    """

    def __init__(self) -> None:
        self._t_us = np.empty(0, dtype=np.int64)
        self._accel_mps2 = np.empty((0, 3))
        self.spans = DoubtedSpans()
        self._unproven = 0
        self.share = 0.0

    def take(self, block: AccelerationBlock) -> None:
        if not len(block):
            return
        self._t_us = np.concatenate([self._t_us, block.t_us])
        self._accel_mps2 = np.concatenate([self._accel_mps2, block.accel_mps2])
        while len(self._t_us) >= WINDOW:
            self._judge(self._t_us[:WINDOW], self._accel_mps2[:WINDOW])
            self._t_us, self._accel_mps2 = self._t_us[WINDOW:], self._accel_mps2[WINDOW:]
        if self.share and len(self._t_us):
            self.spans.end_at(int(self._t_us[-1]))

    @property
    def doubt(self) -> str:
        """What is wrong with the samples that come, and what to do; empty: nothing."""
        if not self.share:
            return ""
        return (f"{100 * self.share:.0f} of 100 samples repeat the one before: ridelog computes nothing from them. "
                "Have the sensor, or its bridge, send each reading once")

    def _judge(self, t_us: Whole, accel_mps2: Array) -> None:
        share = float((~fresh_samples(accel_mps2)[1:]).mean())
        repeats = share >= LEAST_SHARE and find_repeats(accel_mps2, FALSE_ALARM) is not None
        self._unproven = 0 if repeats else self._unproven + 1
        if self.share:
            over = share < LEAST_SHARE or are_fresh(accel_mps2) or self._unproven > PROOF_LASTS
            self.share = 0.0 if over else share
            if self.share:
                self.spans.end_at(int(t_us[-1]))
            return
        if repeats:
            self.share = share
            self.spans.begin(int(t_us[0]), int(t_us[-1]))


STEP_M = 25.0  # of either way: a chord of it over a curve of 25 m radius is 4 % short
SHARE = 0.08  # a speed that is 4 % off, and chords that are 4 % short
PLACE_M = 8.0  # between 4 m in the open and 15 m among houses, as the town drives of the bench have them
SPEED_MPS = 0.1  # usual of receivers, each fix by itself
WORST = 2
FEWEST_STEPS = 5
JUMP_M = 100.0  # among houses the places of a standing car move by some tens of metres
HELD_MPS = 2.0  # receivers that hold their places do so at walking pace
LONGEST_US = 180 * US_PER_S
LONGEST_M = 1500.0
AGREES_M = 100.0
LASTING_US = 60 * US_PER_S


class SpeedCheck:
    """Follows fixes in order of time. ``spans`` are the stretches that are doubtful.

    Problem: the road's roughness is read by the speed, and a receiver may give a wrong one: none at all while it holds
    its speed back at low signal, twice the true one in another unit, that of a simulator. Nothing in a fix shows it.
    Solution: the places give the speed too. A stretch of fixes is cut into steps of ``STEP_M``; the way by the speed is
    held against the sum of the steps by the places.

    How far they may differ follows from the errors of receivers that are well. Those of places last, so that along a
    road they cancel but for the first and the last of them (``PLACE_M`` each); the speed's noise (``SPEED_MPS``, each
    fix by itself) adds up as the root of time, and both may be a few per cent off (``SHARE``: the scale of a speed, and
    chords that cut corners). The limit is ``DEVIATIONS`` of the random part more than the share, and so it falls in
    proportion as the stretch grows. Where the places make more, the ``WORST`` steps are left out: a single place far
    off makes two, a place that is put right after a tunnel makes one; neither makes a way shorter. Steps in which
    places were held while the car crept do not count.

    On simulated drives through a town half or twice the speed is found after 12 to 17 s of driving, 0.8 of it after 42
      s,
    1.2 times after 68 s (medians); in 10 h with a good receiver none is doubted (``tests/benchmarks/speed_check.py``).

    A stretch in which they disagree is doubtful, and so is what follows until they have been seen to agree.
    """

    def __init__(self) -> None:
        self._first: TimedFix | None = None
        self._last: TimedFix | None = None
        self._node: TimedFix | None = None
        self._since_node_m = 0.0
        self._was_held = False
        self._steps: list[tuple[float, float]] = []
        self._nodes: list[TimedFix] = []
        self.spans = DoubtedSpans()
        self._lasts = False
        self._said = ""

    def take(self, timed: TimedFix) -> None:
        """The next fix. One without place or speed, or after a loss, ends the stretch."""
        fix, last = timed.fix, self._last
        if not fix.valid or fix.lat_deg is None or fix.lon_deg is None or fix.speed_mps is None:
            self._first = self._last = None
            self._lasts = False
            return
        node = self._node
        if node is None or self._first is None or last is None \
                or not 0 < timed.t_us - last.t_us <= LONGEST_BETWEEN_FIXES_US:
            self._begin(timed)
            return
        between_s = (timed.t_us - last.t_us) / US_PER_S
        self._since_node_m += 0.5 * (fix.speed_mps + (last.fix.speed_mps or 0.0)) * between_s
        is_held = not apart_m(last.fix, fix) and fix.speed_mps < HELD_MPS
        self._was_held |= is_held
        self._last = timed
        if self._lasts:
            self.spans.end_at(timed.t_us)
        by_places_m = apart_m(node.fix, fix) or 0.0
        if max(self._since_node_m, by_places_m) < STEP_M or is_held:
            return
        if not self._was_held:
            self._steps.append((self._since_node_m, by_places_m))
            self._nodes.append(timed)
        self._node, self._since_node_m, self._was_held = timed, 0.0, False
        if len(self._steps) >= FEWEST_STEPS:
            self._compare(self._first, timed)

    def _compare(self, first: TimedFix, timed: TimedFix) -> None:
        """The ways of the stretch so far, without the steps that are longest by the places."""
        steps = sorted(self._steps, key=lambda step: step[1] - step[0])
        too_long = sum(by_places_m - by_speed_m for by_speed_m, by_places_m in steps) > 0
        by_speed_m, by_places_m = (sum(way) for way in zip(*(steps[:-WORST] if too_long else steps), strict=True))
        lasted_us = timed.t_us - first.t_us
        random_m = sqrt(2 * PLACE_M**2 + SPEED_MPS**2 * lasted_us / US_PER_S)
        limit_m = SHARE * max(by_speed_m, by_places_m) + DEVIATIONS * random_m
        # From the first places to the last: the shortest, as one of them may be far off.
        straight_m = min(apart_m(one.fix, other.fix) or 0.0 for one in self._nodes[:2] for other in self._nodes[-2:])
        moves = by_places_m < by_speed_m or straight_m > JUMP_M
        if moves and abs(by_places_m - by_speed_m) > limit_m:
            if not self._lasts:
                self.spans.begin(first.t_us, timed.t_us)
            self._lasts = True
            self._said = (f"its speed and positions disagree: over {lasted_us / US_PER_S:.0f} s the speed makes "
                          f"{by_speed_m:.0f} m, the positions {by_places_m:.0f} m. Such rows have no IRI. Check the "
                          "receiver's settings (static navigation, simulator, the sentences it sends), or replace it")
            self._begin(timed)
            return
        longer_m = max(by_speed_m, by_places_m)
        agrees = abs(by_places_m - by_speed_m) <= SHARE * longer_m + random_m
        if lasted_us >= LONGEST_US or longer_m >= (AGREES_M if self._lasts else LONGEST_M):
            self._lasts = self._lasts and not agrees
            self._begin(timed)

    @property
    def doubt(self) -> str:
        """What is wrong with the receiver, while it lasted until a minute ago; empty: nothing."""
        last_us = self.spans.last_us
        if last_us is None or self._last is None or self._last.t_us - last_us > LASTING_US:
            return ""
        return self._said

    def _begin(self, timed: TimedFix) -> None:
        self._first = self._last = self._node = timed
        self._since_node_m = 0.0
        self._was_held = False
        self._steps = []
        self._nodes = [timed]


class JudgedDrive:
    """When each fix was, how late the receiver is (``alignment``), and what is not believed, by readings and fixes in
    order of time; ``latency_s``: what the receiver's times are taken to be late by [s]."""

    def __init__(self, alignment: DriveAlignment, latency_s: float) -> None:
        self._latency_s = latency_s
        self.alignment = alignment
        self.timebase = Timebase(latency_s)
        self.stillness = Stillness()
        self.repetition = Repetition()
        self.speed_check = SpeedCheck()

    def judge(self, block: AccelerationBlock, fixes: Sequence[Fix]) -> list[TimedFix]:
        """More of both; gives the fixes with their times."""
        timed = []
        for fix in fixes:
            one = self.timebase.place(fix)
            timed.append(one)
            self.speed_check.take(one)
            if fix.valid and fix.speed_mps is not None and self.timebase.unsure_until_us is None:
                self.alignment.take_fix(one.t_us / US_PER_S + self._latency_s, fix.speed_mps)
        self.alignment.take_readings(block.t_us / US_PER_S, block.accel_mps2)
        self.stillness.take(block, fixes)
        self.repetition.take(block)
        return timed

    def doubted(self, t_us: Whole) -> Bools:
        """Tell of instants (n,) [us] whether what was read at them is not believed."""
        return (self.stillness.spans.during(t_us) | self.repetition.spans.during(t_us)
                | self.speed_check.spans.during(t_us))
