"""What is wrong with a channel of a rig: an amplifier that was at its end, a cable that was out, a sign, a trigger that
came before what was to be recorded.

Problem: such records fit no car, and whatever effect imitates the fault best is named. Solution: an amplifier at its
end and a cable that is out give one number again and again, and come to it in a leap, where what turns round comes
slowly, be it rounded or not. And masses, dampers and springs are positive: a force that has the wrong sign follows the
motion as if all of them were negative, whatever else acts.
"""

import numpy as np

from logger.arrays import Array, Bools
from logger.dsp.repeated_samples import stretches_of

# So many equal samples are none by chance; the leap to them is so many of the steps that readings are written in: of a
# curve that turns round within five samples and is rounded it is one.
_EQUAL, _LEAP_STEPS = 5, 2.5
_STILL_S = 0.1
_STEADY = 0.05  # of how far it goes then: by how much what is held moves at the most (a judgement)
# Of a force's power, what mass, damper and spring explain, and of that, what negative ones do. Measured on 40 rigs with
# effects of all kinds, also with masses that no spring holds: 0.1 to 1, and 0 to 0.45; of forces turned round 1.
_FOLLOWS, _AGAINST = 0.3, 0.9
# Zeros of sensors wander below; recorders' filters begin above.
_SLOWEST_HZ, _HIGHEST_OF_RATE = 0.3, 0.37


def at_ends(samples: Array) -> Bools:
    """Which of samples (n,) stand at the largest or the smallest value, if those are come to in a leap."""
    ends = [samples == end for end in (samples.max(), samples.min())]
    return np.any([end & _is_leapt_to(samples, end) for end in ends], axis=0)


def longest_still(samples: Array, rate_hz: float) -> tuple[int, int] | None:
    """Where samples (n,) stand still, longer than in all other places together, come to in a leap; None where they do
    not for a tenth of a second. A part that slides, or has play, holds its force again and again, mostly for less."""
    same = np.diff(samples) == 0
    found = [(int(first), int(last) + 1) for first, last in zip(*stretches_of(same), strict=True)
             if last + 1 - first >= _EQUAL]
    usual = float(np.sqrt(np.mean(np.diff(samples) ** 2)))
    moves = usual > _LEAP_STEPS * _step(samples)
    longest = max(found, key=lambda one: one[1] - one[0], default=(0, 0))
    is_alone = 2 * (longest[1] - longest[0]) > sum(last - first for first, last in found)
    return longest if is_alone and moves and longest[1] - longest[0] >= _STILL_S * rate_hz else None


def goes_against(force_n: Array, motion: Array, measured: int, orders: range, rate_hz: float) -> bool:
    """Whether a force (n,) is what a negative mass, damper and spring would need for a motion (n,).

    measured    derivative of the place that the motion is
    orders      derivatives of the place that the force may follow
    """
    f_hz = np.fft.rfftfreq(len(motion), 1 / rate_hz)
    inside = (f_hz > _SLOWEST_HZ) & (f_hz < _HIGHEST_OF_RATE * rate_hz)
    taper = np.hanning(len(motion))
    force, moved = (np.fft.rfft((one - one.mean()) * taper)[inside] for one in (force_n, motion))
    columns = np.stack([moved * (2j * np.pi * f_hz[inside]) ** (order - measured) for order in orders], axis=1)
    columns, force = (np.concatenate([one.real, one.imag]) for one in (columns, force))
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    by = np.linalg.lstsq(columns, force)[0]
    parts = columns * by
    follows = 1 - np.sum((force - parts.sum(axis=1)) ** 2) / max(np.sum(force**2), 1e-300)
    return bool(follows > _FOLLOWS and np.sum(parts[:, by < 0] ** 2) > _AGAINST * np.sum(parts**2))


def released_at(samples: Array) -> int:
    """The first of the samples (n,) of a free decay after it was held still; 0 where it was not. What is let go is half
    way of its farthest a quarter of a period later, or at once: up to there, what is held has a variance and what moves
    a larger one (maximum likelihood of one change, which Schwarz's criterion asks for), and what was held was so for
    longer than that lasts, and the rest of the way to the farthest, and stood still by what moves."""
    away = samples - samples[0]
    farthest = float(np.abs(away).max())
    half_way = int(np.argmax(np.abs(away) >= 0.5 * farthest))
    firsts = np.arange(_EQUAL, half_way + 1)
    if not len(firsts):
        return 0
    sums, squares = (np.concatenate([[0.0], np.cumsum(one[:half_way])]) for one in (away, away**2))
    levels, rest = sums[firsts] / firsts, half_way - firsts
    held = np.maximum(squares[firsts] / firsts - levels**2, (_STEADY**2 * farthest) ** 2)  # it may be all one number
    moving = squares[half_way] - squares[firsts] - 2 * levels * (sums[half_way] - sums[firsts]) + rest * levels**2
    moving = np.maximum(np.divide(moving, rest, out=held.copy(), where=rest > 0), held)
    cost = firsts * np.log(held) + rest * np.log(moving) + 2 * np.log(half_way) * (rest > 0)
    best = int(np.argmin(cost))
    first = int(firsts[best])
    swings = max(half_way - first, int(np.argmax(np.abs(away))) - half_way)
    return first if first > swings and held[best] < (_STEADY * farthest) ** 2 else 0


def _is_leapt_to(samples: Array, at: Bools) -> bool:
    """Whether a quarter of the long stretches in which a mask (n,) holds, or more, are come to, or left, in a leap."""
    leap = _LEAP_STEPS * _step(samples)
    change = np.abs(np.diff(samples, prepend=samples[:1], append=samples[-1:]))
    leaps = [max(change[first], change[last]) > leap for first, last in zip(*stretches_of(at), strict=True)
             if last - first >= _EQUAL]
    return bool(leaps) and 4 * sum(leaps) >= len(leaps)


def _step(samples: Array) -> float:
    """The least change of samples (n,) that is one."""
    change = np.abs(np.diff(samples))
    return float(change[change > 1e-9 * np.ptp(samples)].min(initial=np.inf)) if np.ptp(samples) else 0.0
