"""The printed values are those of the dissertation (spot checks against its text), and ours do what they claim."""

from __future__ import annotations

import numpy as np
import pytest

from logger.studies.dissertation import table_4_4, table_4_5, table_4_6
from logger.studies.drives import BUMP_MPS, Conditions, bump, record_of, until, without_profile
from logger.studies.study import Effort, studies

STUDIES = studies()


def test_the_tables_of_25_starts() -> None:
    printed = [np.array(table.PRINTED_PERCENT) for table in (table_4_4, table_4_5, table_4_6)]
    assert [one.shape for one in printed] == [(5, 5)] * 3
    assert [one[0, 1] for one in printed] == [2.04, 1.29, 1.67]
    assert [one[4, 4] for one in printed] == [2.40, 0.18, 0.33]
    assert [one[row].sum() for one, row in zip(printed, (0, 2, 1), strict=True)] == pytest.approx([8.82, 2.32, 7.48])
    assert max(one.max() for one in printed) < 3


def test_all_starts_end_alike() -> None:
    rows = STUDIES["table-4-4"].run(Effort(0.01)).tables[0].rows
    ours = np.array([row[2::2] for row in rows], dtype=float)
    assert np.ptp(ours) < 1e-4
    wide = np.array([row[2] for row in STUDIES["fig-4-22"].run(Effort(0.01)).tables[0].rows], dtype=float)
    assert np.ptp(wide) < 1e-4
    assert wide[0] == pytest.approx(875, rel=0.03)


def test_a_driver_without_a_profile() -> None:
    record = record_of(bump(8.0), BUMP_MPS, 6.0, Conditions())
    other = without_profile(record, 1.05)
    assert not other.track.elevation_m.any()
    assert np.array_equal(other.measured_mps2, record.measured_mps2)
    assert other.distance_m == pytest.approx(1.05 * record.distance_m)
    assert until(record, 10.0).distance_m[-1] == pytest.approx(10.0, abs=0.05)
