"""Priors of the nuisance parameters: what is never quite as the files say, although no physics is missing.

Problem: nominal masses and rates are a few per cent off, a distance signal errs, and no recorder passes all frequencies
quite alike; a lab that allows for none of this takes every small mistake for an effect, and one that allows for too
much lets mistakes absorb effects. Solution: all of them are nuisance parameters with normal priors, those of the car's
numbers on their logarithms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from logger.arrays import Array, Bools
from logger.bounds import CONFLICT_SIGMA, UNUSUAL_SIGMA
from logger.runs import ENCODER, SENSOR, Signal
from logger.vehicle.named_parameters import FACTOR, PRELOAD, WEAKEST, changed, read, sized
from logger.vehicle.uncertain import Known, grows_with_mass
from logger.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Tolerance:
    """Standard deviations of the priors.

    numbers      of masses, inertias, springs and dampers, as a share: 20 % either way, as data sheets and textbook cars
                 are off by (in twelve such files 4 % either way named false effects, 20 % none)
    lengths      of places on the car, as a share
    gain         of the sensor's acceleration, as a share
    scale        of the gain of any other signal, as a share: a per cent, as a travel sensor, a laser or a load cell has
                 with its mounting; of an encoder, which counts, a tenth of that (judgements)
    droop        of what a recorder takes away from a frequency, over its square as a share of the rate (the mean over
                 each sample takes 1.6; a filter that ripples by 0.1 dB some tenths)
    clock        rate of a rig's recorder over that of what drives it, less 1: quartz crystals of +- 50 ppm each
    band         in which numbers may well be, in these deviations: 20 % either way have 12.5 %
    by_name      of numbers of which the vehicle's file says how well they are known
    guessed      whether it gives no value for some of them, in whose place stands where a search begins
    """

    numbers: float = 0.125
    lengths: float = 0.02
    gain: float = 0.005
    scale: float = 0.01
    droop: float = 0.4
    clock: float = 4e-5
    band: float = 1.6
    by_name: Mapping[str, float] = field(default_factory=dict)
    guessed: bool = False

    @classmethod
    def of(cls, known: Mapping[str, Known]) -> "Tolerance":
        """The usual ones, but for numbers of which the vehicle's file says how well they are known."""
        return cls(by_name={name: one.deviation for name, one in known.items() if name != PRELOAD})

    @property
    def largest(self) -> float:
        """The largest standard deviation of a mass, inertia, spring or damper."""
        return max(self.numbers, *self.by_name.values(), 0.0)

    def gain_of(self, signal: Signal) -> float:
        """Of what a sensor reads, as a share."""
        if signal.kind == ENCODER:
            return 0.1 * self.scale
        return self.gain if signal.name == SENSOR else self.scale

    def widened(self) -> "Tolerance":
        """Nothing is known of any number of which the file does not say how well it is known."""
        numbers, lengths = (Known.unknown(name, 1.0).deviation for name in ("sprung_mass_kg", "track_width_m"))
        return replace(self, numbers=numbers, lengths=lengths)

    @property
    def share(self) -> float:
        """By how much masses, springs and dampers may well be off, either way."""
        return self.band * self.numbers


@dataclass(frozen=True)
class VehiclePrior:
    """Prior of a vehicle's numbers: their names, and (p,) standard deviations and difference steps of their logarithms.
    """

    names: tuple[str, ...]
    deviations: Array
    steps: Array

    @staticmethod
    def of(vehicle: Vehicle, tolerance: Tolerance) -> "VehiclePrior":
        """The prior of a vehicle's numbers."""
        names = sized(vehicle)
        lengths = np.array([name.endswith(("cg_distance_m", "contact_patch_m")) for name in names], dtype=bool)
        # A step of a length, by which waves come late, has to be much smaller.
        usual = np.where(lengths, tolerance.lengths, tolerance.numbers)
        deviations = [tolerance.by_name.get(name, one) for name, one in zip(names, usual, strict=True)]
        return VehiclePrior(names, np.array(deviations, float), np.where(lengths, 1e-4, 0.002))

    @property
    def is_vague(self) -> bool:
        """Whether a number may well be so far off that it counts as not measured: a fit that begins at the file's may
        end elsewhere."""
        return bool(self._not_measured.any())

    @property
    def scale_deviation(self) -> float:
        """Standard deviation of a common scale of all masses and forces, as a share: of the best known of them."""
        return min((float(one) for name, one in zip(self.names, self.deviations, strict=True) if grows_with_mass(name)),
                   default=0.0)

    @property
    def reach(self) -> Array:
        """How far a fit may take the logarithms (p,): of a number that nobody measured as far as is unusual, or by the
        factor within which fits stay. On the way to a rigid tire or a wheel without mass its derivative vanishes: a
        fit does not come back from there, be it where another car explains more. What was measured may contradict its
        tolerance."""
        return np.where(self._not_measured, np.maximum(UNUSUAL_SIGMA * self.deviations, np.log(FACTOR)), np.inf)

    @property
    def _not_measured(self) -> Bools:
        return np.asarray(UNUSUAL_SIGMA * self.deviations > WEAKEST, bool)

    def cost(self, logs: Array) -> float:
        """Minus twice the log-density, without its constant."""
        return float(((logs / self.deviations) ** 2).sum())

    def gradient(self, logs: Array) -> Array:
        """Half of the cost's first derivative (p,)."""
        return np.asarray(logs / self.deviations**2)

    def beyond_tolerance(self, logs: Array, covariance: Array) -> dict[str, float]:
        """Relative changes of the numbers that the runs move beyond their tolerance, the farthest first, by name.

        logs, covariance    fitted logarithms (p,) and their covariance (p, p), which includes the prior

        Of all cars within the tolerance the likeliest is found, by the likelihood alone to second order. Where it
        explains the runs worse than the fitted one by ``CONFLICT_SIGMA`` squared, the file is wrong in those numbers
        that are at the end of their tolerance in it. So two lengths of which the runs know the sum alone, a wheelbase,
        show an error of that. A number that may be twice as large, or nothing, has no end of a tolerance.
        """
        from scipy.optimize import lsq_linear

        # In units of the prior: the posterior's information is that of the runs and one.
        place, scaled = logs / self.deviations, covariance / np.outer(self.deviations, self.deviations)
        variances, ways = np.linalg.eigh(scaled)
        # A direction of which the runs say less than a thousandth of what the prior does is where the prior has it.
        known = (variances > 0) & (variances < 1 / (1 + 1e-3))
        weights = 1 / variances[known] - 1
        columns = np.sqrt(weights)[:, None] * ways[:, known].T
        # The fitted place is the mean of the runs' own estimate and of the prior's, by their information.
        likeliest = (1 + weights) / np.sqrt(weights) * (ways[:, known].T @ place)
        # A change is a share of the number: 20 % less is no more than 20 % more, though its logarithm is.
        high = np.where(self.deviations < 1, Tolerance.band, np.inf)
        low = np.minimum(np.log1p(-np.minimum(high * self.deviations, 0.9)) / self.deviations, -high)
        within = np.asarray(lsq_linear(columns, likeliest, (low, high)).x, float)
        worse = ((columns @ within - likeliest) ** 2).sum() - ((columns @ place - likeliest) ** 2).sum()
        ended = (np.abs(within) > (1 - 1e-3) * np.where(place < 0, -low, high)) & (np.abs(place) > Tolerance.band)
        if not worse > CONFLICT_SIGMA**2:
            return {}
        return {self.names[index]: float(np.expm1(logs[index])) for index in np.argsort(-np.abs(place)) if ended[index]}

    def moved(self, logs: Array, covariance: Array, shows_forces: bool = False) -> dict[str, tuple[float, float]]:
        """Relative changes of the numbers that the runs move for sure and farther than half of all right numbers are
        off, and their standard errors, the farthest first, by their tolerance; arguments as of ``beyond_tolerance``.

        A car in which all masses and forces are larger by one factor moves the same. So these are counted against the
        one of them that moves as the median does, weighed by how well each is known: where most are right, a wrong one
        is named alone. Where the runs show forces, each is counted for itself.
        """
        scaling = np.flatnonzero([grows_with_mass(name) for name in self.names])
        against = np.eye(len(logs))
        if len(scaling) and not shows_forces:
            order = scaling[np.argsort(logs[scaling])]
            known = np.cumsum(self.precision[order])
            middle = order[np.searchsorted(known, 0.5 * known[-1])]
            against[scaling, middle] -= 1.0
        logs, errors = against @ logs, np.sqrt(np.maximum(np.diag(against @ covariance @ against.T), 0.0))
        least = np.maximum(CONFLICT_SIGMA * errors, 0.6745 * self.deviations)  # the upper quartile of a normal density
        return {self.names[index]: (float(np.expm1(logs[index])), float(np.exp(logs[index]) * errors[index]))
                for index in np.argsort(-np.abs(logs / self.deviations)) if abs(logs[index]) > least[index]}

    def is_contradicted_by(self, logs: Array) -> bool:
        """Whether logarithms (p,) are in conflict with it, whatever their errors are."""
        return self.is_in_conflict(logs, np.zeros_like(logs))

    def is_in_conflict(self, logs: Array, errors: Array) -> bool:
        """Whether the runs move a number beyond its tolerance, and farther than numbers are off by chance.

        logs, errors    fitted logarithms and their standard errors (p,), which include the prior

        Where the prior is right, a fitted number scatters around it by the root of what the runs took from its
        variance. A number that nobody measured contradicts nothing.
        """
        scatter = np.sqrt(np.maximum(self.deviations**2 - errors**2, 0.0))
        return bool(((np.abs(logs) > Tolerance.band * self.deviations)
                     & (np.abs(logs) > UNUSUAL_SIGMA * scatter) & ~self._not_measured).any())

    @property
    def precision(self) -> Array:
        """Half of the cost's second derivative (p,)."""
        return np.asarray(self.deviations**-2.0)

    def vehicle(self, vehicle: Vehicle, logs: Array) -> Vehicle:
        """The vehicle with its numbers times the exponentials of these logarithms (p,); one of infinite numbers cannot
        be simulated."""
        with np.errstate(over="ignore"):
            factors = np.exp(logs)
        return changed(vehicle, {name: read(vehicle, name) * float(one)
                                 for name, one in zip(self.names, factors, strict=True)})

    def logs(self, vehicle: Vehicle, other: Vehicle) -> Array:
        """Logarithms (p,) of another vehicle's numbers over those of this one."""
        return np.log([read(other, name) / read(vehicle, name) for name in self.names])
