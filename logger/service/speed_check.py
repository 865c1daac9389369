"""A receiver whose speed and places say different things.

Problem: the road's roughness is read by the speed, and a receiver may give a wrong one: none at all while it holds its
speed back at low signal, twice the true one in another unit, that of a simulator. Nothing in a fix shows it. Solution:
the places give the speed too. A stretch of fixes is cut into steps of ``STEP_M``; the way by the speed is held against
the sum of the steps by the places.

How far they may differ follows from the errors of receivers that are well. Those of places last, so that along a road
they cancel but for the first and the last of them (``PLACE_M`` each); the speed's noise (``SPEED_MPS``, each fix by
itself) adds up as the root of time, and both may be a few per cent off (``SHARE``: the scale of a speed, and chords
that cut corners). The limit is ``DEVIATIONS`` of the random part more than the share, and so it falls in proportion as
the stretch grows. Where the places make more, the ``WORST`` steps are left out: a single place far off makes two, a
place that is put right after a tunnel makes one; neither makes a way shorter. Steps in which places were held while the
car crept do not count.

On simulated drives through a town half or twice the speed is found after 12 to 17 s of driving, 0.8 of it after 42 s,
1.2 times after 68 s (medians); in 10 h with a good receiver none is doubted (``tests/benchmarks/speed_check.py``).

A stretch in which they disagree is doubtful, and so is what follows until they have been seen to agree.
"""

from __future__ import annotations

from math import sqrt

from logger.geodesy import ground_distance_m
from logger.service.doubted_spans import DoubtedSpans
from logger.service.timebase import TimedFix
from logger.units import US_PER_S

STEP_M = 25.0  # of either way: a chord of it over a curve of 25 m radius is 4 % short
SHARE = 0.08  # a speed that is 4 % off, and chords that are 4 % short
PLACE_M = 8.0  # between 4 m in the open and 15 m among houses, as the town drives of the bench have them
SPEED_MPS = 0.1  # usual of receivers, each fix by itself
DEVIATIONS = 5.0  # 4 raise no false alarm in 10 h of town either: a margin of one
WORST = 2
FEWEST_STEPS = 5
JUMP_M = 100.0  # among houses the places of a standing car move by some tens of metres
HELD_MPS = 2.0  # receivers that hold their places do so at walking pace
LONGEST_US = 180 * US_PER_S
LONGEST_M = 1500.0
AGREES_M = 100.0
LONGEST_BETWEEN_FIXES_US = 3 * US_PER_S
LASTING_US = 60 * US_PER_S


class SpeedCheck:
    """Follows fixes in order of time. ``spans`` are the stretches that are doubtful."""

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
        is_held = _apart_m(last, timed) == 0.0 and fix.speed_mps < HELD_MPS
        self._was_held |= is_held
        self._last = timed
        if self._lasts:
            self.spans.end_at(timed.t_us)
        by_places_m = _apart_m(node, timed)
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
        moves = by_places_m < by_speed_m or self._straight_m() > JUMP_M
        if moves and abs(by_places_m - by_speed_m) > limit_m:
            if not self._lasts:
                self.spans.begin(first.t_us, timed.t_us)
            self._lasts = True
            self._said = (f"its speed and its places disagree: over {lasted_us / US_PER_S:.0f} s the speed makes "
                          f"{by_speed_m:.0f} m, the places {by_places_m:.0f} m. Such rows have no IRI. Check what the "
                          "receiver is set to (static navigation, simulator, the sentences it sends), or replace it")
            self._begin(timed)
            return
        longer_m = max(by_speed_m, by_places_m)
        agrees = abs(by_places_m - by_speed_m) <= SHARE * longer_m + random_m
        if lasted_us >= LONGEST_US or longer_m >= (AGREES_M if self._lasts else LONGEST_M):
            self._lasts = self._lasts and not agrees
            self._begin(timed)

    def _straight_m(self) -> float:
        """From the first places to the last: the shortest, as one of them may be far off."""
        return min(_apart_m(one, other) for one in self._nodes[:2] for other in self._nodes[-2:])

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


def _apart_m(one: TimedFix, other: TimedFix) -> float:
    a, b = one.fix, other.fix
    if a.lat_deg is None or a.lon_deg is None or b.lat_deg is None or b.lon_deg is None:
        return 0.0
    return ground_distance_m(a.lat_deg, a.lon_deg, b.lat_deg, b.lon_deg)
