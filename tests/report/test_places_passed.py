"""Places that several drives passed, beside means done by hand."""

from __future__ import annotations

import numpy as np
import pytest

from logger.report.page import track_views
from logger.report.placed import placed, places_passed
from logger.report.summary import date_words, summarise

from ..support.drives.logged_rows import repeated_drives


@pytest.mark.parametrize("lat_deg, lon_deg", [(46.5, 6.5), (-33.9, 151.2), (-17.0, 179.9985)])
def test_windows_of_drives_over_one_street_share_their_places(lat_deg: float, lon_deg: float) -> None:
    rows = repeated_drives(2, 40, (2.0, 2.0), lat_deg, lon_deg)
    found = places_passed([rows[:40], rows[40:]])
    assert found is not None
    inside = found.place[2:38].astype(int)
    assert (found.drives[inside] == 2).all()
    np.testing.assert_array_equal(found.place[2:38], found.place[42:78])
    np.testing.assert_allclose(found.iri_m_per_km[inside], 2.0)
    # Passes that do not differ at all have all of their error alike.
    np.testing.assert_allclose(found.iri_std_m_per_km[inside], 0.2, rtol=0.05)


def test_one_drive_has_no_places_in_common() -> None:
    rows = repeated_drives(1, 20, (2.0,))
    assert places_passed([rows]) is None
    there, apart = rows, repeated_drives(1, 20, (2.0,), lat_deg=47.0)
    found = places_passed([there, apart])
    assert found is not None
    assert np.isnan(found.place).all()


def test_rows_without_an_iri_and_empty_drives_are_borne() -> None:
    rows = repeated_drives(2, 10, (2.0, 3.0))
    for one in rows:
        object.__setattr__(one, "iri_m_per_km", None)
    found = places_passed([rows[:10], rows[10:], []])
    assert found is not None
    assert np.isnan(found.place).all()
    assert not len(found.iri_m_per_km)


@pytest.mark.parametrize(("length_m", "can_be"), [(7.62, True), (1000.0, True), (1e9, False), (0.0, False)])
def test_a_row_that_is_longer_than_any_window_has_no_place(length_m: float, can_be: bool) -> None:
    """One of 1e9 m, damaged, took 23 GB of memory, as it was cut into places of 25 ft."""
    row = repeated_drives(1, 1, (2.0,))[0]
    object.__setattr__(row, "distance_end_m", row.distance_start_m + length_m)
    assert placed(row) is can_be


def test_a_page_of_too_many_windows_says_that_drives_lie_over_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = repeated_drives(2, 20, (2.0, 3.0))
    drives = [date_words(summarise(rows[part])) for part in (slice(20), slice(20, None))]
    assert "colour shows their mean" in str(track_views(rows, summarise(rows), "", drives))
    monkeypatch.setattr("logger.report.page.MOST_ROWS", 30)
    page = str(track_views(rows, summarise(rows), "", drives))
    assert "More than 30 windows" in page and "ridelog passes" in page and "colour is that of" not in page
