"""Tests of a model's residual: a file in this folder is the whole registration (``drivers.catalogue``).

What a file has to offer stands in ``tests.py``. None of them knows an effect.
"""

from functools import cache

from drivers.catalogue import offers
from logger.lab.residual_tests.tests import ResidualEvidence, ResidualTest, ResidualTestResults


@cache
def residual_tests() -> tuple[ResidualTest, ...]:
    """Every test, by kind. CatalogueError for a file or an installed package that offers none."""
    return tuple(test for kind in offers(__name__, "TESTS").values() for test in kind.tests)


def run_residual_tests(tested: ResidualEvidence) -> ResidualTestResults:
    """The results of every test."""
    return ResidualTestResults(tuple(test.run(tested) for test in residual_tests()), tested.forces, tested.alignment)
