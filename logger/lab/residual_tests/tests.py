"""What a test of a model's residual is.

Problem: a residual has to be read by people who want to know whether physics is missing, and of which kind. Solution:
each test asks one question (is it coherent with the road, is the car's response proportional, does it depend on the
direction of motion ...), gives a value, its standard error where it has one, and a p-value against a residual that is
noise, and says in a sentence what it found. A test finds something when it is significant and large enough to matter.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from logger.lab.likelihood.lag import Lags, lags
from logger.lab.residuals.breakdown import Breakdown, ModelResiduals
from logger.lab.residuals.force_state_map import ForceMap, force_map

SIGNIFICANCE = 0.002
"""A test with a smaller p-value is significant: of fifteen tests of noise one is in some thirty comparisons."""
LEAST_SHARE = 0.02
"""A smaller share of the residual's power, or of a gain, does not matter. A judgement: an error of 0.1 would fall by
0.001."""
LEAST_GROWTH = 1.3
"""A residual that changes by a smaller factor is as large everywhere. A judgement."""
_IN_BAND = {**{name: f"around {name}" for name in ("body bounce", "wheel hop", "the natural frequency")},
            "all": "in the whole band"}


def in_band(name: str) -> str:
    """Where a band of a breakdown lies, for a sentence."""
    return _IN_BAND.get(name, name)


@dataclass(frozen=True)
class ResidualEvidence:
    """The residuals of a model.

    where      their power by frequency, speed, excitation and place
    unmoved    of the same car at the recorded distances, whose lags are tested
    """

    residuals: ModelResiduals
    where: Breakdown
    unmoved: ModelResiduals

    @cached_property
    def forces(self) -> ForceMap:
        """The forces that the suspensions lack."""
        return force_map(self.residuals)

    @cached_property
    def alignment(self) -> Lags:
        """By how much the measurement lags the model along the way."""
        return lags(self.unmoved.runs, self.unmoved.predictions)


@dataclass(frozen=True)
class ResidualTestResult:
    """The result of one test.

    value, unit, standard_error    of what is tested; the last where there is one; NaN where the runs are not enough
    p_value                        against noise; NaN where the runs are not enough
    large                          whether the value is large enough to matter
    road                           whether it relates the residual to the road or to the car's motion
    figures                        what else its sentence says, by name
    """

    test: "ResidualTest"
    value: float
    unit: str
    standard_error: float | None
    p_value: float
    large: bool
    road: bool
    figures: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the test."""
        return self.test.name

    @property
    def found(self) -> bool:
        """Whether the test is significant and its value large enough to matter."""
        return bool(self.p_value < SIGNIFICANCE and self.large)

    @property
    def sentence(self) -> str:
        """What it says when it finds something."""
        return self.test.sentence(self)


class ResidualTest(ABC):
    """A test.

    name     the field's
    unit     of its value
    road     whether what it finds relates the residual to the road or to the car's motion
    of_placement    whether it may be no more than where the drive lies on the road
    """

    name: str
    unit = "1"
    road = False
    of_placement = False

    @abstractmethod
    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """Test the residuals of a model; ``self.result()`` where the runs are not enough."""

    @abstractmethod
    def sentence(self, found: ResidualTestResult) -> str:
        """What it says when it finds something."""

    def result(self, value: float = np.nan, standard_error: float | None = None, p_value: float = np.nan,
               large: bool = False, *, unit: str | None = None, road: bool | None = None,
               **figures: Any) -> ResidualTestResult:
        """A result of it; ``unit`` and ``road`` where they are not always the same."""
        return ResidualTestResult(self, value, unit or self.unit, standard_error, p_value, large,
                          self.road if road is None else road, figures)


@dataclass(frozen=True)
class ResidualTests:
    """Tests of one kind; ``name`` is that of their file."""

    name: str
    tests: tuple[ResidualTest, ...]


@dataclass(frozen=True, eq=False)
class ResidualTestResults:
    """Results of all tests of a residual, with the force map and the lags that pictures show."""

    tests: tuple[ResidualTestResult, ...]
    forces: ForceMap
    alignment: Lags

    @property
    def found(self) -> tuple[ResidualTestResult, ...]:
        """Those that find something."""
        return tuple(one for one in self.tests if one.found)
