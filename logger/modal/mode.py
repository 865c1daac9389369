"""What a modal analysis says: modes with their uncertainty, and what was looked at and not believed.

A pole exp(s t) of a structure is quoted as a natural frequency |s| / 2 pi and a damping ratio -Re s / |s|. Sampled
every dt seconds the same pole is z = exp(s dt).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class FoundMode:
    """A mode that the data support, each figure with its standard deviation.

    frequency_hz, frequency_std_hz   natural frequency without regard to damping [Hz]
    damping_ratio, damping_std       share of critical damping; NaN where the method does not estimate it
    shape                            (channels,) motion of the channels, the largest 1; complex where not in step
    """

    frequency_hz: float
    damping_ratio: float
    frequency_std_hz: float
    damping_std: float
    shape: Complex = field(compare=False)


@dataclass(frozen=True)
class Rejected:
    """A pole or a peak that was found and not believed, and why, in plain words."""

    frequency_hz: float
    damping_ratio: float
    reason: str


@dataclass(frozen=True)
class ModalResult:
    """Modes, slowest first; what was rejected; the order of the model (0 where there is none); how it was done.

    diagram   poles of every order that was tried, for a stabilisation diagram
    """

    modes: tuple[FoundMode, ...]
    rejected: tuple[Rejected, ...]
    order: int
    how: str
    diagram: tuple[OrderPoles, ...] = ()


@dataclass(frozen=True)
class OrderPoles:
    """Vibrating poles s (n,) [rad/s, Im s > 0] of the model of one order, and the shapes (channels, n)."""

    order: int
    poles: Complex
    shapes: Complex


def order_poles(transition: Array, observe: Array, rate_hz: float) -> OrderPoles:
    """Vibrating poles of x[k+1] = A x[k], y[k] = C x[k]; A (n, n), C (channels, n). Real poles are left out."""
    roots, vectors = np.linalg.eig(transition)
    keep = np.flatnonzero((roots.imag > 1e-9) & (np.abs(roots) > 1e-6))
    poles = np.asarray(np.log(roots[keep].astype(np.complex128)) * rate_hz, dtype=np.complex128)
    slowest_first = np.argsort(np.abs(poles))
    shapes = observe @ vectors[:, keep[slowest_first]]
    return OrderPoles(len(transition), poles[slowest_first], shapes.astype(np.complex128))


def frequency_hz(poles: Complex) -> Array:
    """Natural frequency of poles s [rad/s]."""
    return np.abs(poles) / (2 * np.pi)


def damping_ratio(poles: Complex) -> Array:
    """Damping ratio of poles s [rad/s]."""
    return -poles.real / np.abs(poles)


def pole_rows(result: ModalResult) -> Array:
    """Order, frequency [Hz] and damping ratio of every pole of the diagram, (k, 3)."""
    rows = [np.stack([np.full(len(one.poles), float(one.order)), frequency_hz(one.poles), damping_ratio(one.poles)], 1)
            for one in result.diagram]
    return np.concatenate([np.empty((0, 3)), *rows])


def errors_of(pole: complex, covariance: Array) -> tuple[float, float]:
    """Standard deviations of frequency [Hz] and damping ratio from the covariance (2, 2) of Re s and Im s [rad/s]."""
    size = abs(pole)
    by_frequency = np.array([pole.real, pole.imag]) / (2 * np.pi * size)
    by_damping = np.array([-(pole.imag**2), pole.real * pole.imag]) / size**3
    if not np.isfinite(covariance).all():
        return float("inf"), float("inf")
    variances = [way @ covariance @ way for way in (by_frequency, by_damping)]
    return float(np.sqrt(variances[0])), float(np.sqrt(variances[1]))


def normalised(shape: Complex) -> Complex:
    """A shape turned and scaled so that its largest part is 1."""
    return np.asarray(shape / shape[np.abs(shape).argmax()], dtype=np.complex128)


def mac(first: npt.ArrayLike, second: npt.ArrayLike) -> Array:
    """Modal assurance criterion of two sets of shapes in columns, (channels, n) and (channels, m): (n, m), 0 to 1.

    |a^H b|^2 / (a^H a)(b^H b) (Allemang and Brown, 1982): 1 for shapes that differ by a factor only.
    """
    a, b = (np.asarray(shape).reshape(len(np.asarray(shape)), -1) for shape in (first, second))
    products = np.abs(a.conj().T @ b) ** 2
    return np.asarray(products / np.outer((np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0)))
