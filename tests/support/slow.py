"""Cases of a parametrised test that only ``pytest -m slow`` runs."""

from __future__ import annotations

from typing import Any

import pytest


def slow(*cases: object) -> list[Any]:
    """The cases, marked: a tuple is one case of several arguments."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow) for case in cases]
