"""Studies of chapters 5 to 7 against the source's text, against algebra, and against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from logger.chart_data import Field
from logger.estimation.rms_calibration import rms_relation
from logger.roads.iri import iri
from logger.studies.dissertation import chapter_6, chapters_5_and_7
from logger.studies.drives import (
    PS_2119,
    Conditions,
    comfort_shares,
    drive_over,
    per_window,
    places_m,
    random_road,
    rav4,
    whole_road_by_rms,
)
from logger.studies.study import Cell
from logger.units import MPH_MPS, WINDOW_M
from logger.vehicle.linearise import known_vehicle

from ..support.study_results import study_result as result


def numbers(rows: Sequence[tuple[Cell, ...]], column: int) -> list[float]:
    return [float(str(row[column])) for row in rows]


def test_a_random_road_has_the_iri_that_it_was_asked_for() -> None:
    for waviness in (1.6, 2.0, 2.4):
        found = []
        for seed in range(4):
            road = random_road(3.0, 600.0, seed, waviness)
            inside = (places_m(road) >= 0) & (places_m(road) <= 600)
            found.append(iri(road.elevation_m[inside], road.spacing_m))
        assert np.mean(found) == pytest.approx(3.0, rel=0.08)


def test_a_drive_ends_with_its_road() -> None:
    drive = drive_over(random_road(2.0, 100.0, 1), 10.0, Conditions(0.0))
    assert drive.distance_m[0] == 0
    assert drive.distance_m[-1] == pytest.approx(100.0, abs=0.2)


def test_windows_add_up_to_the_whole_drive() -> None:
    """Mean squares of windows of equal time, and the IRI of the whole length, are those of the drive."""
    clean = Conditions(noise_mps2=1e-4)
    drive = drive_over(random_road(3.0, 20 * WINDOW_M + 0.5, 2), 12.0, clean)
    cut = per_window(drive, clean)
    assert len(cut.middle_m) == len(cut.a_w_mps2) == 20
    assert np.sqrt(np.mean(cut.by_rms_m_per_km**2)) == pytest.approx(whole_road_by_rms(drive), rel=0.01)
    assert cut.iri_m_per_km.mean() == pytest.approx(cut.exact_m_per_km.mean(), rel=0.05)  # short waves are not felt


def test_a_low_pass_takes_something_from_the_relation_and_nothing_from_the_estimate() -> None:
    drive = drive_over(random_road(3.0, 80.0, 3), 9.0, PS_2119)
    plain, low = (per_window(drive, PS_2119, low_pass_hz=cutoff) for cutoff in (None, 10.0))
    assert (low.by_rms_m_per_km < plain.by_rms_m_per_km).mean() > 0.8
    assert np.array_equal(low.iri_m_per_km, plain.iri_m_per_km)


def test_shares_of_comfort() -> None:
    shares = comfort_shares(np.array([0.1, 0.2, 0.4, 2.5]))
    assert list(shares) == ["not_uncomfortable", "a_little_uncomfortable", "fairly_uncomfortable", "uncomfortable",
                            "very_uncomfortable", "extremely_uncomfortable"]
    assert list(shares.values()) == [50, 25, 0, 0, 0, 25]


def test_speeds_of_the_segments_are_those_of_table_d_1() -> None:
    mph = [chapter_6.PRINTED_MPH[segment] for segment in range(1, 38)]
    assert len(chapter_6.PRINTED_MPH) == 37
    assert mph[:10] == [30, 30, 30, 30, 25, 20, 20, 25, 25, 20]
    assert mph[20:24] == [20, 15, 20, 20]
    assert [mph.count(speed) for speed in (30, 25, 20, 15)] == [4, 3, 29, 1]
    assert chapter_6.PRINTED_KMH == {30: 48.28, 25: 40.23, 20: 32.19, 15: 24.14}


def test_the_sizes_that_are_asked_for_give_the_printed_words() -> None:
    for row in result("table-6-5").tables[0].rows:
        assert row[-1] == row[2]
        assert float(str(row[7])) < float(str(row[8]))


def test_a_tube_lifts_a_tires_mean_by_its_area_over_the_patch() -> None:
    """The raised cosine's area is half of height times width."""
    place_m = np.arange(19.8, 20.2, 1e-5)
    area = float(np.sum(chapters_5_and_7.tube(20.0)(place_m)) * 1e-5)
    assert area / rav4().contact_patch_m == pytest.approx(chapters_5_and_7.TUBE_M**2 / 2 / 0.25, rel=1e-3)


@pytest.mark.slow
def test_bump_and_bridge_stand_out_of_the_road_and_a_tube_does_not() -> None:
    rows = result("fig-5-22").tables[0].rows
    above = numbers(rows, 6)
    assert min(above[:2]) > 10
    assert max(above[2:]) < 1
    assert [row[7] for row in rows[2:]] == ["above 50", "above 50"]
    assert max(float(str(row[7])) for row in rows[:2]) < 5


@pytest.mark.slow
def test_the_drift_with_speed_has_the_printed_signs_and_ours_has_none() -> None:
    rows = result("fig-6-9").tables[0].rows
    assert (rows[0][1], rows[-1][1]) == ("too high", "too low")
    by_rms, ours = numbers(rows, 2), numbers(rows, 5)
    assert by_rms[0] > 8
    assert by_rms[-1] < -8
    assert max(map(abs, ours)) < 6


def test_comfort_falls_with_roughness_and_speed() -> None:
    surface = result("fig-6-16").pictures[1].chart
    assert isinstance(surface, Field)
    assert (np.diff(surface.values, axis=0) > 0).all()
    assert (np.diff(surface.values, axis=1) > 0).all()


def test_the_trendlines_are_those_of_the_integral() -> None:
    """R.m.s. by Gd from drives against the closed form of the relation."""
    speeds = np.array(range(10, 71, 10)) * MPH_MPS
    computed = 0.5386 / rms_relation(known_vehicle(rav4()), None, speeds).iri_per_accel_rms
    assert numbers(result("fig-6-6").tables[1].rows, 2) == pytest.approx(computed, rel=0.03)


@pytest.mark.slow
def test_the_maps_hold_every_segment() -> None:
    roughness, comfort = (one.chart for one in result("fig-6-23", 0.1).pictures[2:])
    assert isinstance(roughness, Field)
    assert isinstance(comfort, Field)
    assert roughness.values.shape == comfort.values.shape == (len(roughness.y), len(roughness.x))
    assert np.isfinite(roughness.values).all()


@pytest.mark.slow
def test_two_drives_over_one_road_tell_the_mass_without_a_profile() -> None:
    study = result("section-7-2-input")
    *single, both = study.tables[1].rows
    assert abs(float(str(both[4]))) < 3 * float(str(both[5])) + 0.5
    assert float(str(both[5])) < 0.5 * min(numbers(single, 5))
    assert min(numbers(study.tables[0].rows, 5)) > 0.9


def test_a_full_car_on_equal_tracks_is_the_half_car() -> None:
    rows = result("section-7-2-full-car", 1.0).tables[0].rows
    assert rows[0][3] == pytest.approx(0, abs=1e-6)
    assert rows[0][4] == pytest.approx(rows[0][5], rel=1e-6)
    # The middle feels the mean of two tracks; of two that share nothing it has half of the power.
    assert rows[3][3] == pytest.approx(100 * (np.sqrt(0.5) - 1), abs=3)
    assert all(float(str(row[5])) <= float(str(row[4])) + 1e-9 for row in rows)


def test_the_place_of_the_sensor_matters_until_it_is_known() -> None:
    rows = result("section-7-2-sensor-position").tables[1].rows
    assert max(abs(one) for one in numbers(rows, 2)) > 50
    assert max(abs(one) for one in numbers(rows, 3)) < 4


@pytest.mark.slow
def test_the_estimate_is_near_the_least_possible_error_at_every_speed() -> None:
    rows = result("section-7-2-speed").tables[0].rows
    for by_rms, ours, least in zip(*(numbers(rows, column) for column in (3, 4, 5)), strict=True):
        assert 0.8 * least < ours < 1.35 * least < by_rms


@pytest.mark.slow
def test_what_a_larger_input_tells() -> None:
    cars, sizes = result("section-7-2-other-vehicles", 1.0).tables
    assert max(numbers(cars.rows, 6)) < 2
    errors = {(row[0], row[1]): row[4] for row in sizes.rows}
    half, full = (float(str(errors[f"bump, {height} mm", 10.0])) for height in (75, 150))
    assert half == pytest.approx(2 * full, rel=0.25)
    assert {value for (what, _), value in errors.items() if "tube" in str(what)} == {"above 50"}


def test_a_vehicle_that_is_given_is_the_one_that_is_driven() -> None:
    heavier = replace(rav4(), sprung_mass_kg=2 * rav4().sprung_mass_kg)
    road = random_road(3.0, 60.0, 5)
    own, other = (drive_over(road, 12.0, Conditions(0.0), car).measured_mps2.std() for car in (None, heavier))
    assert other < own
