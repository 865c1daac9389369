"""Cases of a parametrised test that only ``pytest -m slow`` runs, or ``pytest -m release``."""

from __future__ import annotations

from typing import Any

import pytest


def slow(*cases: object) -> list[Any]:
    """The cases, marked: a tuple is one case of several arguments."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow) for case in cases]


def release(*cases: object) -> list[Any]:
    """The same for cases that repeat what slow ones show."""
    return [pytest.param(*one.values, marks=pytest.mark.release) for one in slow(*cases)]
