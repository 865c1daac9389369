"""One drive over one road, as fits, the lab and identification read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.dsp.pass_band import in_band
from logger.profiles.track import Track

Array = npt.NDArray[np.float64]

SKIP_S = 2.0
"""How much of the beginning of a run is left out of fits and errors, as the car's past is not known [s]."""
_EVEN = 1e-3


@dataclass(frozen=True)
class RecordFacts:
    """What is known of a record; None: it is not.

    step_mps2, range_mps2    what readings are rounded to, and the greatest there can be [m/s2]
    noise_mps2               r.m.s. of the sensor's noise, before rounding [m/s2]
    place_std_m              standard error of a place on the profile [m]
    delay_s, delay_std_s     of the receiver, and its standard error; taken out [s]
    pass_band_hz             frequencies, the lowest and the highest, between which the record is to be believed [Hz]
    places_by                "road": places were found by the road as this vehicle's model feels it; "receiver"
    vehicle                  that vehicle
    source                   the name of the file that it was made of
    """

    step_mps2: float | None = None
    range_mps2: float | None = None
    noise_mps2: float | None = None
    place_std_m: float | None = None
    delay_s: float | None = None
    delay_std_s: float | None = None
    pass_band_hz: tuple[float, float] | None = None
    places_by: str | None = None
    vehicle: str | None = None
    source: str | None = None


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
    """One drive over one road, evenly sampled: arrays (n,).

    name             as the user knows it
    rate_hz          samples a second
    measured_mps2    the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]
    distance_m       where the front tires stood on the track, as it was recorded [m]
    speed_mps        [m/s]
    track            the road
    skip_s           how much of the beginning is left out [s]
    facts            what is known of the record
    low_pass         what was found of it; None: nothing

    ValueError for columns of different lengths, or fewer than two samples after the beginning.
    """

    name: str
    rate_hz: float
    measured_mps2: Array
    distance_m: Array
    speed_mps: Array
    track: Track
    skip_s: float = SKIP_S
    facts: RecordFacts = UNKNOWN
    low_pass: LowPass | None = None

    def __post_init__(self) -> None:
        if not len(self.measured_mps2) == len(self.distance_m) == len(self.speed_mps) > self.first + 1:
            raise ValueError(f"{self.name}: expected columns of one length, longer than {self.skip_s:g} s")

    @property
    def first(self) -> int:
        """The first sample that is not left out."""
        return int(np.ceil(self.skip_s * self.rate_hz - _EVEN))

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
    def pass_band_hz(self) -> tuple[float, float]:
        """Frequencies between which the record is compared; up to half the rate where nothing is known [Hz]."""
        low_hz, high_hz = self.facts.pass_band_hz or (0.0, self.rate_hz / 2)
        return low_hz, min(high_hz, self.rate_hz / 2)

    def in_band(self, samples: Array) -> Array:
        """Samples like the record's (n,) without what lies outside of the pass band; as they are where there is none.
        """
        return samples if self.facts.pass_band_hz is None else in_band(samples, self.rate_hz, *self.pass_band_hz)

    @property
    def two_tracks(self) -> bool:
        """Whether the road is known under the right wheels too."""
        return self.track.elevation_m.ndim == 2


def normalised_rms_error(runs: Sequence[Run], predictions: Sequence[Array]) -> float:
    """rms(measured - model) / rms(measured) over all samples that are not left out; predictions (n,) per run, whole.

    NaN where nothing but zeros was measured."""
    return normalised_rms([run.kept_mps2 - one[run.first:] for run, one in zip(runs, predictions, strict=True)],
                          [run.kept_mps2 for run in runs])


def normalised_rms(residuals: Sequence[Array], measured: Sequence[Array]) -> float:
    """rms(residuals) / rms(measured) over all samples of arrays (n,); NaN where nothing but zeros was measured."""
    left, whole = (sum(float((part**2).sum()) for part in parts) for parts in (residuals, measured))
    return float(np.sqrt(left / whole)) if whole > 0 else float("nan")


def short_names(runs: Sequence[Run]) -> dict[str, str]:
    """What to call runs in a sentence, by name: the last folder of each, or all of the name where those are alike."""
    last = {run.name: run.name.rstrip("/").rpartition("/")[2] for run in runs}
    return last if len(set(last.values())) == len(runs) else {run.name: run.name for run in runs}
