"""A tone in noise is heard; noise alone rings no more often than it is said to."""

import numpy as np

from logger.lab.residuals.statistics import periodogram, strongest_line


def test_a_sine_is_heard_where_it_is() -> None:
    time = np.arange(2000)
    noise = np.random.default_rng(1).normal(0, 1, 2000)
    found = strongest_line(periodogram(noise + 0.3 * np.sin(2 * np.pi * 0.123 * time)))
    assert found is not None
    assert found[0] == round(0.123 * 2000) and found[1] < 1e-3


def test_noise_of_any_colour_is_no_tone() -> None:
    rng = np.random.default_rng(2)
    heard = 0
    for _ in range(300):
        noise = rng.normal(0, 1, 2000)
        found = strongest_line(periodogram(noise + np.convolve(noise, np.ones(8), "same")))
        heard += found is not None and found[1] < 0.05
    assert heard < 0.05 * 300 + 3 * np.sqrt(0.05 * 300)


def test_only_what_is_asked_is_reported() -> None:
    sine = np.sin(2 * np.pi * 0.123 * np.arange(2000))
    high = np.arange(1001) > 500
    found = strongest_line(periodogram(sine + np.random.default_rng(3).normal(0, 1, 2000)), high)
    assert found is not None and found[0] > 500
    assert strongest_line(periodogram(np.zeros(2000))) is None
