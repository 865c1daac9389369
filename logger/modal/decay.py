"""Free decays: which vibrations a record supports, and each with the smallest error that its noise allows.

Problem: a method that reads poles off a decomposition (ERA, SSI, AR) has to be given the order. Too low, and poles are
mixed; too high, and noise becomes poles; its damping can be 70 % off at 20 dB without a word about it.

Solution: such a method only proposes poles. What is believed and reported comes from the model itself,

    y_c(t) = sum over modes of exp(sigma t) (a_c cos omega t + b_c sin omega t) + offset_c + noise_c(t),

fitted by least squares, which for white noise attains the Cramer-Rao bound. Proposals are taken in one by one, the one
that explains most first, as long as it explains more than the largest of a thousand draws of noise would, noise being
what is left around its frequency and while it lasts: that of a sensor that errs by a share of what it reads, or of few
digits, shrinks as the modes do. After each the poles of all are refitted, and the poles of each smaller order are tried
as a start too. Amplitudes are linear and are eliminated (variable projection, Golub and Pereyra, 1973), which leaves
two unknowns per mode and makes a step cheap however many channels there are. Standard errors follow from the same
matrices; noise that is louder around a mode than elsewhere enlarges them.

The logarithmic decrement (Eq 5.2 of Blum 2015) is the damping from how fast peaks shrink. Two peaks give a number
without an error. Here the line through the logarithms of all peaks above the noise gives both. The record must hold one
vibration: others are cut out around the strongest by Fourier transform first.

Eigensystem realisation gives poles of every order: a free decay y[k] = C A^k x0 laid in a block Hankel matrix has rank
n, and the same matrix one sample later is the first with A in its middle (Juang and Pappa, 1985; 3.2.1 of Blum 2015).

With noise the rank is full and the order has to be chosen. The realisations of all orders are nested: that of order n
is the upper left corner of the largest, so a whole stabilisation diagram costs one singular value decomposition.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.modal.mode import (
    MOST_DAMPING,
    FoundMode,
    ModalResult,
    OrderPoles,
    Rejected,
    damping_ratio,
    errors_of,
    normalised,
    order_poles,
)

Propose = Callable[[Array, float], tuple[OrderPoles, ...]]


@dataclass(frozen=True)
class _Modes:
    """Poles s (m,), amplitudes (2 m + 1, channels) of cos, sin and the offset, the residual (samples, channels)."""

    poles: Complex
    amplitudes: Array
    residual: Array
    orthonormal: Array
    noise: Array  # (channels,) variance
    turned: Array  # (2 m, 2 m): inverse of the basis' Gram matrix

    @property
    def cost(self) -> float:
        """The likelihood's, for noise of unknown strength in each channel."""
        return float(len(self.residual) * np.log(self.noise).sum())


def decay_modes(samples: Array, rate_hz: float, propose: Propose, how: str) -> ModalResult:
    """Modes of a free decay (samples, channels), from the poles that a method proposes for it.

    The first sample must lie in the free decay. The mean is not taken off: an offset is part of the model.
    """
    scale = samples.std(axis=0)
    scaled = samples / np.where(scale > 0, scale, 1.0)
    diagram = propose(scaled, rate_hz)
    threshold = _threshold(*samples.shape)
    fit = _take_in(_solve(scaled, np.empty(0, complex), rate_hz), scaled, diagram, rate_hz, threshold)
    fit = _fewer(fit, scaled, diagram, rate_hz, threshold)
    if len(fit.poles):  # what strong modes hid
        hidden = propose(fit.residual, rate_hz)
        fit = _take_in(fit, scaled, hidden, rate_hz, threshold)
    modes, rejected = _judge(fit, scale, rate_hz, threshold)
    return ModalResult(tuple(modes), (*rejected, *_unsupported(fit.poles, diagram)), 2 * len(fit.poles), how, diagram)


def _threshold(samples: int, channels: int) -> float:
    """Chi-squared that the best of all frequencies reaches by chance once in a thousand records of noise."""
    from scipy.special import chdtri

    false_alarm = 1e-3  # chance that a record of noise yields a mode
    return float(chdtri(2 * channels + 2, false_alarm / samples))


def _basis(poles: Complex, count: int, rate_hz: float) -> Array:
    """Columns Re, Im of exp(s t) for each pole; products of exponentials of far and near instants are cheap."""
    near = int(np.sqrt(count)) + 1
    far = np.exp(np.outer(np.arange(-(-count // near)) * (near / rate_hz), poles))
    waves = far[:, None] * np.exp(np.outer(np.arange(near) / rate_hz, poles))
    return np.ascontiguousarray(waves.reshape(near * len(far), len(poles))[:count]).view(np.float64)


def _solve(samples: Array, poles: Complex, rate_hz: float) -> _Modes:
    """Amplitudes for given poles."""
    count = len(samples)
    basis = np.hstack([_basis(poles, count, rate_hz), np.ones((count, 1))])
    q, r = np.linalg.qr(basis)
    seen = q.T @ samples
    residual = samples - q @ seen
    inverse = np.linalg.pinv(r)
    noise = (residual**2).sum(axis=0) / max(1, count - len(r))
    noise = np.maximum(noise, 1e-24 * (samples**2).mean(axis=0) + 1e-300)
    return _Modes(poles, inverse @ seen, residual, q, noise, (inverse @ inverse.T)[:-1, :-1])


def _normal_equations(fit: _Modes, rate_hz: float) -> tuple[Array, Array]:
    """Information (2 m, 2 m) about Re s, Im s of every pole, amplitudes unknown, and the gradient (2 m,)."""
    count, m = len(fit.residual), len(fit.poles)
    slope = _basis(fit.poles, count, rate_hz) * (np.arange(count) / rate_hz)[:, None]
    slope -= fit.orthonormal @ (fit.orthonormal.T @ slope)
    gram, pull = slope.T @ slope, slope.T @ fit.residual  # (2 m, 2 m), (2 m, channels)
    cos, sin = fit.amplitudes[:-1:2], fit.amplitudes[1:-1:2]  # (m, channels)
    # d/d Re s of a Re e + b Im e is t (a Re e + b Im e); d/d Im s is t (b Re e - a Im e).
    parts = np.zeros((2 * m, 2 * m, fit.noise.size))
    index = np.arange(m)
    parts[2 * index, 2 * index], parts[2 * index, 2 * index + 1] = cos, sin
    parts[2 * index + 1, 2 * index], parts[2 * index + 1, 2 * index + 1] = sin, -cos
    weighted = parts / fit.noise
    information = np.einsum("aic,ij,bjc->ab", weighted, gram, parts, optimize=True)
    return np.asarray(information, dtype=np.float64), np.einsum("aic,ic->a", weighted, pull)


def _refit(fit: _Modes, samples: Array, rate_hz: float) -> _Modes:
    """Gauss-Newton on the poles, each step shortened until it helps."""
    most_steps = 60
    for _ in range(most_steps):
        information, gradient = _normal_equations(fit, rate_hz)
        scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
        step = np.linalg.lstsq(information / np.outer(scale, scale), gradient / scale, rcond=1e-10)[0] / scale
        change = step[::2] + 1j * step[1::2]
        size = min(1.0, 0.3 / max(float((np.abs(change) / np.abs(fit.poles)).max()), 1e-300))
        before = fit
        while size > 1e-3:
            poles = before.poles + size * change
            if (poles.imag > 0).all() and _bounded(poles, len(samples) / rate_hz).all():
                trial = _solve(samples, poles, rate_hz)
                if trial.cost <= before.cost:
                    fit = trial
                    break
            size /= 4
        if fit is before or before.cost - fit.cost < 1e-4:
            return fit
    return fit


def _significance(fit: _Modes, rate_hz: float) -> Array:
    """Chi-squared (m,) that each mode explains, against the noise around its frequency and while it lasts."""
    loud, freedom = _loudness(fit, rate_hz), _freedom(fit, fit.poles, rate_hz)
    found = np.empty(len(fit.poles))
    for k in range(len(fit.poles)):
        own = slice(2 * k, 2 * k + 2)
        part = fit.amplitudes[own]
        explained = (part * np.linalg.solve(fit.turned[own, own], part)).sum(axis=0)
        # Of noise whose strength is known from few samples chance makes more: the ratio of likelihoods counts that.
        found[k] = (freedom[k] * np.log1p(explained / (fit.noise * loud[k]) / freedom[k])).sum()
    return found


def _freedom(fit: _Modes, poles: Complex, rate_hz: float) -> Array:
    """How many samples (m,) the envelope of each pole counts, those that the fit took for itself left out."""
    envelope, left = _envelope(fit, poles, rate_hz)
    return np.asarray(np.maximum((envelope @ left) ** 2 / (envelope**2 @ left + 1e-300), 1.0))


def _envelope(fit: _Modes, poles: Complex, rate_hz: float) -> tuple[Array, Array]:
    """Squared envelopes (m, samples), and the share of its noise (samples,) that the fit left in each sample.

    What grows lasts all along. What is over in a few samples, most of whose noise the fit took, is given some more: too
    few show nothing of the noise, and heavily damped modes would drown in what is not known of it.
    """
    fewest_to_tell = 25  # samples from which the noise is known while a mode lasts
    fall = np.clip(poles.real, -rate_hz / fewest_to_tell, 0.0)
    envelope = np.exp(2 * np.outer(fall, np.arange(len(fit.residual)) / rate_hz))
    return envelope, np.maximum(1 - (fit.orthonormal**2).sum(axis=1), 0.0)


def _loudness(fit: _Modes, rate_hz: float) -> Array:
    """How much louder the residual is around each mode, or while it lasts, than on average (m, channels), 1 or more."""
    return np.maximum(np.maximum(1.0, _louder_nearby(fit, rate_hz)), _louder_meanwhile(fit, fit.poles, rate_hz))


def _louder_nearby(fit: _Modes, rate_hz: float) -> Array:
    """In the residual's spectrum around each mode."""
    loudness_bins = 60  # of the residual's spectrum on which the noise around a mode is measured
    count = len(fit.residual)
    power = np.abs(np.fft.rfft(fit.residual, axis=0)) ** 2 / (count * fit.noise)
    sums = np.vstack([np.zeros(power.shape[1]), np.cumsum(power, axis=0)])
    middle = np.round(fit.poles.imag / (2 * np.pi) * count / rate_hz).astype(int)
    half = np.maximum(loudness_bins // 2, np.abs(fit.poles.real) / np.pi * count / rate_hz).astype(int)
    first = np.clip(middle - half, 1, max(1, len(power) - 2 * loudness_bins // 2))
    last = np.clip(middle + half, first + 1, len(power))
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])


def _louder_meanwhile(fit: _Modes, poles: Complex, rate_hz: float) -> Array:
    """Under the envelope of each pole (m, channels), but for what the fit took of the noise there."""
    envelope, left = _envelope(fit, poles, rate_hz)
    kept = np.maximum(envelope @ left, 1e-12 * envelope.sum(axis=1))
    return np.asarray(envelope @ fit.residual**2 / (kept[:, None] * fit.noise))


def _take_in(fit: _Modes, samples: Array, diagram: tuple[OrderPoles, ...], rate_hz: float, threshold: float) -> _Modes:
    """Add proposed poles, those that explain most first, as long as they explain more than noise would.

    While modes are missing the residual is no noise, and a few more poles are tried before those that are no stronger
    than it are given up.
    """
    ahead = 4  # poles that are tried beyond those that are believed
    most_modes = 40
    proposed = _different(np.concatenate([np.empty(0, complex), *(found.poles for found in diagram)]),
                          len(samples) / rate_hz)
    waves = _basis(proposed, len(samples), rate_hz)
    believed = fit
    while len(proposed) and len(fit.poles) < min(most_modes, len(believed.poles) + ahead):
        gains = _gains(fit, waves)
        fair = (gains / np.maximum(1.0, _louder_meanwhile(fit, proposed, rate_hz))).sum(axis=1)
        best = int(fair.argmax() if fair.max() >= threshold else gains.sum(axis=1).argmax())
        if gains[best].sum() < threshold:
            break
        larger = _refit(_solve(samples, np.append(fit.poles, proposed[best]), rate_hz), samples, rate_hz)
        ratios = damping_ratio(larger.poles)
        if fit.cost - larger.cost < threshold or (ratios > MOST_DAMPING).any():
            keep = np.arange(len(proposed)) != best
            proposed, waves = proposed[keep], waves.reshape(len(samples), -1, 2)[:, keep].reshape(len(samples), -1)
            continue
        fit = larger
        if (_significance(fit, rate_hz)[len(believed.poles):] >= threshold).all():
            believed = fit
    return believed


def _bounded(poles: Complex, duration_s: float) -> Bools:
    """Which poles grow little enough, if at all, to be those of a record of this duration."""
    least_damping, most_growth = -0.05, 10.0  # the latter in powers of e, from the first sample to the last
    return np.asarray((damping_ratio(poles) > least_damping) & (poles.real * duration_s < most_growth))


def _different(poles: Complex, duration_s: float) -> Complex:
    """Poles that could be modes, one of those that are alike within a per cent of damping."""
    alike = 0.005  # relative distance of poles that are tried once only
    poles = poles[_bounded(poles, duration_s) & (damping_ratio(poles) < MOST_DAMPING)]
    cells = np.round(np.log(poles) / alike)
    return np.asarray(poles[np.unique(cells, return_index=True)[1]])


def _fewer(fit: _Modes, samples: Array, diagram: tuple[OrderPoles, ...], rate_hz: float, threshold: float) -> _Modes:
    """The same or better with the poles of one order for a start.

    Modes that overlap, as heavily damped ones do, can lead one at a time into a fit with more poles than there are.
    """
    best = fit
    for found in diagram:
        poles = _different(found.poles, len(samples) / rate_hz)
        if not 0 < len(poles) <= len(fit.poles):
            continue
        trial = _refit(_solve(samples, poles, rate_hz), samples, rate_hz)
        if _price(trial, threshold) < _price(best, threshold):
            best = trial
    return best


def _price(fit: _Modes, threshold: float) -> float:
    """Cost of a fit and its modes; one that nobody would believe is dear."""
    return fit.cost + threshold * len(fit.poles) + (1e300 if (damping_ratio(fit.poles) > MOST_DAMPING).any() else 0.0)


def _gains(fit: _Modes, waves: Array) -> Array:
    """Chi-squared by which each proposed pole would better the fit, by channel (m, channels)."""
    new = waves - fit.orthonormal @ (fit.orthonormal.T @ waves)
    cos, sin = new[:, ::2], new[:, 1::2]
    cc, ss, cs = (cos**2).sum(axis=0), (sin**2).sum(axis=0), (cos * sin).sum(axis=0)
    seen_cos, seen_sin = cos.T @ fit.residual, sin.T @ fit.residual
    size = cc * ss - cs**2
    size = np.where(size > 1e-9 * (waves[:, ::2] ** 2).sum(axis=0) ** 2, size, np.inf)[:, None]
    explained = (ss[:, None] * seen_cos**2 + cc[:, None] * seen_sin**2 - 2 * cs[:, None] * seen_cos * seen_sin) / size
    return np.asarray(explained / fit.noise)


def _judge(fit: _Modes, scale: Array, rate_hz: float, threshold: float) -> tuple[list[FoundMode], list[Rejected]]:
    largest_error = 0.5  # a damping ratio whose standard error is more than this is none
    modes: list[FoundMode] = []
    rejected: list[Rejected] = []
    if not len(fit.poles):
        return modes, rejected
    information, _ = _normal_equations(fit, rate_hz)
    covariance = np.linalg.pinv(information, hermitian=True)
    significance, loud = _significance(fit, rate_hz), _loudness(fit, rate_hz)
    for k in np.argsort(np.abs(fit.poles)):
        pole = complex(fit.poles[k])
        own = slice(2 * k, 2 * k + 2)
        power = (fit.amplitudes[own] ** 2).sum(axis=0) / fit.noise
        louder = float((loud[k] * power).sum() / power.sum())
        frequency, ratio = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
        frequency_std, damping_std = errors_of(pole, np.asarray(covariance[own, own] * louder))
        reason = None
        if significance[k] < threshold:
            reason = "no stronger than the noise around it"
        elif frequency_std > largest_error * frequency or damping_std > largest_error:
            reason = "the record does not determine its frequency or damping"
        elif ratio < -2 * damping_std:
            reason = "it grows instead of decaying: a hum, not a mode"
        if reason:
            rejected.append(Rejected(frequency, ratio, reason))
        else:
            shape = normalised((fit.amplitudes[2 * k] - 1j * fit.amplitudes[2 * k + 1]) * scale)
            modes.append(FoundMode(frequency, ratio, frequency_std, damping_std, shape))
    return modes, rejected


def _unsupported(poles: Complex, diagram: tuple[OrderPoles, ...]) -> list[Rejected]:
    """Poles of the largest order that did not come in."""
    if not diagram:
        return []
    left = [complex(s) for s in diagram[-1].poles if not len(poles) or np.abs(poles - s).min() > 0.05 * abs(s)]
    return [Rejected(abs(s) / (2 * np.pi), -s.real / abs(s), "explains no more than noise would") for s in left]


@dataclass(frozen=True)
class Decrement:
    """Damping ratio and frequency [Hz] with standard deviations; times (n,) [s] of the peaks used."""

    damping_ratio: float
    damping_std: float
    frequency_hz: float
    frequency_std_hz: float
    peak_s: Array


def damping_of_two_peaks(first: float, later: float, cycles: int) -> float:
    """Eq 5.2: ln(first / later) / 2 pi cycles, for light damping."""
    return float(np.log(first / later) / (2 * np.pi * cycles))


def log_decrement(samples: Array, rate_hz: float) -> Decrement:
    """The strongest vibration of a free decay (n,).

    ValueError when fewer than four peaks rise above a tenth of the first.
    """
    faded_share = 0.1  # of the first peak: what is below is left to the noise
    fewest_peaks = 4
    wave, strongest_hz = _alone(samples, rate_hz)
    top = np.flatnonzero((wave[1:-1] > wave[:-2]) & (wave[1:-1] >= wave[2:]) & (wave[1:-1] > 0)) + 1
    edge = rate_hz / strongest_hz  # the cut rings at both ends
    top = top[(top > edge) & (top < len(wave) - edge)]
    faded = np.flatnonzero(wave[top] < faded_share * wave[top].max(initial=0.0)) if len(top) else np.empty(0, int)
    top = top[:faded[0]] if len(faded) else top
    if len(top) < fewest_peaks:
        raise ValueError(f"expected at least {fewest_peaks} peaks of one vibration, found {len(top)}")
    below, peak, above = wave[top - 1], wave[top], wave[top + 1]
    shift = 0.5 * (below - above) / (below - 2 * peak + above)
    height, time_s = peak - 0.25 * (below - above) * shift, (top + shift) / rate_hz
    (decrement, decrement_std), (period_s, period_std_s) = _slope(-np.log(height)), _slope(time_s)
    damped_hz = 1 / period_s
    ratio = decrement / np.hypot(2 * np.pi, decrement)
    return Decrement(float(ratio), float(decrement_std / (2 * np.pi)), float(damped_hz / np.sqrt(1 - ratio**2)),
                     float(period_std_s * damped_hz**2), time_s)


def decrement_mode(samples: Array, rate_hz: float) -> ModalResult:
    """The same as the only mode of a record of one channel. ValueError as ``log_decrement``."""
    found = log_decrement(samples, rate_hz)
    mode = FoundMode(found.frequency_hz, found.damping_ratio, found.frequency_std_hz, found.damping_std,
                     np.ones(1, np.complex128))
    return ModalResult((mode,), (), 0, f"logarithmic decrement (Eq 5.2) over {len(found.peak_s)} peaks")


def _alone(samples: Array, rate_hz: float) -> tuple[Array, float]:
    band = (0.6, 1.4)  # of the strongest frequency
    seen = np.fft.rfft(samples - samples.mean())
    frequency_hz = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    strongest_hz = float(frequency_hz[1 + np.abs(seen[1:]).argmax()])
    inside = (frequency_hz > band[0] * strongest_hz) & (frequency_hz < band[1] * strongest_hz)
    return np.fft.irfft(np.where(inside, seen, 0), len(samples)), strongest_hz


def _slope(values: Array) -> tuple[float, float]:
    """Of the line through values at 0, 1, 2, ..., with its standard deviation."""
    index = np.arange(len(values)) - (len(values) - 1) / 2
    power = (index**2).sum()
    slope = (index @ values) / power
    left = values - values.mean() - slope * index
    return float(slope), float(np.sqrt((left**2).sum() / (len(values) - 2) / power))


def proposals(samples: Array, rate_hz: float) -> tuple[OrderPoles, ...]:
    """Poles of the orders 2, 4, ... 40 of a free decay (samples, channels)."""
    rank = 1e-7  # relative size of what is left of a noise-free record, decomposed by its squares, which is quick
    most_rows, most_columns, most_states = 300, 400, 40
    count, channels = samples.shape
    rows = max(2, min(most_rows // channels, count // 2))
    columns = max(1, min(most_columns, count - rows))
    blocks = samples[np.arange(rows)[:, None] + np.arange(columns + 1)]  # (rows, columns + 1, channels)
    whole = blocks.transpose(0, 2, 1).reshape(rows * channels, columns + 1)
    early, late = whole[:, :-1], whole[:, 1:]
    squares, left = np.linalg.eigh(early @ early.T)
    sizes, left = np.sqrt(np.maximum(squares[::-1], 0.0)), left[:, ::-1]
    n = max(1, min(most_states, int((sizes > rank * sizes[0]).sum())))
    left, root = left[:, :n], np.sqrt(np.maximum(sizes[:n], 1e-300))
    transition = left.T @ late @ ((left.T @ early) / sizes[:n, None]).T / np.outer(root, root)
    observe = left[:channels] * root
    return tuple(order_poles(transition[:k, :k], observe[:, :k], rate_hz) for k in range(2, n + 1, 2))
