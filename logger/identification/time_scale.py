"""Where a fit of a rig begins whose springs nobody knows.

Problem: the rig may swing at 0.05 Hz or at 500 Hz. A fit that begins with the modes of a car does not get there: the
response of one resonance says nothing about another far from it. Solution: one factor makes all modes so much quicker,
that on the springs squared and on the dampers, at the same masses (dimensional analysis). It is tried over all modes
that the records can show, with a second factor on all dampers, and then one on each spring and damper; the fit begins
where the response of the linear model is likest to the records, whatever their size. Where forces drove it and none of
its masses is known either, the size is that of the records. What was only let go is taken to ring at its slowest mode.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Complex
from logger.runs import Past, Run
from logger.simulation.virtual_drive import output_of
from logger.vehicle.compose import compose
from logger.vehicle.linear_car import frequency_response
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.named_parameters import changed, read, sized
from logger.vehicle.simulate import Passage
from logger.vehicle.structure import pushed
from logger.vehicle.vehicle import Vehicle

_DAMPED = (1.0, 0.1)  # times a car's damping ratio of 0.4: that of a shock absorber, and that of a joint or a rubber
# A resonance with the lower of these damping ratios, z = 0.04, is 2 z of its frequency wide.
_QUICKER = 1.06
_EACH, _ROUNDS = 25, 2  # so many such steps of each spring, a factor of 18 either way, and times that each is tried
_PERIODS = 3.0  # of the slowest mode in a record
_PART_S = 25.0


def at_time_scale(vehicle: Vehicle, unknown: Collection[str], runs: Sequence[Run]) -> Vehicle:
    """The vehicle with those of its numbers that are ``unknown`` where its linear model is likest to what runs of a rig
    recorded. The same vehicle where no spring is unknown.

    unknown    names of numbers, as ``named_parameters`` has them
    """
    springs = [name for name in unknown if name.endswith("stiffness_n_per_m")]
    dampers = [name for name in unknown if name.endswith("damping_n_s_per_m")]
    driven = [run for run in runs if run.timed and run.past is not Past.FREE]
    modes_hz = undamped_frequencies_hz(structure_of(vehicle))
    if not springs or not modes_hz.any():
        return vehicle
    first_hz = float(modes_hz[modes_hz > 0].min())

    def quickened(quicker: float, damped: float) -> Vehicle:
        return changed(vehicle, {name: quicker**2 * read(vehicle, name) for name in springs}
                       | {name: damped * quicker * read(vehicle, name) for name in dampers})

    if rings_hz := ringing_hz(runs):
        return quickened(float(np.median(rings_hz)) / first_hz, min(_DAMPED))
    records = [_Spectra.of(run, vehicle) for run in driven]
    slowest_hz = _PERIODS / max(run.count / run.rate_hz for run in driven)
    quickest_hz = min(run.rate_hz for run in driven) / 2
    count = int(np.ceil(np.log(quickest_hz / slowest_hz) / np.log(_QUICKER))) + 1
    cars = [quickened(quicker, damped) for quicker in np.geomspace(slowest_hz, quickest_hz, count) / first_hz
            for damped in (_DAMPED if dampers else (1.0,))]

    def likeness(one: Vehicle) -> float:
        return sum(record.likeness(one) for record in records)

    likenesses = [*map(likeness, cars)]
    if not max(likenesses) > 0:
        return vehicle
    best = cars[int(np.argmax(likenesses))]
    shares = np.exp(np.arange(-_EACH, _EACH + 1) * 2 * np.log(_QUICKER))
    for name in [*springs, *dampers] * (_ROUNDS if len(springs) > 1 else 0):
        best = max((changed(best, {name: share * read(best, name)}) for share in shares), key=likeness)
    sizes = [name for name in sized(vehicle) if name.endswith(("kg", "kg_m2", "n_per_m", "n_s_per_m"))]
    if not set(sizes) <= set(unknown) or not all(run.track.acts_on for run in driven):
        return best
    heavier = np.exp(-np.mean([np.log(record.gain(best)) for record in records]))
    return changed(best, {name: heavier * read(best, name) for name in sizes})


def ringing_hz(runs: Sequence[Run]) -> list[float]:
    """The strongest frequency of what each run did after it was let go, above drifts; none where something drove one.
    """
    found = []
    for run in runs if all(one.past is Past.FREE for one in runs) else ():
        read_ = run.kept_mps2 - run.kept_mps2.mean()
        count = 2**(len(read_) - 1).bit_length() * 8  # lines closer than a lightly damped mode is wide
        hz = np.fft.rfftfreq(count, 1 / run.rate_hz)
        drifts = hz < _PERIODS * run.rate_hz / len(read_)
        found.append(float(hz[np.argmax(np.abs(np.fft.rfft(read_ * np.hanning(len(read_)), count)) * ~drifts)]))
    return found


@dataclass(frozen=True, eq=False)
class _Spectra:
    """What drives a run, (f, u), and what it recorded, (f,), at frequencies [Hz], where it recorded most."""

    run: Run
    f_hz: Array
    inputs: Complex
    record: Complex

    @classmethod
    def of(cls, run: Run, vehicle: Vehicle) -> _Spectra:
        passage = Passage(run.track, run.rate_hz, run.distance_m, run.rate_hz)
        inputs = passage.sampled(passage.under_wheels(structure_of(vehicle))[0])[run.first:]
        read_ = run.kept_mps2 - run.kept_mps2.mean()
        size = min(round(_PART_S * run.rate_hz), len(read_))
        power = np.concatenate([[0.0], np.cumsum(read_**2)])
        first = int(np.argmax(power[size:] - power[:-size]))
        taper, part = np.hanning(size), slice(first, first + size)
        spectra = np.fft.rfft(taper[:, None] * (inputs[part] - inputs[part].mean(axis=0)), axis=0)
        record = np.fft.rfft(taper * (read_[part] - read_[part].mean()))
        f_hz = np.asarray(np.fft.rfftfreq(len(taper), 1 / run.rate_hz), float)
        return cls(run, f_hz[1:], spectra[1:], record[1:])

    def likeness(self, vehicle: Vehicle) -> float:
        """Share of the power of the record that is the vehicle's motion, times any factor: a record may be upside down.
        """
        model = self._model(vehicle)
        power = float(np.vdot(model, model).real * np.vdot(self.record, self.record).real)
        return float(np.vdot(model, self.record).real) ** 2 / power if power > 0 else 0.0

    def gain(self, vehicle: Vehicle) -> float:
        """How many times as large as the vehicle's motion the record is."""
        return float(np.linalg.norm(self.record) / max(float(np.linalg.norm(self._model(vehicle))), 1e-300))

    def _model(self, vehicle: Vehicle) -> Complex:
        car = compose(vehicle, [])
        response = frequency_response(pushed(car.structure, self.run.track.acts_on),
                                      [output_of(car, self.run.facts.main)], self.f_hz)
        return np.asarray((response[:, 0] * self.inputs).sum(axis=1))
