"""Which zeros go with which poles, and in which order, so that rounding between sections does the least harm.

Problem: the same filter can be cut into sections in many ways. Where a section has a high peak, its output needs a
coarse scale; where a low gain follows a high one, fine steps are thrown away. In 16 bits it decides between a
usable filter and none: as the sections of Wk at 100 Hz are stored, they would be 15 dB worse.

Solution, in two steps that each take a moment:

1. Two pairings are tried: that of the sections as they come, and one in which the poles nearest to the unit circle
   choose first, each taking the zeros with which the section's gain is flattest over frequency. (For Wk the latter is
   the best of all 5040.)
2. The order with the least noise is found exactly. The scale after some sections depends only on which they are, and
   so does what the others make of the rounding there; so the best order is the shortest way through the subsets.

Sections that are blind to a steady input stand first, though last would be 1.5 dB better: all others then see nothing
of gravity, and a car at rest gives zeros.

Source: A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal Processing, 6.9.3 (pairing and ordering).
"""

from __future__ import annotations

import math

import numpy as np

from logger.dsp.sections import BlockFilter, Floats

BLIND = 1e-12
_POINTS = 256
_FLOOR = 1e-2
_LONGEST = 1 << 14  # of responses for a choice; bounds are not taken from them


def is_blind(b: Floats) -> bool:
    """Whether a numerator b0, b1, b2 lets nothing of a steady input through."""
    return bool(abs(b.sum()) < BLIND * np.abs(b).sum())


def quiet(rows: Floats, impulse: Floats) -> Floats:
    """The same cascade, (n, 6) rows with a0 = 1, in the pairing and order for integers; gains stay with the zeros.

    impulse    (m,) 1 and then zeros, long enough for the cascade to decay
    """
    candidates = [(*_order(pairing, impulse[:_LONGEST]), pairing) for pairing in (rows, _flattest(rows))]
    _, order, pairing = min(candidates, key=lambda candidate: candidate[0])
    return pairing[order]


def _flattest(rows: Floats) -> Floats:
    delay = np.exp(-1j * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
    powers = np.array([np.ones_like(delay), delay, delay**2])
    zeros_gain, poles_gain = np.abs(rows[:, :3] @ powers), np.abs(rows[:, 3:] @ powers)
    free, paired = list(range(len(rows))), rows.copy()
    for poles in np.argsort([-np.abs(np.roots(row[3:])).max(initial=0.0) for row in rows], kind="stable"):
        unevenness = [_unevenness(zeros_gain[zeros] / poles_gain[poles]) for zeros in free]
        paired[poles, :3] = rows[free.pop(int(np.argmin(unevenness))), :3]
    return paired


def _unevenness(gain: Floats) -> float:
    return float(np.std(np.log(gain / gain.max() + _FLOOR)))


def _order(rows: Floats, impulse: Floats) -> tuple[float, list[int]]:
    """Noise of the best order [input steps squared, times 12], and the indices of the sections in it.

    Sets of sections are bit masks.
    """
    responses, steps, energies = [impulse], [1.0], [1.0]
    for members in range(1, 1 << len(rows)):
        newest = members.bit_length() - 1
        response = BlockFilter(rows[newest : newest + 1]).process(responses[members ^ 1 << newest])
        responses.append(response)
        steps.append(float(np.abs(response).sum()))
        energies.append(float(np.sum(response**2)))
    everything = len(steps) - 1
    blind = [number for number, row in enumerate(rows) if is_blind(row[:3])]
    noises, lasts = [0.0], [0]
    for members in range(1, everything + 1):
        present = [number for number in range(len(rows)) if members >> number & 1]
        noise, last = min((noises[members ^ 1 << number], number) for number in present)
        barred = len(present) == 1 and blind and last not in blind
        noises.append(math.inf if barred else noise + steps[members] ** 2 * energies[everything ^ members])
        lasts.append(last)
    order: list[int] = []
    members = everything
    while members:
        order.append(lasts[members])
        members ^= 1 << lasts[members]
    return noises[everything], order[::-1]
