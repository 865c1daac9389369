"""The times of samples whose instrument says none, out of the times at which they arrived."""

from itertools import combinations, pairwise
from math import log, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.readings import AccelerationBlock

Floats = npt.NDArray[np.float64]

TIMER_US = 20_000.0  # of adapters: 16 ms, if they are left as they come
STEPS_PER_CYCLE = 8  # of the whole span: a comb between two of the periods tried loses 1 % at most


def sampling_period(instants_us: Floats, count: int, slope_us: float, longest_gap_us: float,
                    lost_most: float) -> float | None:
    """The period [us] of the comb on which the arrivals stand, where it says that samples are lost; else None.

    The problem: samples that are lost at even intervals look like a slower sensor. How many arrived in how much time
    does not distinguish one from the other.

    The solution: what arrives at once does so a multiple of the true period after any other such sample, however many
    are lost between them: the arrivals stand on a comb. Its period is where the periodogram of the instants is largest
    (Schuster 1898), which is the mean resultant length of their phases (Mardia and Jupp 2000, 2.3): 1 where all have
    one phase, 0.9 with a jitter of a quarter of the period, 0.64 with half of it. By chance m phases come to R or more
    with probability exp(-m R^2) (Rayleigh's test).

    instants_us      (m,) arrivals [us], those with the least latency of each piece of time
    count            samples that came from the first of them to the last
    slope_us         arrivals per sample [us]: the period of a sensor that loses nothing
    longest_gap_us   usual time between two of the arrivals [us]
    lost_most        largest share of samples that may be lost
    """
    chance = 1e-6  # of a comb where there is none: tried each 1.28 s, once in 15 days of driving
    # Than the phases by the rate at which samples come; measured: 4 or more with losses, 1.2 at most without.
    clearer = 2.0
    if count < 2 or slope_us <= 0:  # all of them at one moment have no period
        return None
    step_us = slope_us / count / STEPS_PER_CYCLE
    tried = int(slope_us * lost_most / step_us) - STEPS_PER_CYCLE
    shorter = slope_us * (1 - lost_most) + step_us * np.arange(tried, dtype=np.float64)
    if len(shorter) == 0:
        return None
    lengths = resultant(instants_us, shorter)
    best = int(np.argmax(lengths))
    if lengths[best] < sqrt(log(max(1.0, len(shorter) / STEPS_PER_CYCLE) / chance) / len(instants_us)):
        return None
    near = slope_us + step_us * np.arange(-STEPS_PER_CYCLE, STEPS_PER_CYCLE + 1, dtype=np.float64)
    if lengths[best] < clearer * resultant(instants_us, near).max():
        return None
    period_us = float(shorter[best])
    multiples = period_us * np.arange(2, 1 + max(2, int(longest_gap_us / period_us)), dtype=np.float64)
    coarser = max(resultant(instants_us, multiples).max(), _coarsest(instants_us, period_us))
    if coarser >= lengths[best]:
        return None  # the comb of an adapter's timer or of what reads the line: of the sampler's own all teeth are seen
    return period_us


def is_ticked(instants_us: Floats, period_us: float, longest_us: float) -> bool:
    """Tell whether arrivals (m,) [us] stand on the ticks of a timer of nearly a multiple of the samples' period, up to
    ``longest_us``: of the samples themselves all teeth are seen, not every second or third."""
    nearly = 0.008  # a timer farther off drifts by a sample in half a second, which shows in the jitter
    ticked = 0.7  # resultant of arrivals on the ticks of one timer, 1 where all are
    step = 1.0 / (STEPS_PER_CYCLE * (instants_us[-1] - instants_us[0]))
    frequencies = [np.arange((1 - nearly) / multiple_us, (1 + nearly) / multiple_us, step)
                   for multiple_us in period_us * np.arange(2, 1 + longest_us // period_us)]
    tried = np.concatenate([np.empty(0), *frequencies])
    return len(tried) > 0 and float(resultant(instants_us, 1.0 / tried).max()) > ticked


def _coarsest(instants_us: Floats, period_us: float) -> float:
    """How far instants (m,) [us] have one phase in the longer period, up to ``TIMER_US``, where they have it most: of
    an adapter's timer, which samples of another period fill unevenly. By the Fourier transform of their histogram; 0
    where there is no longer period."""
    bin_us = 250.0  # of a period of 1 ms, the shortest, a quarter: the resultant is 10 % low there, 1 % at 3 ms
    next_comb = 1.1  # a period so much longer has, over any length that is looked at, another comb
    bins = np.rint((instants_us - instants_us[0]) / bin_us).astype(np.int64)
    length = 1 << int(STEPS_PER_CYCLE // 2 * (bins[-1] + 1)).bit_length()
    first, end = (int(length * bin_us / us) for us in (TIMER_US, next_comb * period_us))
    if end <= first:
        return 0.0
    lines = np.abs(np.fft.rfft(np.bincount(bins), length)[first:end])
    return float(lines.max()) / len(instants_us)


def resultant(instants_us: Floats, periods_us: Floats) -> Floats:
    """(p,): how far instants (m,) have one phase in each period (p,): from 0, none, to 1, all."""
    phases = (2j * np.pi / periods_us)[:, None] * (instants_us - instants_us[0])[None, :]
    return np.asarray(np.abs(np.exp(phases).mean(axis=1)))


Times = npt.NDArray[np.int64]

NO_TIME = -(2**63)  # Stands for the time of a sample that cannot be dated


class _ClockPoint(NamedTuple):
    """A lowest arrival: how many samples came before it, how many of those lost were noticed, when it came [us]."""

    number: int
    lost: int
    arrival_us: int


class SampleClock:
    """Follows the time line of one device.

    The problem: a line delivers late and in bursts, and it says neither at which rate the samples were taken nor which
    of them were lost on the way. A rate that is taken for another one, or a lost sample that is closed up, makes a
    smooth road rough without any sign of it.

    The solution: a sample arrives a latency after it was taken that is never negative and now and then small. Arrival
    minus index times period is therefore bounded below by the true time line, and the line is the lower envelope. Where
    samples are lost, the envelope makes a step up by whole periods, and stays; where the link only jams, it comes back.

    1. Finding the rate. Samples are held for ``FIND_US`` of arrival time. The slope of their lower envelope is the
       period. A rate that is not that of the profile, to within its tolerance, is taken as it is found; one below
       ``SLOWEST`` of the profile's is refused: so much is not lost without harm. The samples are then not dated.
    2. Settling. Samples are held for ``SETTLE_US`` of arrival time; the line starts at their lower envelope.
    3. Following, in blocks of ``BLOCK_US``. An arrival below the line pulls it down at once: no sample is later than
       its arrival. When all arrivals of a block are above it, the line climbs in the next block by ``GAIN`` of the
       least distance, at most by the tolerance of the clock. The period is the median of the slopes between the lowest
       arrivals of the last ``BLOCKS`` blocks (Theil and Sen: a stalled block or two cannot tilt it), within the
       tolerance of the rate found. One that was kept through all of them and is outside of it is the rate instead.
    4. Losses. A sample is given once the arrivals of ``LOOK_AHEAD_US`` after it are known (a pause in them counts
       ``LASTING_US``, or what came together at its end). Where none of them comes back to within ``STEP_SHARE`` of a
       period of the line, or ``JITTER_US`` where that is more and the arrivals do not show a smaller one, samples were
       lost: the line moves by as many periods and leaves a hole. (A link that is late by 30 ms at random has such a
       second now and then: once in 1,000 samples.) Arrivals that stay more than ``OFF_US`` late, or that come that much
       too early, make the clock start over.
    5. Steadiness. Losses from the start on look like a slower clock. But arrivals of a slow clock lie on a line, and
       those of one that loses samples on the comb of its own period (``drivers.sample_clock``): where they do, in the
       samples of the finding or of the last blocks, that period is taken, by which losses show. Where they lie on
       neither, nor on a line with the losses that were noticed, the profile's own rate is taken; a device of another
       rate is refused until it has kept one through ``STEADY`` findings in a row.
       Losses of a sensor that is faster than the profile's are not dated by the comb: where it shows more of them than
       were noticed, by ``HIDDEN_US`` and more, no sample is dated (as in 6).
    6. Too many losses. Where steps come close together, a place between two is as likely as the true one, and the
       period can no longer be distinguished from the losses. Once there were more than ``STEPS_MAX`` in a
       ``LOOK_AHEAD_US``, on average over the last ``BLOCKS`` blocks, and until there are half as many, the line is
       followed, but no sample is dated.

    Times come out in whole microseconds, strictly increasing (where they must, by 1 us), and do not depend on how
    the arrivals were cut into calls. The smallest latency cannot be known and stays in the times.

    resyncs    times the line was lost and found again
    lost       samples that were noticed to be missing, each by itself or some in a row
    too_many_lost   more than can be located: samples are not dated now
    rates_hz   least and most that the rate was since it was found [Hz]
    """

    FIND_US = 1_200_000
    SETTLE_US = 300_000
    OFF_US = 250_000
    LOOK_AHEAD_US = 1_000_000
    LASTING_US = 100_000
    STEP_SHARE = 0.75
    JITTER_US = 5_000  # of the lower envelope, over a block: what adapters and a waking thread leave of it
    HELD_MAX = 4096
    BLOCK_US = 1_280_000
    BLOCKS = 8
    PIECES = 16  # of a block: of 80 ms, so that between two losses, which are 0.2 s apart or more, lie some of them
    BLOCKS_SEEN, JITTERS, WITHOUT_LOSS = 3, 4.0, 0.75
    SEEN_TOLERANCE = JITTER_US / (BLOCKS * BLOCK_US)  # 490 ppm: a tighter tolerance the arrivals cannot tell
    GAIN = 0.25
    SLOWEST = 0.95
    FASTEST = 10.0
    FIND_ERROR = 0.01
    OTHER_TOLERANCE = 0.02
    STEADY = 4
    # Share of samples lost without being noticed, times the period. Measured on drives at 150 to 400 Hz with 1 in 50 or
    # 2 in 100 lost (50 to 130 us): IRI 0.6 to 4.9 % too high, in proportion; by 1 % where one or two are lost at once.
    HIDDEN_US, HIDDEN_EVERY = 40.0, 4  # looked for every so many blocks: it costs more than all the rest
    STEPS_MAX = 1.5  # measured on drives at 100 Hz: 1 loss a second makes IRI 1 to 2.4 % too high, 1.5 3 %, 3 to 13 %

    def __init__(self, rate_hz: float, tolerance: float) -> None:
        self._nominal_us = 1e6 / rate_hz
        self._nominal_tolerance = max(tolerance, self.SEEN_TOLERANCE)
        self._held: Times = np.empty(0, dtype=np.int64)
        self._last_us = -(2**62)
        self.rates_hz = (rate_hz, rate_hz)
        self._points: list[_ClockPoint] = []
        self._pieces: list[_ClockPoint] = []
        self._number = 0
        self._finding = True
        self._following = False
        self._ended = False
        self._steady_needed = 0
        self._steps = 0
        self._steps_by_block: list[int] = []
        self.too_many_lost = self._hides_losses = False
        self._looked = 0
        self.refused_hz: float | None = None
        self.resyncs = 0
        self.lost = 0
        self._expect(self._nominal_us, self._nominal_tolerance)
        self._begin_block(0.0, self._period_us)

    @property
    def rate_hz(self) -> float:
        """The rate that the samples are dated by [Hz]."""
        return 1e6 / self._found_us

    @property
    def lost_share(self) -> float:
        """Share of the samples of the last blocks that were noticed to be missing."""
        if len(self._points) < 2:
            return 0.0
        first, last = self._points[0], self._points[-1]
        lost = last.lost - first.lost
        return lost / max(1, last.number - first.number + lost)

    def feed(self, arrivals_us: Times) -> Times:
        """Take (n,) arrivals, not decreasing; return the times [us] of the next samples that are certain, (m,)."""
        waiting = np.concatenate((self._held, arrivals_us))
        times = [np.empty(0, dtype=np.int64)]
        while len(waiting):
            count = self._on_line(waiting) if self._following else self._ripe(waiting)
            if count is None:
                continue
            if count == 0:
                break
            accept = self._follow if self._following else self._settle
            times.append(accept(waiting[:count]))
            waiting = waiting[count:]
        self._held = waiting
        return np.concatenate(times)

    def restart(self) -> Times:
        """Samples may be missing from here on: start over. Returns the times of those held so far."""
        self._ended = True
        times = self.feed(np.empty(0, dtype=np.int64))
        self._ended = False
        self._following = False
        return times

    def _ripe(self, waiting: Times) -> int:
        """How many of the first samples are to settle together; 0 when more may belong to them."""
        count = int(np.searchsorted(waiting, waiting[0] + (self.FIND_US if self._finding else self.SETTLE_US)))
        if count == len(waiting) < self.HELD_MAX and not self._ended:
            return 0
        return min(count, self.HELD_MAX)

    def _on_line(self, waiting: Times) -> int | None:
        """How many of the first samples belong to the line; 0: that is open; None: the line was moved or lost."""
        waiting = waiting[: self._block + self.HELD_MAX]
        heard_us = self._heard_us(waiting)
        known = int(np.searchsorted(heard_us, heard_us[-1] - self.LOOK_AHEAD_US, "right"))
        known = max(known, len(waiting) - self.HELD_MAX)
        count = min(len(waiting) if self._ended else known, self._block - self._index)
        if count == 0:
            return 0
        above_us = waiting - self._line(len(waiting)) - self._pulled_us
        early = above_us[:count] < -self.OFF_US
        if early[0]:
            self._lose_line(find=True)
            return None
        near = np.flatnonzero(above_us < self._loss_least_us)
        following = np.searchsorted(near, np.arange(count))
        back = np.append(near, len(waiting) - 1)[following]
        stays_off = (following == len(near)) | (heard_us[back] > heard_us[:count] + self.LOOK_AHEAD_US)
        ends = early | (stays_off & (not self._ended))
        if not ends[0]:
            return int(np.argmax(ends)) if ends.any() else count
        soon, late = (int(np.searchsorted(heard_us, us, "right")) for us in (self.LASTING_US, self.LOOK_AHEAD_US))
        return self._step(above_us, soon, late, count)

    def _heard_us(self, arrivals_us: Times) -> Times:
        """For how long something was heard up to each arrival (n,) [us]. A pause counts for ``LASTING_US``, or for as
        long as the samples that came at its end together were taken in: a device that buffers was not silent. One
        jam counts for half a look ahead at most: its end alone does not show what was late."""
        paused_us = np.diff(arrivals_us)
        first = np.flatnonzero(np.concatenate(([True], paused_us > 0)))
        together = np.diff(np.append(first, len(arrivals_us)))
        counts_us = np.zeros(len(arrivals_us), dtype=np.int64)
        taken_us = np.minimum((together * self._period_us).astype(np.int64), self.LOOK_AHEAD_US // 2)
        counts_us[first] = np.maximum(self.LASTING_US, taken_us)
        counts_us[0] = 0
        return np.cumsum(np.minimum(np.append(0, paused_us), counts_us))

    def _step(self, above_us: npt.NDArray[np.float64], soon: int, late: int, count: int) -> int | None:
        """The first sample and those after it stay above the line. A step that another follows at once did not come
        here: what lies before that one is late by chance, and belongs to the line."""
        least_us, lasting_us = float(above_us[:late].min()), float(above_us[soon:late].min(initial=np.inf))
        before = np.flatnonzero(above_us[:soon] <= lasting_us - self._loss_least_us)
        if len(before) and lasting_us < np.inf:
            return min(int(before[-1]) + 1, count)
        if least_us > self.OFF_US:
            self._lose_line(find=False)
        else:
            missing = max(1, round(least_us / self._period_us))
            self.lost += missing
            self._steps += 1
            self._base_us += missing * self._period_us
        return None

    def _lose_line(self, find: bool) -> None:
        self._following = False
        self._finding |= find
        self.resyncs += 1

    def _line(self, count: int) -> npt.NDArray[np.float64]:
        """The line [us] at the next samples, as it was drawn at the beginning of the block."""
        return self._base_us + self._step_us * np.arange(self._index, self._index + count, dtype=np.float64)

    def _expect(self, period_us: float, tolerance: float) -> None:
        self._found_us = self._period_us = period_us
        self._is_new_rate = True
        self._shortest_us = period_us * (1 - tolerance)
        self._longest_us = period_us * (1 + tolerance)
        self._climb_us_max = period_us * tolerance
        self._step_least_us = self._loss_least_us = max(self.STEP_SHARE * period_us, self.JITTER_US)
        self._block = max(16, round(self.BLOCK_US / period_us))

    def _find(self, arrivals_us: Times) -> None:
        """The rate of samples that came together, or that it is refused."""
        points = self._envelope(arrivals_us)
        if len(points) < 4:
            return
        slope_us, spread_us = _slope(points, with_lost=False)
        nominal_us = self._nominal_us
        is_steady = spread_us <= self._step_least_us
        comb_us = self._comb(points, slope_us)
        if comb_us is not None:
            slope_us, is_steady = comb_us, True
        steady_needed, self._steady_needed = self._steady_needed - is_steady, 0
        self.refused_hz = None
        if abs(slope_us / nominal_us - 1) <= self._nominal_tolerance + self.FIND_ERROR:
            self._expect(nominal_us, self._nominal_tolerance)
            if is_steady:
                self._take_period(slope_us)
        elif nominal_us < slope_us <= nominal_us / self.SLOWEST and not is_steady:
            self._expect(nominal_us, self._nominal_tolerance)
        elif nominal_us / self.FASTEST <= slope_us <= nominal_us / self.SLOWEST and is_steady and steady_needed <= 0:
            self._expect(slope_us, self.OTHER_TOLERANCE)
        else:
            self.refused_hz = 1e6 / slope_us
            self._steady_needed = steady_needed if is_steady and steady_needed > 0 else self.STEADY

    def _comb(self, points: list[_ClockPoint], slope_us: float) -> float | None:
        """The period [us] of a sampler of which samples are lost, where the arrivals show it. (125 Hz with 1 in 25
        lost, and 120 Hz through an adapter with a timer of 8 ms, arrive alike: the rows of both are flagged.)"""
        if not self.SLOWEST * self._nominal_us <= slope_us <= self._nominal_us / self.SLOWEST**2:
            return None  # of a faster sensor with its lines lost at random, all would be found, too many to date any
        period_us = self._sampled_us(points, slope_us)
        return None if period_us is None or period_us > self._nominal_us / self.SLOWEST else period_us

    def _sampled_us(self, points: list[_ClockPoint], slope_us: float) -> float | None:
        """The period [us] by the comb of the arrivals; None where they lie on a line, or show none."""
        above_us = [point.arrival_us - slope_us * point.number for point in points]
        if max(above_us) - min(above_us) < 0.5 * slope_us:  # where a sample is lost, they leave it by a period
            return None
        instants_us = np.array([point.arrival_us for point in points], dtype=np.float64)
        count = points[-1].number - points[0].number
        return sampling_period(instants_us, count, slope_us, self.LASTING_US, 1 - self.SLOWEST)

    def _are_losses_hidden(self, slope_us: float) -> bool:
        """Whether the comb of the arrivals shows that a sensor faster than the profile's loses more samples than were
        noticed: at even intervals they look like a slower clock, on which all arrivals lie. (Of 120 sensors of 105 to
        800 Hz that lost nothing, read directly, none; of 180 through adapters those 9 that were 1 to 5 % slower than
        the ticks of the timer.)"""
        points, slowest_us = self._pieces, self.SLOWEST * self._nominal_us
        if len(points) < self.BLOCKS_SEEN * self.PIECES or not self._nominal_us / self.FASTEST <= slope_us < slowest_us:
            return False
        period_us = self._sampled_us(points, slope_us)
        if period_us is None:
            return False
        first, last = points[0], points[-1]
        hidden = 1 - period_us / slope_us - (last.lost - first.lost) / max(last.number - first.number, 1)
        return hidden * period_us > (self.HIDDEN_US / 2 if self._hides_losses else self.HIDDEN_US)

    def _take_period(self, period_us: float) -> None:
        self._period_us = min(max(period_us, self._shortest_us), self._longest_us)

    def _envelope(self, arrivals_us: Times) -> list[_ClockPoint]:
        """The lowest arrivals of some pieces of time."""
        numbers = np.arange(len(arrivals_us), dtype=np.float64)
        span_us = float(arrivals_us[-1] - arrivals_us[0])
        if len(arrivals_us) < 16 or span_us < 0.5 * self.FIND_US:
            return []
        last = np.flatnonzero(np.append(arrivals_us[1:] > arrivals_us[:-1], True))
        mean_us = (arrivals_us[last[-1]] - arrivals_us[last[0]]) / max(1, last[-1] - last[0])
        above_us = arrivals_us - mean_us * numbers
        piece = ((arrivals_us - arrivals_us[0]) * self.PIECES / (span_us + 1)).astype(np.int64)
        lowest = [np.flatnonzero(piece == k) for k in range(self.PIECES)]
        found = [int(inside[np.argmin(above_us[inside])]) for inside in lowest if len(inside)]
        return [_ClockPoint(number, 0, int(arrivals_us[number])) for number in found]

    def _settle(self, arrivals_us: Times) -> Times:
        """Start a line below all arrivals."""
        if self._finding:
            self._find(arrivals_us)
            if self.refused_hz is not None:
                return np.full(len(arrivals_us), NO_TIME, dtype=np.int64)
            self._finding = False
        run_us = self._period_us * np.arange(len(arrivals_us), dtype=np.float64)
        lowest = int(np.argmin(arrivals_us - run_us))
        start_us = float(arrivals_us[lowest] - run_us[lowest])
        self._points = [_ClockPoint(lowest, self.lost, int(arrivals_us[lowest]))]
        self._pieces = []
        self._number = len(arrivals_us)
        self._following = True
        self._begin_block(start_us + self._period_us * len(arrivals_us), self._period_us)
        return self._dated(start_us + run_us)

    def _begin_block(self, base_us: float, step_us: float) -> None:
        self._base_us = base_us
        self._step_us = step_us
        self._index = 0
        self._pulled_us = 0.0
        self._lowest_of_pieces: dict[int, tuple[float, _ClockPoint]] = {}

    def _follow(self, arrivals_us: Times) -> Times:
        """Times of samples of this block that belong to the line."""
        line_us = self._line(len(arrivals_us))
        above_us = arrivals_us - line_us
        pieces = (self._index + np.arange(len(arrivals_us))) * self.PIECES // self._block
        starts = np.flatnonzero(np.diff(pieces, prepend=-1))
        for first, end in pairwise((*starts.tolist(), len(pieces))):
            lowest = first + int(np.argmin(above_us[first:end]))
            before_us, _ = self._lowest_of_pieces.get(int(pieces[first]), (np.inf, None))
            if above_us[lowest] < before_us:
                point = _ClockPoint(self._number + self._index + lowest, self.lost, int(arrivals_us[lowest]))
                self._lowest_of_pieces[int(pieces[first])] = float(above_us[lowest]), point
        pulled_us: npt.NDArray[np.float64] = np.minimum.accumulate(np.minimum(above_us, self._pulled_us))
        self._pulled_us = float(pulled_us[-1])
        times = self._dated(line_us + pulled_us)
        self._index += len(arrivals_us)
        if self._index == self._block:
            self._next_block()
        return times

    def _next_block(self) -> None:
        least_us, lowest = min(self._lowest_of_pieces.values())
        self._points = [*self._points, lowest][-self.BLOCKS :]
        pieces = [point for _, point in self._lowest_of_pieces.values()]
        self._pieces = [*self._pieces, *pieces][-self.BLOCKS * self.PIECES :]
        self._loss_least_us = max(self.STEP_SHARE * self._found_us, self._seen_jitter_us())
        self._number += self._index
        self._steps_by_block, self._steps = [*self._steps_by_block, self._steps][-self.BLOCKS :], 0
        most = self.STEPS_MAX * self.BLOCKS * self.BLOCK_US / self.LOOK_AHEAD_US
        too_many = sum(self._steps_by_block) > (most / 2 if self.too_many_lost else most)
        if len(self._points) >= 3:
            self._look_at_the_rate()
        self.too_many_lost = too_many or self._hides_losses
        climb_us = min(self.GAIN * max(least_us, 0.0) / self._block, self._climb_us_max)
        self._begin_block(self._base_us + self._step_us * self._index + self._pulled_us, self._period_us + climb_us)

    def _seen_jitter_us(self) -> float:
        """How much the lowest arrivals of neighbouring pieces differ, if not by a loss, with room; what is usual where
        they stand on the comb of an adapter's timer, which drifts against the samples and then leaps as a loss does."""
        if self.STEP_SHARE * self._found_us >= self.JITTER_US or len(self._pieces) < self.BLOCKS_SEEN * self.PIECES:
            return self.JITTER_US
        late_us = [one.arrival_us - self._period_us * (one.number + one.lost) for one in self._pieces]
        seen_us = self.JITTERS * float(np.quantile(np.abs(np.diff(late_us)), self.WITHOUT_LOSS))
        instants_us = np.array([one.arrival_us for one in self._pieces], dtype=np.float64)
        if seen_us >= self.JITTER_US or is_ticked(instants_us, self._period_us, TIMER_US):
            return self.JITTER_US
        return seen_us

    def _look_at_the_rate(self) -> None:
        """Renew the period, and see whether the device keeps it."""
        came_us, came_spread_us = _slope(self._points, with_lost=False)
        slope_us, spread_us = _slope(self._points, with_lost=True)
        if came_us > self._nominal_us / self.SLOWEST:
            self._lose_line(find=True)
        self._looked += 1
        if self._looked % self.HIDDEN_EVERY == 0:
            self._hides_losses = self._are_losses_hidden(came_us)
        comb_us = self._comb(self._pieces, came_us)
        if comb_us is not None:
            if not self._shortest_us <= comb_us <= self._longest_us:
                self._expect(comb_us, self.OTHER_TOLERANCE)
            slope_us = comb_us
        elif came_spread_us <= self._step_least_us:
            slope_us = came_us
            off_us = [point.arrival_us - came_us * point.number for point in self._points]
            is_whole = len(off_us) == self.BLOCKS and max(off_us) - min(off_us) <= self._step_least_us
            is_rate = self._nominal_us / self.FASTEST <= came_us  # as all at one moment is none
            if is_whole and is_rate and not self._shortest_us <= came_us <= self._longest_us:
                self._expect(came_us, self.OTHER_TOLERANCE)
        elif spread_us > self._step_least_us and len(self._points) == self.BLOCKS:
            if self._found_us != self._nominal_us and came_us < self._nominal_us:
                self._steady_needed = self.STEADY
                self._lose_line(find=True)
            elif slope_us > self._nominal_us:
                self._points = []
                self._expect(self._nominal_us, self._nominal_tolerance)
                return
        self._take_period(slope_us)
        if len(self._points) == self.BLOCKS and not any(self._steps_by_block):
            self._note_rate()

    def _note_rate(self) -> None:
        """Widen what is known of the rate by the one of now, or start over with it."""
        rate_hz = 1e6 / self._period_us
        known = (rate_hz,) if self._is_new_rate else (*self.rates_hz, rate_hz)
        self.rates_hz = min(known), max(known)
        self._is_new_rate = False

    def _dated(self, times_us: npt.NDArray[np.float64]) -> Times:
        """Whole microseconds, each at least one later than the one before; none while too many samples are lost."""
        if self.too_many_lost:
            return np.full(len(times_us), NO_TIME, dtype=np.int64)
        steps = np.arange(len(times_us))
        whole = np.floor(times_us).astype(np.int64) - steps
        times: Times = np.maximum.accumulate(np.maximum(whole, self._last_us + 1)) + steps
        self._last_us = int(times[-1])
        return times


def _slope(points: list[_ClockPoint], with_lost: bool) -> tuple[float, float]:
    """Median of the slopes between points [us per sample], and how far the points lie about that line [us]; the latest
    quarter is left out: a link that stalls delays some."""
    counts = [point.number + point.lost * with_lost for point in points]
    slopes = [(b.arrival_us - a.arrival_us) / max(1, last - first)
              for (a, first), (b, last) in combinations(zip(points, counts, strict=True), 2)]
    slope_us = float(np.median(slopes))
    off_us = sorted(point.arrival_us - slope_us * count for point, count in zip(points, counts, strict=True))
    return slope_us, off_us[-1 - len(off_us) // 4] - off_us[0]


WORTH_TELLING = 0.005  # Share of lost samples from which on a person is asked to look for the cause
DRIFT = 0.005
"""Share of its rate through which a clock has to drift to be reported: a quartz clock keeps to a hundredth of that."""

BURSTS_S = 0.2
"""Samples that come so much at a time are kept by something on the way: our own reading makes 0.1 s at most."""

LONGEST_BURSTS_S = 0.45
"""More at a time are late for rows: a sample is dated a second after its arrival and given up 2 s after it was taken
(measured: the oldest of 0.4 s are dated after 1.6 s, of 0.5 s after 2.0 s, of 1 s after 3.0 s)."""

JUDGED_SAMPLES = 500


class UndatedSamples(NamedTuple):
    """Samples without times: arrivals (n,) [us], acceleration (n, 3) [m/s2], clipped (n,), good (n,).

    Problem: where the times of samples are recovered from arrivals (``drivers.sample_clock``), they are known a second
    or so after the samples. Solution: samples are queued here beside the clock, and come out as a block with their
    times.

    after_loss    others may be missing between them and those before
    good          a bad one takes the place of a sample, and is left out in the end
    """

    after_loss: bool
    arrivals_us: npt.NDArray[np.int64]
    accel_mps2: npt.NDArray[np.float64]
    clipped: npt.NDArray[np.bool_]
    good: npt.NDArray[np.bool_]


class DatedSamples:
    """Samples in, blocks with times out. What comes out over time does not depend on when ``take`` is called.

    good, bad    samples so far
    undated      left out because they came at a rate that cannot be used, or too many were lost among them
    burst_s      for so long samples are kept on the way and then come together [s], by the last
                 ``JUDGED_SAMPLES``: twice the middle one's delay, as delays are even from none to that long
    """

    def __init__(self, rate_hz: float, tolerance: float = SampleClock.OTHER_TOLERANCE) -> None:
        self.clock = SampleClock(rate_hz, tolerance)
        self._rate_hz = rate_hz
        self._tolerance = tolerance
        self._waiting: list[UndatedSamples] = []
        self._times: list[npt.NDArray[np.int64]] = []
        self._ended = False
        self.good = 0
        self.bad = 0
        self.undated = 0
        self.burst_s = 0.0
        self._late_us = np.empty(0, dtype=np.int64)

    def add(self, samples: UndatedSamples) -> None:
        if samples.after_loss:
            self._times.append(self.clock.restart())
        self._times.append(self.clock.feed(samples.arrivals_us))
        self._waiting.append(samples)
        good = int(samples.good.sum())
        self.good += good
        self.bad += len(samples.good) - good

    def flush(self) -> None:
        """No more will come: the next ``take`` gives all."""
        self._ended = True

    def take(self) -> AccelerationBlock:
        """The oldest samples, as far as their times are certain; may be none."""
        if self._ended:
            self._times.append(self.clock.restart())
        t_us = np.concatenate([np.empty(0, dtype=np.int64), *self._times])
        self._times = []
        if len(t_us) == 0:
            return AccelerationBlock(t_us, np.empty((0, 3)), np.empty(0, dtype=np.bool_))
        _, arrivals, accels, clips, goods = zip(*self._waiting, strict=True)
        arrivals_us, accel_mps2, clipped, good = (np.concatenate(part) for part in (arrivals, accels, clips, goods))
        n = len(t_us)
        self._waiting = [UndatedSamples(False, arrivals_us[n:], accel_mps2[n:], clipped[n:], good[n:])]
        dated = t_us != NO_TIME
        self.undated += int(np.count_nonzero(~dated))
        self._late_us = np.concatenate([self._late_us, (arrivals_us[:n] - t_us)[dated]])
        if len(self._late_us) >= JUDGED_SAMPLES:
            self.burst_s = 2e-6 * float(np.median(self._late_us))
            self._late_us = self._late_us[:0]
        keep = good[:n] & dated
        return AccelerationBlock(t_us[keep], accel_mps2[:n][keep], clipped[:n][keep], self.clock.rate_hz)

    @property
    def counts(self) -> dict[str, int]:
        """What came in so far, and what is missing in it."""
        return {"samples": self.good, "lost": self.clock.lost, "resyncs": self.clock.resyncs, "undated": self.undated}

    def doubt(self, check: str) -> str:
        """What is wrong with the samples that come, and what to ``check``; empty: nothing."""
        if self.clock.refused_hz is not None:
            return (f"it gives about {self.clock.refused_hz:.0f} samples a second, too few or too unevenly (some may "
                    f"be lost); ridelog expects {self._rate_hz:g} and makes no rows from them. {check}")
        if self.clock.too_many_lost:
            return f"so many samples are lost that ridelog cannot locate them, and makes no rows from the rest. {check}"
        if self.clock.lost_share >= WORTH_TELLING:
            return f"{100 * self.clock.lost_share:.1f} of 100 samples are lost, and their rows flagged gap. {check}"
        if self.burst_s < LONGEST_BURSTS_S:
            return ""
        return (f"its samples come {self.burst_s:.1g} s at a time, because something on the way buffers them: too "
                "late for rows, which stay empty. Have the sensor, or its bridge, send each sample at once, or at "
                "least three times a second")

    @property
    def note(self) -> str:
        """How the samples come, where that is worth knowing and does no harm; empty: as they should."""
        slow_hz, fast_hz = self.clock.rates_hz
        if fast_hz - slow_hz > DRIFT * fast_hz:
            return (f"its clock drifts: {slow_hz:.1f} to {fast_hz:.1f} samples a second so far. ridelog dates its "
                    "samples by their arrival: nothing needs to be done")
        if abs(slow_hz / self._rate_hz - 1) > self._tolerance:
            return (f"it gives {slow_hz:.1f} samples a second where {self._rate_hz:g} are expected, and ridelog "
                    "uses that rate. If the sensor's own rate is another one, samples are lost on the way")
        if BURSTS_S <= self.burst_s < LONGEST_BURSTS_S:
            return (f"its samples come {self.burst_s:.1g} s at a time, because something on the way buffers them. "
                    "ridelog timestamps them at their steady rate: nothing needs to be done")
        return ""
