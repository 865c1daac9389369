"""The two tests of residuals: right when all is well, and not when something is left."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import kstest

from logger.identification.noise_models import autocorrelation, cross_correlation

GENERATOR = np.random.default_rng(11)


def test_probabilities_are_even_when_all_is_well() -> None:
    white = GENERATOR.standard_normal((200, 2, 400))
    inputs = lfilter([1.0], [1.0, -0.7], GENERATOR.standard_normal((400, 2)), axis=0)
    sensitivities = GENERATOR.standard_normal((800, 2))
    for values in (
        [autocorrelation(list(one), 0).p_value for one in white],
        [cross_correlation(list(one), [inputs, inputs[::-1]], sensitivities).p_value for one in white],
    ):
        assert kstest(values, "uniform").pvalue > 0.001


def test_likeness_of_neighbours_shows() -> None:
    coloured = lfilter([1.0], [1.0, -0.3], GENERATOR.standard_normal(500))
    found = autocorrelation([coloured], 2)
    assert (found.degrees, found.passed) == (25, False)


def test_what_an_input_left_shows_unless_the_fit_may_explain_it() -> None:
    road = GENERATOR.standard_normal((500, 1))
    echo = 0.4 * np.roll(road[:, 0], 3)
    residual = GENERATOR.standard_normal(500) + echo
    assert not cross_correlation([residual], [road], np.zeros((500, 1))).passed
    fitted = residual - echo * (residual @ echo) / (echo @ echo)
    assert cross_correlation([fitted], [road], echo[:, None]).passed


def test_nothing_to_test() -> None:
    assert autocorrelation([np.zeros(100)], 0).degrees == 0
    found = cross_correlation([np.ones(100)], [np.zeros((100, 2))], np.ones((100, 1)))
    assert np.isnan(found.p_value)
    assert found.passed
    assert autocorrelation([np.ones(20)], 25).p_value != pytest.approx(0)
