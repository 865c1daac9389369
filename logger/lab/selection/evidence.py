"""The score by which models are chosen, and when a gain in it says that an effect is there.

Problem: among twenty candidates at some hundred values, one always gains by chance, and where something unknown is
missing several gain a little by imitating it. Solution: models are scored by their evidence, in which each number
counts (``LinearModel.score``). A ratio of evidences of B or more comes by chance in less than one of B cases (A.
Markov's inequality; V. Vovk and R. Wang, Annals of Statistics 49, 2021, call it an e-value), so that 1 / B times the
number of candidates bounds how often noise alone looks like any of them (Bonferroni). That bound holds whatever is
compared, but it is far from sharp. Where noise alone is there, twice the log of a likelihood ratio is distributed as
chi-squared with as many degrees of freedom as numbers were fitted (S. S. Wilks, Annals of Mathematical Statistics 9,
1938); a number that means nothing where the effect is not there, such as a frequency, is looked for from several
starts, each of which is one more trial (R. B. Davies, Biometrika 74, 1987). The smaller of the two is the probability.
What is unmodelled competes as well: an effect has to gain more than imitations do.
"""

from __future__ import annotations

import numpy as np

FALSE_ALARM = 0.001
"""Probability, at most, that noise alone looks like an effect, all candidates together. A judgement: one false name in
a thousand diagnoses."""
IMITATION = 0.1
"""An effect that gains a smaller share of what a full explanation would may only imitate what is missing. A
judgement."""
INDISTINGUISHABLE = 10.0
"""Models whose scores differ by less cannot be distinguished (R. E. Kass and A. E. Raftery 1995: 2 ln B > 10 is very
strong evidence)."""


def probability_by_chance(gain: float, candidates: int) -> float:
    """Bound on the probability that noise alone gains so much, in minus twice the log of the evidence, with any of so
    many candidates."""
    return float(min(1.0, candidates * np.exp(-0.5 * max(gain, 0.0))))


def probability_of_likelihood_gain(gain: float, numbers: int, trials: int) -> float:
    """Probability that noise alone gains so much, in minus twice the log-likelihood, by so many fitted numbers with any
    of so many trials; one without a number is bounded by one with one."""
    from scipy.special import gammaincc

    return float(min(1.0, trials * gammaincc(max(numbers, 1) / 2, max(gain, 0.0) / 2)))


def min_gain(candidates: int) -> float:
    """Gain above which that probability is below ``FALSE_ALARM``."""
    return float(2 * np.log(candidates / FALSE_ALARM))
