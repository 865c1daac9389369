"""Modes of a car out of its reading on roads that nobody measured: the car's numbers, fitted to the spectrum.

Problem: what a sensor in a car reads is no response to white forces. Its spectrum is that of the road, which falls by
w, seen through the car at two axles: where the wave of one axle meets that of the other half a turn late the reading is
nearly nothing, at odd multiples of half the speed over the wheelbase. A method that knows neither takes the hills
between these gaps for modes. Solution: wheelbase, contact patch and the sensor's place are known of the vehicle, so the
spectrum of a reading at speed v is known but for the car's springs, dampers, masses and the road's two numbers,

    S(f) = g |sum_a H_a(f) exp(-2 pi i f d_a / v)|^2 sinc^2(f c / v) (f / v)^-w / v + s^2

These are fitted, and the modes are those of the car with the numbers found. Pieces of the record have a level g each;
the speed within a piece is mixed as it was driven (R. Dahlhaus, Ann. Statist. 25, 1997, 1). Each periodogram is
compared with its own expectation, which leakage is a part of (A. Sykulski et al., Biometrika 106, 2019, 251), by
Whittle's likelihood. Tapered pieces that overlap are worth less than their number; the likelihood is weighted for that.

Every number starts at the vehicle's and is believed to lie within a factor of some ``exp(0.5)`` of it, so that what the
reading does not show keeps a large standard error, and its mode is not reported. Damping cannot come out negative.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Bools, Whole
from logger.estimation.road_spectrum import PIVOT_CPM
from logger.fitting.fisher_scoring import integrated_out
from logger.fitting.levenberg_marquardt import minimise
from logger.modal.mode import LARGEST_DAMPING_ERROR, LARGEST_FREQUENCY_ERROR, FoundMode, ModalResult, Rejected
from logger.roads.iso8608 import HIGHEST_CPM, STANDARD_WAVINESS
from logger.vehicle.linear_car import AxleResponse
from logger.vehicle.models import structure_of
from logger.vehicle.modes import modes as modes_of
from logger.vehicle.modes import vibrating
from logger.vehicle.named_parameters import AXLES, changed, free, read
from logger.vehicle.named_parameters import names as names_of
from logger.vehicle.vehicle import Vehicle

_PIECE_S = 10.0
_KERNEL = 6  # half bins to each side that a Hann taper mixes
# The last two of logarithms; the noise starts at the quietest bin.
_WAVINESS_SPREAD, _SPREAD, _NOISE_SPREAD = 0.5, 0.5, 3.0


class UnlikeCar(ValueError):
    """A reading whose spectrum is not that of the vehicle on a random road."""


@dataclass(frozen=True, eq=False)
class Periodograms:
    """Periodograms of the pieces of a record.

    power        (j, f) one-sided [unit^2/Hz]; ``bins`` (f,) whole numbers of ``step_hz``
    shares       (j, c) of each piece's time at each of ``speeds_mps`` (c,)
    kernel       (2 k + 1,) what a bin takes of the half bins around it
    worth        (j, f) independent periodograms in each value; 0 where nothing is known of the road
    """

    power: Array
    bins: Whole
    step_hz: float
    shares: Array
    speeds_mps: Array
    kernel: Array
    worth: Array


def pieces_of(samples: Array, speed_mps: Array, usable: Bools, rate_hz: float) -> Periodograms:
    """Cut a record (n,) into tapered pieces that overlap by half, of which each has readings, and moves, all along.

    ValueError for fewer than four.
    """
    # A piece holds some ten of a body's slowest swings; its lowest bins are those of drift and of the offset.
    lowest_bin = 4
    flat_to, highest_hz = 0.38, 25.0  # of the rate: above, recorders' filters differ; wheels hop below 20 Hz
    least_pieces = 4
    speed_step = 0.01  # speeds as near as this share one spectrum
    standing_mps = 2.0  # slower, engine and driver shake a car as much as the road does
    count = 2 * round(_PIECE_S * rate_hz / 2)
    taper = np.hanning(count + 1)[:count]
    fit = usable & (speed_mps >= standing_mps)
    starts = [at for at in range(0, len(samples) - count + 1, count // 2) if fit[at:at + count].all()]
    if len(starts) < least_pieces:
        raise ValueError(f"expected at least {least_pieces} stretches of {_PIECE_S:g} s, overlapping by half, at "
                         f"{standing_mps:g} m/s or faster, found {len(starts)}")
    index = np.array(starts)[:, None] + np.arange(count)
    cut = samples[index] - samples[index].mean(axis=1, keepdims=True)
    power = np.abs(np.fft.rfft(cut * taper, axis=1)) ** 2 * 2 / (rate_hz * float(taper @ taper))
    bins = np.arange(lowest_bin, int(min(flat_to * rate_hz, highest_hz) * count / rate_hz) + 1)
    cells = np.round(np.log(speed_mps[index]) / speed_step).astype(np.int64)
    known, where = np.unique(cells, return_inverse=True)
    where = where.reshape(cells.shape)
    weights = taper**2 / float(taper @ taper)
    shares = np.array([np.bincount(one, weights, len(known)) for one in where], dtype=np.float64)
    kernel = np.abs(np.fft.fft(taper, 2 * count)) ** 2
    kernel = np.concatenate([kernel[-_KERNEL:], kernel[:_KERNEL + 1]])
    both = taper[:count // 2] ** 2 + taper[count // 2:] ** 2  # what two pieces make of an instant
    worth = float(both.mean() ** 2 / (both**2).mean()) / 2
    waves = bins * (rate_hz / count) / speed_mps[index].min(axis=1)[:, None]
    return Periodograms(power[:, bins], bins, rate_hz / count, shares,
                  np.asarray(np.bincount(where.ravel(), speed_mps[index].ravel()) / np.bincount(where.ravel())),
                  kernel / kernel.sum(), np.where(waves <= HIGHEST_CPM, worth, 0.0))


class CarOnRoads:
    """The expected periodograms by all numbers but the levels: logarithms (p,) of the car's, the waviness, ln s^2."""

    def __init__(self, vehicle: Vehicle, pieces: Periodograms, rate_hz: float) -> None:
        free_numbers = [free(vehicle, name) for name in fitted_names(vehicle)]
        self.car, self.pieces = AxleResponse(vehicle, free_numbers, rate_hz), pieces
        self._half_hz = pieces.step_hz / 2 * np.arange(2 * pieces.bins[0] - _KERNEL, 2 * pieces.bins[-1] + _KERNEL + 1)
        quietest = float(np.log(pieces.power.mean(axis=0).min()))
        self.names = [one.name for one in free_numbers]
        self.start = np.array([*np.log([one.start for one in free_numbers]), STANDARD_WAVINESS, quietest])
        self.precision = np.array([*np.full(len(free_numbers), _SPREAD), _WAVINESS_SPREAD, _NOISE_SPREAD]) ** -2.0

    def shapes(self, x: Array) -> tuple[Array, Array]:
        """Spectra of the pieces for a level of 1 (j, f), and derivatives (q, j, f) by all of ``x`` but the noise."""
        values, waviness, f_hz = np.exp(x[:-2]), x[-2], self._half_hz
        gains, by_number = self.car.responses(values, f_hz)
        waves = f_hz / self.pieces.speeds_mps[:, None]  # (c, h)
        late = np.exp(-2j * np.pi * waves[:, None] * self.car.behind_m[:, None])  # (c, x, h)
        whole = np.einsum("xh,cxh->ch", gains, late)
        road = np.sinc(waves * self.car.contact_patch_m) ** 2 * (waves / PIVOT_CPM) ** -waviness
        road = road / self.pieces.speeds_mps[:, None]
        spectra = np.empty((len(x), *whole.shape))
        spectra[0] = np.abs(whole) ** 2 * road
        for number, (value, one) in enumerate(zip(values, by_number, strict=True), 1):
            spectra[number] = 2 * value * (whole.conj() * np.einsum("xh,cxh->ch", one, late)).real * road
        spectra[-1] = -spectra[0] * np.log(waves / PIVOT_CPM)
        leaked = np.lib.stride_tricks.sliding_window_view(spectra, len(self.pieces.kernel), axis=-1)[..., ::2, :]
        mixed = self.pieces.shares @ (leaked @ self.pieces.kernel)
        return mixed[0], mixed[1:]


@dataclass(frozen=True, eq=False)
class CarFit:
    """The vehicle with the numbers found, their covariance (p, p) as logarithms, ``names`` (p,), the waviness, and what
    the reading has of what is expected of it (b,) in bands that begin at ``bands_hz`` (b,)."""

    vehicle: Vehicle
    names: Sequence[str]
    covariance: Array
    waviness: float
    bands_hz: Array
    measured_share: Array


def fitted_names(vehicle: Vehicle) -> list[str]:
    """The numbers that shape a vehicle's modes, but for its geometry and one mass: against that all are counted."""
    wanted = ("unsprung_mass_kg", "suspension_stiffness_n_per_m", "suspension_damping_n_s_per_m",
              "tire_stiffness_n_per_m", "anti_roll_stiffness_n_m_per_rad")
    whole = ("pitch_inertia_kg_m2", "roll_inertia_kg_m2", *(f"{axle}.{one}" for axle in AXLES for one in wanted))
    return [name for name in names_of(vehicle) if name in whole and read(vehicle, name) > 0]


def fit_car(vehicle: Vehicle, pieces: Periodograms, rate_hz: float) -> CarFit:
    """The numbers that make the periodograms most probable: from the vehicle's own, and from those that fit
    best where a floor of noise hides first all but the loudest parts of the spectrum, then fewer: with the deep gaps
    between them in sight from the beginning, many sets of numbers are the best near them. ``UnlikeCar`` where the
    spectra are not those of such a car."""
    floors = (0.0, -2.0)  # of logarithms, over the mean power
    model = CarOnRoads(vehicle, pieces, rate_hz)
    x, loudest = model.start, float(np.log(pieces.power.mean()))
    for floor in floors:
        x = _descend(model, np.append(x[:-1], loudest + floor), floor_is_known=True)[0].x
    starts = model.start, np.append(x[:-1], model.start[-1])
    found, information, settled = min((_descend(model, one) for one in starts), key=lambda each: each[0].cost)
    x = found.x
    if not settled:
        raise UnlikeCar("the fit of this car's parameters to the record does not converge: expected a longer drive, or "
                        "one at several speeds")
    bands_hz, share = _shares(pieces, found.spectrum)
    covariance = np.asarray(np.linalg.inv(information)[:-2, :-2], dtype=np.float64)
    return CarFit(model.car.vehicle_with(np.exp(x[:-2])), model.names, covariance, float(x[-2]), bands_hz, share)


@dataclass(frozen=True, eq=False)
class _CarAt:
    """Spectra (j, f), the derivatives of their logarithms by the numbers (q, j, f) and by the logarithm of each one's
    level (j, f), and minus the logarithm of the posterior density."""

    x: Array
    spectrum: Array
    slopes: Array
    by_level: Array
    cost: float


def _descend(model: CarOnRoads, start: Array, floor_is_known: bool = False) -> tuple[_CarAt, Array, bool]:
    """The most probable numbers (q,) and levels (j,), downhill from a start; the information (q, q) on the numbers
    there, the levels integrated out; and whether it came to rest."""
    pieces, power, q = model.pieces, model.pieces.power, len(start)

    def evaluate(z: Array) -> _CarAt:
        x = z[:q]
        shapes, slopes = model.shapes(x)
        level, noise = np.exp(z[q:])[:, None], np.exp(x[-1])
        spectrum = level * shapes + noise
        whittle = float((pieces.worth * (np.log(spectrum) + power / spectrum)).sum())
        by = np.concatenate([level * slopes, np.full((1, *shapes.shape), noise)]) / spectrum
        return _CarAt(x, spectrum, by, level * shapes / spectrum,
                      whittle + 0.5 * float(model.precision @ (x - model.start) ** 2))

    def normal_equations(z: Array, at: _CarAt, fresh: bool) -> tuple[Array, Array]:
        off = pieces.worth * (power / at.spectrum - 1)
        downhill = np.einsum("qjf,jf->q", at.slopes, off) - model.precision * (at.x - model.start)
        across = np.einsum("qjf,jf->qj", at.slopes, pieces.worth * at.by_level)
        own = np.einsum("qjf,rjf->qr", pieces.worth * at.slopes, at.slopes) + np.diag(model.precision)
        return np.append(downhill, (at.by_level * off).sum(axis=1)), np.block([
            [own, across], [across.T, np.diag((pieces.worth * at.by_level**2).sum(axis=1))]])

    level = np.log(power.mean(axis=1) / model.shapes(start)[0].mean(axis=1))
    low, high = np.full((2, q + len(level)), [[-np.inf], [np.inf]])
    if floor_is_known:
        low[q - 1] = high[q - 1] = start[-1]
    found = minimise(np.append(start, level), evaluate, normal_equations, small_gain=lambda _at: 5e-4,
                     most_rounds=60, keep_derivatives=False, low=low, high=high, longest_step=0.3)
    return found.at, integrated_out(found.information, np.arange(q, len(low))), found.converged


def _shares(pieces: Periodograms, spectrum: Array) -> tuple[Array, Array]:
    """Measured over expected power in bands. ``UnlikeCar`` where that is neither chance nor a trifle."""
    # Bands in which measured and fitted spectrum are compared, and what is no chance and no trifle.
    bands, most_misfit, sure = 12, 0.2, 4.0
    f_hz, worth = pieces.bins * pieces.step_hz, pieces.worth.sum(axis=0)
    edges = np.unique(np.searchsorted(f_hz, np.geomspace(f_hz[0], f_hz[-1], bands + 1)[:-1]))
    total = np.maximum(np.add.reduceat(worth, edges), 1e-9)
    share = np.asarray(np.add.reduceat((pieces.worth * (pieces.power / spectrum - 1)).sum(axis=0), edges) / total + 1,
                       dtype=np.float64)
    chance = 1 / np.sqrt(total)
    off = np.where(np.abs(share - 1) > sure * chance, np.abs(share - 1), 0.0)
    worst = int(off.argmax())
    if off[worst] > most_misfit:
        raise UnlikeCar(f"from {f_hz[edges[worst]]:.2g} Hz on, the reading has {share[worst]:.2f} times the power that "
                        "this car could have on a random road with any springs, dampers and masses")
    return np.asarray(f_hz[edges], dtype=np.float64), share


def found_modes(fit: CarFit) -> tuple[list[FoundMode], list[Rejected]]:
    """The modes that the reading resolves, with standard errors, and those that it does not."""
    derivative_step = 1e-4
    base = _modes(fit.vehicle)
    slopes = np.zeros((len(fit.names), *base.shape))
    for number, name in enumerate(fit.names):
        moved = _modes(changed(fit.vehicle, {name: read(fit.vehicle, name) * (1 + derivative_step)}))
        near = np.abs(base[:, None, 0] / moved[None, :, 0] - 1) + np.abs(base[:, None, 1] - moved[None, :, 1])
        slopes[number] = (moved[near.argmin(axis=1)] - base) / derivative_step
    errors = np.sqrt(np.einsum("iab,ij,jab->ab", slopes, fit.covariance, slopes))
    modes, rejected = [], []
    for (frequency, ratio), (frequency_std, ratio_std) in zip(base.tolist(), errors.tolist(), strict=True):
        reason = (f"the reading hardly shows it: its frequency is uncertain by {frequency_std / frequency:.0%}"
                  if frequency_std > LARGEST_FREQUENCY_ERROR * frequency else
                  f"its damping ratio is uncertain by {ratio_std:.2f}" if ratio_std > LARGEST_DAMPING_ERROR else "")
        if reason:
            rejected.append(Rejected(frequency, ratio, reason))
        else:
            modes.append(FoundMode(frequency, ratio, frequency_std, ratio_std, np.ones(1, dtype=np.complex128)))
    return modes, rejected


def _modes(vehicle: Vehicle) -> Array:
    """Frequency [Hz] and damping ratio of what swings, (m, 2)."""
    return np.array([(one.frequency_hz, one.damping_ratio) for one in vibrating(modes_of(structure_of(vehicle)))])


def car_modes(vehicle: Vehicle, samples: Array, speed_mps: Array, usable: Bools, rate_hz: float) -> ModalResult:
    """The modes of a vehicle near this one, out of its reading (n,) on roads that nobody measured.

    speed_mps    (n,) at each sample; ``usable`` (n,) whether it is a reading

    ValueError for too few stretches at speed, ``UnlikeCar`` where the reading is not that of such a car.
    """
    pieces = pieces_of(samples, speed_mps, usable, rate_hz)
    fit = fit_car(vehicle, pieces, rate_hz)
    modes, rejected = found_modes(fit)
    worst = int(np.abs(fit.measured_share - 1).argmax())
    how = (f"drive on roads that nobody measured: springs, dampers and masses of {vehicle.name} fitted to the spectra "
           f"of {len(pieces.power)} stretches of {_PIECE_S:g} s. Removed: the road (waviness {fit.waviness:.2f}) "
           f"and the distance between the axles. The fitted power is at most "
           f"{abs(fit.measured_share[worst] - 1):.0%} off, in the band from {fit.bands_hz[worst]:.2g} Hz on")
    return ModalResult(tuple(modes), tuple(rejected), 0, how)
