"""Rows to report on."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from logger.records import WindowRecord

from ..support.drives.logged_rows import rows_of_drive

Drive = Callable[..., list[WindowRecord]]


@pytest.fixture
def drive() -> Drive:
    """A maker of drives, as ``rows_of_drive``."""
    return rows_of_drive
