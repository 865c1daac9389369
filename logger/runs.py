"""One drive over one road, as fits, the lab and identification read it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property

import numpy as np

from logger.arrays import Array, Bools
from logger.bounds import EVEN_SAMPLES
from logger.dsp.whole_record import in_band
from logger.left_out import LeftOut, counting
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track

NO_READING, READING, CLIPPED = 0.0, 1.0, 2.0
"""What a sample may be: none, a reading, or one that only says that there was at least as much."""
BY_ROAD, BY_RECEIVER = "road", "receiver"
"""By what the places of a run were found (``RecordFacts.places_by``)."""
SKIP_S = 2.0
"""How much of the beginning of a run is left out of fits and errors, as the car's past is not known [s]."""
LEAST_S = 5.0
"""A shorter run is of no use to the lab: the body bounces some three times after ``SKIP_S`` [s]."""
RECEIVER_ERROR_LASTS_S = 60.0
"""Correlation time of the errors of a receiver's places (a judgement: the ionosphere's is longer, reflections'
shorter)."""

SLOWEST_MPS = 0.5
"""A car that is slower stands: a length over its speed says nothing."""
LATE_WITHIN_S = 0.3
"""How late the road is felt is looked for so far from window to window: above what receivers are late by, below half a
bounce of a body."""
_FIRST_RISES, _AT_REST = 5, 0.1
"""So many rises from sample to sample are a beginning; at rest they are less than a tenth of the usual (judgements)."""

_UNITS = {"acceleration": "m/s2", "velocity": "m/s", "displacement": "m", "travel": "m", "force": "N",
          "pitch_rate": "rad/s", "roll_rate": "rad/s"}


@dataclass(frozen=True)
class Signal:
    """A measured signal other than the acceleration of the sensor.

    name              of its column, which ends in its unit
    measures          ``acceleration`` [m/s2], ``velocity`` [m/s] or ``displacement`` (height over the ground) [m] of
                      body or wheel, ``force`` (that a component pulls back with) [N], ``travel`` (extension of a
                      suspension, or height over a base) [m], ``pitch_rate``
                      (nose up) or ``roll_rate`` (left side up) [rad/s]
    of                the part that is measured: ``body``, ``front_wheel``, ``rear_suspension`` ...
    ahead_m, left_m   where on the body, from the centre of gravity [m]
    kind              of the sensor, as far as it matters what can be wrong with it: ``encoder``; None: it is not known
    """

    name: str
    measures: str
    of: str = "body"
    ahead_m: float = 0.0
    left_m: float = 0.0
    kind: str | None = None

    @property
    def unit(self) -> str:
        """Its unit."""
        return _UNITS[self.measures]

    @property
    def may_drift(self) -> bool:
        """Whether its sensor's zero wanders by as much as what it measures where that is slow: of accelerations and
        turning rates it does."""
        return self.measures not in ("velocity", "displacement", "travel", "force")

    @property
    def never_repeats(self) -> bool:
        """Whether equal samples are one that was written twice: noise makes an acceleration another one each time, a
        place may stay what it is."""
        return self.measures == "acceleration" and self.kind != ENCODER


ENCODER = "encoder"
"""The kind of a sensor that counts: it has no gain, no filter and no bracket of its own."""
SENSOR = "accel_z_mps2"
"""The column of the sensor's acceleration."""
ACCELERATION = Signal(SENSOR, "acceleration")
"""What a run measures first, unless it says something else."""


@dataclass(frozen=True)
class RecordFacts:
    """What is known of a record; None: it is not.

    step_mps2, range_mps2    what readings are rounded to, and the greatest there can be [m/s2]
    noise_mps2               r.m.s. of the sensor's noise, before rounding [m/s2]
    place_std_m              standard error of a place on the profile [m]
    delay_s, delay_std_s     of the receiver, and its standard error; taken out [s]
    speed_scale, speed_scale_std    of its speeds over those on the profile, and its standard error; taken out
    taken_hz                 samples a second that the recorder took, where they were laid on other times [Hz]
    pass_band_hz             frequencies, the lowest and the highest, between which the record is to be believed [Hz]
    places_by                ``BY_ROAD`` where places were found by the road as this vehicle's model feels it, or
                             ``BY_RECEIVER``
    vehicle                  that vehicle
    source                   the name of the file that it was made of
    signals                  what more was measured
    main                     what the run measures first, in its own unit where it is no acceleration
    """

    step_mps2: float | None = None
    range_mps2: float | None = None
    noise_mps2: float | None = None
    place_std_m: float | None = None
    delay_s: float | None = None
    delay_std_s: float | None = None
    speed_scale: float | None = None
    speed_scale_std: float | None = None
    taken_hz: float | None = None
    pass_band_hz: tuple[float, float] | None = None
    places_by: str | None = None
    vehicle: str | None = None
    source: str | None = None
    signals: tuple[Signal, ...] = ()
    main: Signal = ACCELERATION

    @property
    def seen_to_hz(self) -> float | None:
        """What lies above was not recorded [Hz]; None: nothing is said of it."""
        ends_hz = [] if self.pass_band_hz is None else [self.pass_band_hz[1]]
        return self.taken_hz / 2 if self.taken_hz is not None else min(ends_hz, default=None)

    @property
    def late_std_s(self) -> float | None:
        """Standard deviation of a delay that all places have in common [s]; None: they have none. A receiver's places
        have its own. Those that were found by the road took with them whatever made it be felt late, the phase of a
        model that is not right as well as a clock: any time within reach, one as likely as the other."""
        if self.places_by == BY_ROAD:
            return LATE_WITHIN_S / float(np.sqrt(3))
        return self.delay_std_s or None if self.places_by == BY_RECEIVER else None


UNKNOWN = RecordFacts()
"""Nothing is known of the record."""


@dataclass(frozen=True)
class LowPass:
    """A low-pass that a record seems to have gone through.

    cutoff_hz, order    of Butterworth's filter that is likest
    causal              it delayed the record; else it was run forth and back
    ends_band           the pass band ends where it begins
    """

    cutoff_hz: float
    order: float
    causal: bool = False
    ends_band: bool = False


@dataclass(frozen=True, eq=False)
class Run:
    """One drive over one road, or one time on a rig, evenly sampled: arrays (n,).

    name             as the user knows it
    rate_hz          samples a second
    measured_mps2    the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]; of a run whose facts
                     say that it measures something else first that, places without their mean
    distance_m       where the front tires stood on the track, as it was recorded [m]; on a rig 0
    speed_mps        [m/s]; on a rig 0
    track            the road, or what drives the rig
    skip_s           how much of the beginning is left out [s]
    facts            what is known of the record
    usable           what each sample is (``NO_READING``, ``READING``, ``CLIPPED``); None: all are readings
    more             (s, n) what the signals of ``facts`` measured, without their means, as their zeros are not known
    low_pass         what was found of it; None: nothing
    outside_mps2     r.m.s. of what a model and the sensor differ by outside of the pass band [m/s2]
    left_out         what of its drive is in no run, told of one run of a drive, or is no reading
    thinned_by       how many samples there were for each one

    ValueError for columns of different lengths, or fewer than two samples after the beginning.
    """

    name: str
    rate_hz: float
    measured_mps2: Array
    distance_m: Array
    speed_mps: Array
    track: Track | Excitation
    skip_s: float = SKIP_S
    facts: RecordFacts = UNKNOWN
    usable: Array | None = None
    more: Array = field(default_factory=lambda: np.empty((0, 0)))
    low_pass: LowPass | None = None
    outside_mps2: float = 0.0
    left_out: tuple[LeftOut, ...] = ()
    thinned_by: int = 1

    @property
    def of_bench(self) -> int:
        """Samples that a bench took of a part's force for each one of the run; 0: it is of no part on a bench."""
        return self.thinned_by if self.past is Past.OF_PART else 0

    def __post_init__(self) -> None:
        if len(self.more) != len(self.signals) or any(len(one) != self.count for one in self.more):
            raise ValueError(f"{self.name}: expected samples of each of {len(self.signals)} signals")
        if not len(self.measured_mps2) == len(self.distance_m) == len(self.speed_mps) > self.first + 1:
            raise ValueError(f"{self.name}: expected columns of one length, longer than {self.skip_s:g} s")

    @property
    def first(self) -> int:
        """The first sample that is not left out."""
        return int(np.ceil(self.skip_s * self.rate_hz - EVEN_SAMPLES))

    @property
    def count(self) -> int:
        """How many samples there are."""
        return len(self.measured_mps2)

    @property
    def time_s(self) -> Array:
        """When the samples were taken, the first at 0 [s]."""
        return np.arange(self.count) / self.rate_hz

    @property
    def kept_mps2(self) -> Array:
        """What was measured, without the beginning [m/s2]."""
        return self.measured_mps2[self.first:]

    @property
    def kept_readings_mps2(self) -> Array:
        """The same, zeros where nothing was read [m/s2]."""
        return (self.measured_mps2 * self.read)[self.first:]

    @property
    def read(self) -> Bools:
        """Of which samples (n,) something was read."""
        return np.ones(self.count, bool) if self.usable is None else np.asarray(self.usable != NO_READING)

    def part(self, samples: slice) -> "Run":
        """Some of its samples, of which more than the beginning has to be left."""
        return replace(self, measured_mps2=self.measured_mps2[samples], distance_m=self.distance_m[samples],
                       speed_mps=self.speed_mps[samples], more=self.more[:, samples],
                       usable=None if self.usable is None else self.usable[samples])

    def residual(self, prediction: Array, measured_mps2: Array | None = None) -> Array:
        """Measured minus predicted (n,), or of more signals joined to it [m/s2]; with ``measured_mps2`` (n,), of these
        readings in place of the sensor's. It is 0 where nothing was read, and of a clipped reading what the prediction
        falls short of it by; a zero that is not known is then what makes the others' mean 0, as that of the record is
        another one."""
        main, whole = self.main(prediction), self.counted[: self.count]
        if self.usable is not None:
            whole &= self.usable == READING
            if not zero_is_known(self.facts.main, self.track):
                main = main + (self.measured_mps2 - main) @ whole / max(1, whole.sum())
        residual = (self.measured_mps2 if measured_mps2 is None else measured_mps2) - main
        if self.usable is not None:
            way = np.sign(self.measured_mps2 - self.measured_mps2.mean())  # ends of a range lie on either side
            short = way * (self.measured_mps2 - main) - 0.5 * (self.facts.step_mps2 or 0.0)  # it may be rounded up
            residual = np.where(self.usable == CLIPPED, way * np.maximum(short, 0.0),
                                np.where(self.read, residual, 0.0))
        if len(main) == len(prediction):
            return residual
        others = self.more - prediction[self.count :].reshape(-1, self.count)
        if self.usable is not None:
            others = (others - others @ whole[:, None] / max(1, whole.sum())) * self.read
        return np.concatenate([residual, others.ravel()])

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The measured signals other than the acceleration of the sensor."""
        return self.facts.signals

    def main(self, joined: Array) -> Array:
        """The part (n,) of the sensor's acceleration of signals that are joined ((1 + s) n,)."""
        return joined[: self.count]

    @property
    def counted(self) -> Bools:
        """Which of the samples that are joined ((1 + s) n,) are not left out."""
        return np.tile(np.arange(self.count) >= self.first, 1 + len(self.signals))

    @property
    def pass_band_hz(self) -> tuple[float, float]:
        """Frequencies between which the record is compared; up to half the rate where nothing is known [Hz]."""
        low_hz, high_hz = self.facts.pass_band_hz or (0.0, self.rate_hz / 2)
        return low_hz, min(high_hz, self.rate_hz / 2)

    @property
    def share_passed(self) -> float:
        """Of the power of white noise, what the pass band leaves."""
        low_hz, high_hz = self.pass_band_hz
        return (high_hz - low_hz) / (0.5 * self.rate_hz)

    def in_band(self, samples: Array) -> Array:
        """Samples like the sensor's (n,), or more signals joined to them, which have no such band: without what lies
        outside of the pass band; as they are where there is none."""
        if self.facts.pass_band_hz is None:
            return samples
        found = in_band(self.main(samples), self.rate_hz, *self.pass_band_hz)
        return np.concatenate([found, samples[self.count :]]) if len(samples) > self.count else found

    @property
    def two_tracks(self) -> bool:
        """Whether the road is known under the right wheels too."""
        return self.track.two_tracks

    @property
    def pushed(self) -> bool:
        """Whether measured forces drive it."""
        return bool(self.track.acts_on)

    @property
    def timed(self) -> bool:
        """Whether it is driven by time: a rig, with no road, no speed and no distance."""
        return self.track.timed

    @property
    def past(self) -> "Past":
        """What nobody recorded of it."""
        return past_of(self.track)

    @cached_property
    def begins_in_motion(self) -> bool:
        """Whether it is a rig's that does not begin at rest: from its first samples on it moves as it does later. So
        does one that is shaken hard from there on."""
        if not self.timed:
            return False
        rises = np.diff(np.stack([self.measured_mps2, *self.more]))
        return bool((rises[:, :_FIRST_RISES].std(axis=1) > _AT_REST * rises.std(axis=1)).any())

    @property
    def at_rest(self) -> bool:
        """Whether what the rig stands on rests, so that forces alone drive it."""
        return isinstance(self.track, Excitation) and not np.ptp(self.track.elevation_m)


def are_on_rig(runs: Sequence[Run]) -> bool:
    """Whether all runs are driven by time."""
    return all(run.timed for run in runs)


class Past(Enum):
    """What was before a run's first sample, and by its value how much of the run's beginning is left out for it [s].

    DRIVEN     a road or a rig moved the car, whose state at the first sample fades away, or is found with the rest
    OF_PART    a bench moved the ends of a part: it remembers no more than a damper on its mount does (2 kN s/m on
               2e5 N/m: 10 ms; a judgement), and what its laws remember is found with the rest
    FREE       nothing drives it from there on: the state in which it begins is found with the rest
    """

    DRIVEN = SKIP_S
    OF_PART = 0.1
    FREE = 0.0


def past_of(track: Track | Excitation | None) -> Past:
    """The past of a run over this road, or on this rig."""
    if not isinstance(track, Excitation):
        return Past.DRIVEN
    return Past.OF_PART if track.moves_part else Past.FREE if track.is_still else Past.DRIVEN


def zero_is_known(main: Signal, track: Track | Excitation | None) -> bool:
    """Whether what a run's main signal reads at rest is known: of places it is not, nor on a rig of accelerations, as
    the zero of their sensor has nothing to do with what stands on springs or is let go."""
    on_rig = isinstance(track, Excitation) and main.measures == "acceleration"
    return main.measures not in ("displacement", "travel") and not on_rig


def normalised_rms_error(runs: Sequence[Run], predictions: Sequence[Array]) -> float:
    """rms(measured - model) / rms(measured) over all samples that are not left out; predictions (n,) per run, whole, or
    ((1 + s) n,), of which the sensor's acceleration counts. A clipped reading counts as far as the model falls short
    of it.

    NaN where nothing but zeros was measured."""
    pairs = zip(runs, predictions, strict=True)
    return normalised_rms([run.residual(run.main(one))[run.first:] for run, one in pairs],
                          [run.kept_readings_mps2 for run in runs])


def normalised_rms(residuals: Sequence[Array], measured: Sequence[Array]) -> float:
    """rms(residuals) / rms(measured) over all samples of arrays (n,); NaN where nothing but zeros was measured."""
    left, whole = (sum(float((part**2).sum()) for part in parts) for parts in (residuals, measured))
    return float(np.sqrt(left / whole)) if whole > 0 else float("nan")


def runs_left_out(runs: Sequence[Run]) -> tuple[LeftOut, ...]:
    """What of the drives that these runs are of is compared with nothing."""
    return counting((*(one for run in runs for one in run.left_out),
                     LeftOut(sum(run.first / run.rate_hz for run in runs), "s",
                             "at the beginning of runs, as the motion before is unknown")))


def no_readings(usable: Array | None) -> tuple[LeftOut, ...]:
    """What of samples (n,) is no reading, by what they are, as in ``Run``."""
    return () if usable is None else (
        LeftOut(float(np.count_nonzero(usable == NO_READING)), "sample", "without a reading"),
        LeftOut(float(np.count_nonzero(usable == CLIPPED)), "sample",
                "at an end of the sensor's range, except as bounds"))


def short_names(runs: Sequence[Run]) -> dict[str, str]:
    """What to call runs in a sentence, by name: the last folder of each, or all of the name where those are alike."""
    return shortened([run.name for run in runs])


def shortened(names: Sequence[str]) -> dict[str, str]:
    """The same of their names."""
    last = {name: name.rstrip("/").rpartition("/")[2] for name in names}
    return last if len(set(last.values())) == len(names) else {name: name for name in names}
