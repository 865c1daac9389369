"""How late a receiver's fixes are, learned from braking and accelerating.

Problem: an accelerometer feels the car brake at once; the receiver's speed shows it later, by an unknown 0.05 to 0.3 s.
Which way the sensor points is not known either, the receiver's speed has noise, and the sensor takes a hill for
acceleration and is rounded to steps of 0.6 m/s2.

Solution: speeds are held against integrated acceleration, never differentiated. With fix times t_k, speeds z_k,
specific force f (3,) and delay d

    z_k = w . I(t_k - d) + B(t_k) + e_k,        I(t) = integral of f from the block's start to t

w (3,) is the forward direction in the sensor's frame, times its unit. B takes up what the sensor feels and is no change
of speed: a straight line that is free in each block (start speed; offset, gravity), a random walk (noise, rounding and
vibration of the sensor, lasting errors of the receiver) and the integral of a smooth random acceleration (hills, whose
slope changes within ``HILL_S``). e_k is the receiver's noise; fixes that do not fit get less weight (Student's t [1],
by repeated weighting). All but d is linear, so a block is

    A(d) = X' P X,  b(d) = X' P z        X(d): rows I(t_k - d); P: inverse covariance of B + e, without the line [2]

at each delay of a grid, and blocks and drives add up: memory is bounded. For a delay the best w stands upright to
gravity, and leaves the misfit J(d) = c - b' A^-1 b: its lowest point is the delay, its curvature gives the error. The
noise is not as assumed, so the error is also taken from what happens when a share of the blocks is left out (jackknife
[3]); the larger one counts. The strengths of B and e are chosen out of ``STRENGTHS`` by likelihood, as blocks come.

What is learned is the delay of the *speed* against the accelerometer as it is read, with the low-pass of its chip: what
puts both on one clock. ``FLOOR_S`` is for what no fit shows: the car's body pitches late when it brakes, and the sensor
with it (0.005 s too little in simulated cars that pitch by 4 degrees per g).

[1] K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, JASA 84, 1989.
[2] H. D. Patterson, R. Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika 58, 1971.
[3] B. Efron, C. Stein, The jackknife estimate of variance, Annals of Statistics 9, 1981.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import hypot, sqrt

import numpy as np

from logger.arrays import Array
from logger.estimation.time_grid import SLOWEST_MPS

Strength = tuple[float, float, float, float]
Rows = tuple[Array, Array, Array]

DELAYS_S = np.round(np.arange(-0.20, 1.2001, 0.02), 2)
"""Delays that are looked at [s]; at an end of them nothing is said."""
BLOCK_S = 40.0
GROUPS = 12
"""Blocks in turn belong to one of so many groups, each of which is left out once."""
FEWEST_BLOCKS = 6
FEWEST_FIXES = 10
EARLY_BLOCKS = 8
"""So many are kept, and weighed once more when all of them have given the delay: at first it is a guess."""
THINNED_S = 0.5
"""Fixes that come faster than this are averaged: their noise is not independent."""
LONGEST_HOLE_S = 0.1
FLOOR_S = 0.007
KNOWN_STD_S = 0.05
"""A delay whose standard error is larger than this is not known."""
HILL_S = (3.0, 9.0)
STRENGTHS = tuple(product((0.03, 0.06, 0.12, 0.24), (1e-4, 3e-3, 3e-2), (0.05, 0.15, 0.4), HILL_S))
"""r.m.s. of e [m/s]; variance of the random walk per second [(m/s)2/s]; r.m.s. of the hills [m/s2], their time [s]."""
_USUAL = (0.12, 3e-3, 0.15, 9.0)
FREEDOM = 4.0
"""Of Student's t, of what a receiver says: one in twenty lies beyond three deviations."""
_ROUNDS = 3
_SEEN = 25.0
_NEAR = 3


@dataclass(frozen=True)
class Stretch:
    """Readings and fixes of some tens of seconds.

    time_s         (n,) times of readings [s], increasing
    accel          (n, 3) readings along the sensor's axes, in any unit
    fix_time_s     (k,) times of fixes, each too late by the delay [s]; those not covered by readings are left out
    speed_mps      (k,) their speeds [m/s]
    """

    time_s: Array
    accel: Array
    fix_time_s: Array
    speed_mps: Array


@dataclass(frozen=True)
class DelayInformation:
    """What blocks tell: ``a`` (g, d, 3, 3) and ``b`` (g, d, 3) by group and delay; ``gravity`` (3,) sum of
    the blocks' mean readings; their number; ``log_likelihood`` (s,) of each of ``STRENGTHS``; the first blocks."""

    a: Array
    b: Array
    gravity: Array
    blocks: int
    log_likelihood: Array
    early: "tuple[BlockInformation, ...]" = ()

    @classmethod
    def none(cls) -> "DelayInformation":
        """Before the first block."""
        d = len(DELAYS_S)
        return cls(np.zeros((GROUPS, d, 3, 3)), np.zeros((GROUPS, d, 3)), np.zeros(3), 0,
                   np.zeros(len(STRENGTHS)))


@dataclass(frozen=True)
class DelayEstimate:
    """delay_s, std_s    of the fixes [s], with its standard error; None where it is not known: ``reason`` says why
    forward             (3,) unit vector: forward in the sensor's frame; None: not known
    forward_std_rad     its standard error about the vertical [rad]
    gain                readings per m/s2 of the car; below 1 also where readings are noisy
    """

    delay_s: float | None = None
    std_s: float | None = None
    forward: Array | None = None
    forward_std_rad: float | None = None
    gain: float | None = None
    reason: str = ""


@dataclass(frozen=True)
class CarriedDelay:
    """A delay as a normal distribution [s], from this many drives; what one drive leaves to the next."""

    delay_s: float
    std_s: float
    drives: int = 0


UNKNOWN = CarriedDelay(0.14, 0.07)
"""Before anything was learned: receivers are late by 0.05 to 0.3 s. Mean and deviation of what is as likely from each
value to twice that."""


@dataclass(frozen=True)
class BlockInformation:
    """Information of one block: ``a`` (d, 3, 3), ``b`` (d, 3), mean reading (3,), ``log_likelihood`` (s,); and
    what it was made of: ``rows`` X (d, k, 3), z (k,), t (k,)."""

    a: Array
    b: Array
    mean: Array
    log_likelihood: Array
    rows: Rows


def block_information(known: DelayInformation, stretch: Stretch) -> BlockInformation | None:
    """Information of a stretch, its fixes weighed by what is known. None: the car hardly moves, or the readings have a
    hole."""
    rows = _rows(stretch)
    return _weighed(known, rows, stretch.accel.mean(axis=0)) if len(rows[1]) >= FEWEST_FIXES else None


def _weighed(known: DelayInformation, rows: Rows, mean: Array) -> BlockInformation:
    x, z, t_s = rows
    strength = STRENGTHS[int(np.argmax(known.log_likelihood))] if known.blocks else _USUAL
    weight, residual = np.ones(len(z)), z
    so_far = known.a.sum(axis=0), known.b.sum(axis=0)
    for _ in range(_ROUNDS):
        a, b = _sums(x, z, t_s, strength, weight)
        index, w = _best(so_far[0] + a, so_far[1] + b, known.gravity + mean, known.blocks >= FEWEST_BLOCKS)
        residual = z - x[index] @ w
        weight = _weights(residual, t_s, strength, weight)
    likelihood = _log_likelihoods(residual, t_s, STRENGTHS, weight)
    return BlockInformation(*_sums(x, z, t_s, strength, weight), mean, likelihood, rows)


def with_block(known: DelayInformation, block: BlockInformation) -> DelayInformation:
    """Add the information of a block."""
    known = replace(_added(known, block), early=(*known.early, block) if known.blocks < EARLY_BLOCKS else ())
    if known.blocks != EARLY_BLOCKS:
        return known
    again = DelayInformation.none()
    for early in known.early:
        again = _added(again, _weighed(known, early.rows, early.mean))
    return again


def _added(known: DelayInformation, block: BlockInformation) -> DelayInformation:
    a, b, group = known.a.copy(), known.b.copy(), known.blocks % GROUPS
    a[group], b[group] = a[group] + block.a, b[group] + block.b
    return DelayInformation(a, b, known.gravity + block.mean, known.blocks + 1,
                            known.log_likelihood + block.log_likelihood)


def estimate(known: DelayInformation) -> DelayEstimate:
    """The delay that fits best, or why there is none."""
    if known.blocks < FEWEST_BLOCKS:
        return DelayEstimate(reason="not enough driving yet")
    a, b = known.a.sum(axis=0), known.b.sum(axis=0)
    found = _lowest(a, b, known.gravity)
    if found is None:
        return DelayEstimate(reason="too little braking and accelerating, or the sensor does not feel it")
    delay_s, curved_std_s, index, w = found
    others = [_lowest(a - known.a[g], b - known.b[g], known.gravity) for g in range(min(known.blocks, GROUPS))]
    left_out = [other for other in others if other is not None]
    if len(left_out) < len(others):
        return DelayEstimate(reason="too little braking and accelerating to estimate the delay")
    share = (len(left_out) - 1) / len(left_out)
    jackknife_s = sqrt(share * sum((other[0] - delay_s) ** 2 for other in left_out))
    unsure = sqrt(1 + 2 / max(len(left_out) - 3, 1))  # as wide as Student's t: the error itself is from few groups
    std_s = hypot(unsure * max(curved_std_s, jackknife_s), FLOOR_S)
    size = float(np.linalg.norm(w))
    forward = w / size
    turned = [float(np.linalg.norm(np.cross(forward, other[3] / np.linalg.norm(other[3])))) for other in left_out]
    forward_std = max(sqrt(share * sum(angle**2 for angle in turned)), _curved_forward_std(a[index], known.gravity, w))
    if std_s > KNOWN_STD_S:
        return DelayEstimate(None, None, forward, forward_std, 1 / size, "too little braking and accelerating: the "
                             f"delay is {delay_s:.2f} ± {std_s:.2f} s so far")
    return DelayEstimate(delay_s, std_s, forward, forward_std, 1 / size)


def forward_of(part: DelayInformation, known: DelayInformation) -> tuple[Array | None, float | None]:
    """Forward (3,) by some blocks alone, with the delay of all, and its error about the vertical [rad]; or None."""
    index, _ = _best(known.a.sum(axis=0), known.b.sum(axis=0), known.gravity, known.blocks >= FEWEST_BLOCKS)
    a, b = part.a.sum(axis=0), part.b.sum(axis=0)
    explained, w = _profile(a, b, part.gravity)
    if explained[index] < _SEEN:
        return None, None
    return w[index] / float(np.linalg.norm(w[index])), _curved_forward_std(a[index], part.gravity, w[index])


def combined(before: CarriedDelay, found: DelayEstimate, drift_s: float = 0.01) -> CarriedDelay:
    """What is known after a drive: both weighed by their errors. ``drift_s``: so much may the delay have changed since;
    what differs by more than four errors is another receiver, or other settings of it, and counts alone."""
    if found.delay_s is None or found.std_s is None:
        return before
    before_std_s = hypot(before.std_s, drift_s) if before.drives else before.std_s
    if before.drives and abs(found.delay_s - before.delay_s) > 4 * hypot(before_std_s, found.std_s):
        return CarriedDelay(found.delay_s, found.std_s, 1)
    weight = before_std_s**2 / (before_std_s**2 + found.std_s**2)
    std_s = max(found.std_s * sqrt(weight), FLOOR_S)
    return CarriedDelay(before.delay_s + weight * (found.delay_s - before.delay_s), std_s, before.drives + 1)


# --- one block ---


def _rows(stretch: Stretch) -> Rows:
    """Rows X (d, k, 3), speeds z (k,) [m/s] and times (k,) [s], thinned and without what is too slow."""
    nothing = np.empty((len(DELAYS_S), 0, 3)), np.empty(0), np.empty(0)
    if len(stretch.time_s) < 2 or np.max(np.diff(stretch.time_s)) > LONGEST_HOLE_S:
        return nothing
    slow = np.concatenate([[False], stretch.speed_mps < SLOWEST_MPS, [False]])
    stands = slow[:-2] & slow[1:-1] & slow[2:]
    inside = (stretch.fix_time_s - DELAYS_S[-1] >= stretch.time_s[0]) & \
        (stretch.fix_time_s - DELAYS_S[0] <= stretch.time_s[-1]) & (stands | ~slow[1:-1])
    t_s, z = stretch.fix_time_s[inside], stretch.speed_mps[inside]
    if np.count_nonzero(z >= SLOWEST_MPS) < FEWEST_FIXES:
        return nothing
    felt = stretch.accel - stretch.accel.mean(axis=0)
    steps_s = np.diff(stretch.time_s)[:, None]
    gone = np.vstack([np.zeros(3), np.cumsum(0.5 * steps_s * (felt[1:] + felt[:-1]), axis=0)])
    at = t_s[None, :] - DELAYS_S[:, None]
    x = np.stack([np.interp(at, stretch.time_s, gone[:, axis]) for axis in range(3)], axis=-1)
    bins = np.floor((t_s - t_s[0]) / THINNED_S + 1e-6).astype(np.int64)
    first = np.flatnonzero(np.diff(bins, prepend=-1))
    size = np.diff(first, append=len(bins))
    mean = np.add.reduceat(x, first, axis=1) / size[None, :, None]
    return mean, np.add.reduceat(z, first) / size, np.add.reduceat(t_s, first) / size


def _covariances(t_s: Array, strengths: Sequence[Strength], weight: Array) -> Array:
    """Of B without its line, plus e: (s, k, k) [(m/s)2], from a block's start. An acceleration whose covariance over a
    time u is ``s^2 (1 + u/T) exp(-u/T)`` makes a speed of covariance ``H(t) + H(t') - H(|t - t'|)``, with H'' that."""
    since = t_s - t_s[0]
    apart = np.abs(since[:, None] - since)

    def hills(hill_s: float) -> Array:
        since_h, apart_h = (hill_s**2 * (2 * x - 3 + (3 + x) * np.exp(-x)) for x in (since / hill_s, apart / hill_s))
        return np.asarray(since_h[:, None] + since_h - apart_h)

    walks = np.minimum.outer(since, since)
    by_time = {hill_s: hills(hill_s) for hill_s in {one[3] for one in strengths}}
    covariances = np.stack([walk * walks + hill_mps2**2 * by_time[hill_s] for _, walk, hill_mps2, hill_s in strengths])
    noise_mps = np.array([one[0] for one in strengths])
    at = np.arange(len(t_s))
    covariances[:, at, at] += noise_mps[:, None] ** 2 / weight
    return covariances


def _line(t_s: Array) -> Array:
    """Any straight line is one of these columns (k, 2)."""
    middle = t_s - t_s.mean()
    return np.stack([np.ones(len(t_s)), middle / max(float(np.std(middle)), 1e-3)], axis=1)


def _whitened(t_s: Array, strengths: Sequence[Strength], weight: Array, columns: Array) -> tuple[Array, Array]:
    """Columns (k, m) made white and freed of the line by each of the strengths, (s, k, m), and half the logarithms of
    the determinants of what they were (s,)."""
    roots = np.linalg.cholesky(_covariances(t_s, strengths, weight))
    both = np.linalg.solve(roots, np.hstack([_line(t_s), columns]))
    basis, triangle = np.linalg.qr(both[..., :2])
    rest = both[..., 2:]
    white = rest - basis @ (np.swapaxes(basis, 1, 2) @ rest)
    root, line = (np.log(np.abs(np.diagonal(one, axis1=1, axis2=2))).sum(axis=1) for one in (roots, triangle))
    return white, root + line


def _sums(x: Array, z: Array, t_s: Array, strength: Strength, weight: Array) -> tuple[Array, Array]:
    """A (d, 3, 3) and b (d, 3) of a block."""
    d, k, _ = x.shape
    (white,), _ = _whitened(t_s, [strength], weight, np.column_stack([z, x.transpose(1, 0, 2).reshape(k, d * 3)]))
    rows = white[:, 1:].reshape(k, d, 3)
    return np.einsum("kdi,kdj->dij", rows, rows), np.einsum("kdi,k->di", rows, white[:, 0])


def _log_likelihoods(residual: Array, t_s: Array, strengths: Sequence[Strength], weight: Array) -> Array:
    """Of residuals (k,) for each of the strengths (s,), whatever line is in them."""
    white, half_log = _whitened(t_s, strengths, weight, residual[:, None])
    return np.asarray(-0.5 * (white**2).sum(axis=(1, 2)) - half_log)


def _weights(residual: Array, t_s: Array, strength: Strength, weight: Array) -> Array:
    """Weights (k,) of fixes by Student's t: of what each is off from what the others say."""
    inverse = np.linalg.inv(_covariances(t_s, [strength], weight)[0])
    line = _line(t_s)
    inverse -= inverse @ line @ np.linalg.solve(line.T @ inverse @ line, line.T @ inverse)
    spread = np.maximum(np.diag(inverse), 1e-9)
    off = (inverse @ residual) / spread  # from what the others say, whose variance is 1 / spread
    variance = 1 / spread - strength[0] ** 2 / weight + strength[0] ** 2
    return (FREEDOM + 1) / (FREEDOM + off**2 / np.maximum(variance, 1e-9))


# --- all blocks ---


def _level(gravity: Array) -> Array:
    """Two directions (3, 2) that stand upright to gravity."""
    up = gravity / max(float(np.linalg.norm(gravity)), 1e-12)
    _, _, rows = np.linalg.svd(up[None, :])
    return rows[1:].T


def _profile(a: Array, b: Array, gravity: Array) -> tuple[Array, Array]:
    """What the acceleration explains at each delay (d,), and the best w (d, 3)."""
    level = _level(gravity)
    inner = np.einsum("ip,dij,jq->dpq", level, a, level)
    inner += 1e-9 * np.trace(inner, axis1=1, axis2=2)[:, None, None] * np.eye(2) + 1e-12 * np.eye(2)
    upright = b @ level
    y = np.linalg.solve(inner, upright[:, :, None])[:, :, 0]
    return np.sum(upright * y, axis=1), y @ level.T


def _best(a: Array, b: Array, gravity: Array, is_learned: bool) -> tuple[int, Array]:
    """Index of the best delay and its w; while little has been driven, of a usual delay."""
    explained, w = _profile(a, b, gravity)
    index = int(np.argmax(explained)) if is_learned else int(np.argmin(np.abs(DELAYS_S - UNKNOWN.delay_s)))
    return index, w[index]


def _lowest(a: Array, b: Array, gravity: Array) -> tuple[float, float, int, Array] | None:
    """Delay [s], its error by the curvature [s], its index and w (3,). None: no lowest point within the grid."""
    explained, w = _profile(a, b, gravity)
    index = int(np.argmax(explained))
    if explained[index] < _SEEN or not _NEAR <= index < len(DELAYS_S) - _NEAR:
        return None
    near = slice(index - _NEAR, index + _NEAR + 1)
    off_s = DELAYS_S[near] - DELAYS_S[index]
    square, slope, _ = np.polyfit(off_s, explained[near], 2)
    if square >= 0:
        return None
    shift_s = float(np.clip(-slope / (2 * square), off_s[0], off_s[-1]))
    return float(DELAYS_S[index]) + shift_s, sqrt(-1 / square), index, w[index]


def _curved_forward_std(a: Array, gravity: Array, w: Array) -> float:
    """Error of the direction of w about the vertical [rad], by the curvature."""
    level = _level(gravity)
    y = level.T @ w
    across = np.array([-y[1], y[0]]) / float(np.linalg.norm(y))
    inverse = np.linalg.inv(level.T @ a @ level + 1e-12 * np.eye(2))
    return sqrt(float(across @ inverse @ across)) / float(np.linalg.norm(y))
