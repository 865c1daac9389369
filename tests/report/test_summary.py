"""A drive in figures, against figures worked out by hand."""

import json
from math import inf, sqrt

import pytest

from logger.report.summary import IRI_CLASSES, class_limits_m_per_km, summarise, summary_json
from logger.roads.iso8608 import iri_class


def test_lengths_weigh_and_not_rows(drive) -> None:
    long_row = {"distance_end_m": 40.0, "iri_m_per_km": 5.0, "iri_class": "B", "a_w_mps2": 0.6, "duration_s": 1.5,
                "comfort": "fairly_uncomfortable"}
    summary = summarise(drive(2, {1: long_row}))
    assert summary.distance_m == 40.0
    assert summary.duration_s == 2.0
    assert summary.mean_speed_mps == 20.0
    assert summary.mean_iri_m_per_km == pytest.approx((2 * 10 + 5 * 30) / 40)
    assert summary.a_w_mps2 == pytest.approx(sqrt((0.3**2 * 0.5 + 0.6**2 * 1.5) / 2))
    assert [(share.name, share.distance_m, share.share) for share in summary.iri_classes] == [
        ("A", 10.0, 0.25), ("B", 30.0, 0.75)]
    assert [(share.name, share.share) for share in summary.comfort] == [
        ("not_uncomfortable", 0.25), ("a_little_uncomfortable", 0.0), ("fairly_uncomfortable", 0.75)]


def test_what_is_not_known_is_a_share_of_its_own_and_in_no_mean(drive) -> None:
    unknown = {"iri_m_per_km": None, "iri_class": "", "a_w_mps2": None, "comfort": ""}
    summary = summarise(drive(4, {3: unknown}))
    assert summary.mean_iri_m_per_km == pytest.approx(2.0)
    assert summary.a_w_mps2 == pytest.approx(0.3)
    assert [(share.name, share.share) for share in summary.iri_classes] == [("A", 0.75), ("", 0.25)]


def test_a_window_by_time_has_no_length(drive) -> None:
    blind = {"distance_start_m": None, "distance_end_m": None, "speed_mps": None, "duration_s": 5.0,
             "flags": ("blind",)}
    summary = summarise(drive(3, {1: blind}))
    assert (summary.distance_m, summary.duration_s, summary.blind_s) == (20.0, 6.0, 5.0)
    assert summary.mean_speed_mps == 20.0
    assert summary.flags == {"blind": 1}


def test_times_are_of_the_first_and_last_row_that_have_one(drive) -> None:
    fields = summary_json(summarise(drive(5, {0: {"utc_us": None}})))
    assert (fields["start_utc"], fields["end_utc"]) == ("2025-05-17T14:02:00.500Z", "2025-05-17T14:02:02.500Z")
    assert fields["roughest"][0]["utc"] is None
    json.dumps(fields, allow_nan=False)


def test_of_rough_places_near_each_other_the_worst_is_named(drive) -> None:
    iri = {10: 20.0, 11: 22.0, 14: 21.0, 17: 19.0, 60: 9.0}
    rough = {index: {"iri_m_per_km": value} for index, value in iri.items()}
    places = summarise(drive(100, rough)).roughest
    assert [place.iri_m_per_km for place in places] == [22.0, 19.0, 9.0, 2.0, 2.0]
    assert [place.along_m for place in places[:3]] == [115.0, 175.0, 605.0]


def test_a_place_driven_twice_is_one_place(drive) -> None:
    there = drive(100, {20: {"iri_m_per_km": 20.0}})
    back = drive(100, {79: {"iri_m_per_km": 18.0, "lat_deg": there[20].lat_deg}}, number=2)
    assert [place.iri_m_per_km for place in summarise(there + back).roughest][:2] == [20.0, 2.0]


def test_without_positions_places_are_distinguished_along_the_way(drive) -> None:
    rows = drive(30, {index: {"lat_deg": None, "lon_deg": None, "iri_m_per_km": 3.0 + index} for index in range(30)})
    assert [place.along_m for place in summarise(rows).roughest] == [295.0, 245.0, 195.0, 145.0, 95.0]


@pytest.mark.parametrize("flag", ["unsettled", "gap", "partial", "stationary"])
def test_a_doubtful_window_is_no_rough_place(drive, flag: str) -> None:
    rows = drive(3, {1: {"iri_m_per_km": 50.0, "flags": (flag,)}})
    assert all(place.iri_m_per_km == 2.0 for place in summarise(rows).roughest)


def test_an_unsettled_window_is_in_no_mean_and_no_share(drive) -> None:
    """The first of a drive may read 19.5 m/km."""
    wild = {"iri_m_per_km": 19.5, "iri_class": "H", "a_w_mps2": 9.0, "comfort": "extremely_uncomfortable"}
    plain, counted = summarise(drive(20)[1:]), summarise(drive(20, {0: wild}))
    started = summarise(drive(20, {0: wild | {"flags": ("partial", "unsettled")}}))
    assert started.mean_iri_m_per_km == pytest.approx(plain.mean_iri_m_per_km)
    assert started.a_w_mps2 == pytest.approx(plain.a_w_mps2)
    assert counted.mean_iri_m_per_km > 1.3 * plain.mean_iri_m_per_km
    assert [share.name for share in started.iri_classes] == [*(one.name for one in plain.iri_classes), ""]
    assert [share.name for share in started.comfort] == [*(one.name for one in plain.comfort), ""]
    assert (started.windows, started.distance_m) == (20, counted.distance_m)
    assert summarise(drive(1, {0: wild | {"flags": ("unsettled",)}})).mean_iri_m_per_km is None


def test_drives_are_distinguished_by_their_number_or_a_new_count(drive) -> None:
    rows = [*drive(3), *drive(2, number=2), *drive(4, number=2)]
    assert summarise(rows).drives == 3


def test_nothing_at_all_is_a_summary_too() -> None:
    summary = summarise([])
    assert (summary.windows, summary.distance_m, summary.mean_iri_m_per_km, summary.iri_classes) == (0, 0, None, ())
    assert summary_json(summary)["start_utc"] is None


@pytest.mark.parametrize("letter", IRI_CLASSES)
def test_class_limits_are_those_by_which_rows_get_their_class(letter: str) -> None:
    lower, upper = class_limits_m_per_km(letter)
    assert iri_class((lower or 0.0) * 1.002) == letter
    assert iri_class(min(upper or inf, 1e6) * 0.998) == letter


def test_a_ride_that_hides_counts_as_the_middle_of_what_it_can_be(drive) -> None:
    rough = {"a_w_mps2": 0.6, "a_w_std_mps2": 0.0, "duration_s": 1.0}
    hidden = {"a_w_mps2": None, "a_w_std_mps2": None, "a_w_raw_mps2": 0.2, "duration_s": 1.0, "flags": ("hidden",)}
    summary = summarise(drive(2, {0: hidden, 1: rough}))
    assert summary.a_w_mps2 == pytest.approx(sqrt((0.6**2 + 0.2**2 / 2) / 2))
