"""Numbers are written with their errors and units, in no more digits than they deserve."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.report.quantities import chance, finite, measured, numbers_of, unit_of
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import chosen


@pytest.mark.parametrize(("value", "error", "words"), [
    (84.7, 3.9, "85 ± 4"), (84.7, 1.44, "84.7 ± 1.4"), (2546650.3, 47294.2, "2.55e6 ± 0.05e6"),
    (0.4021, 0.0049, "0.402 ± 0.005"), (23088.0, 230.0, "23100 ± 200"), (1.234e-5, 2e-7, "1.23e-5 ± 0.02e-5"),
    (1.2345, None, "1.23"), (5.0, float("inf"), "5"), (0.0, 0.0, "0"), (2e-6, 2e-4, "0 ± 2e-4"),
    (0.99e-3, 0.6e-3, "0.0010 ± 0.0006"), (9.99e5, 2e5, "1.0e6 ± 0.2e6"),
])
def test_a_value_has_the_digits_that_it_deserves(value: float, error: float | None, words: str) -> None:
    assert measured(value, error) == words


def test_units_are_the_ends_of_names() -> None:
    for name, unit in (("friction_force_n", "N"), ("cubic_stiffness_n_per_m3", "N/m3"), ("offset_m", "m"),
                       ("tire_damping_n_s_per_m", "N s/m"), ("knee_velocity_m_per_s", "m/s"), ("gain", "")):
        assert unit_of(name) == unit
    one = chosen(shipped_effects()["dry_friction"], {"friction_force_n": 85.2},
                 standard_errors={"friction_force_n": 4.1})
    assert numbers_of(one) == "friction_force_n 85 ± 4 N, transition_velocity_m_per_s 0 m/s"
    ended = chosen(shipped_effects()["frame_friction"], {"friction_force_n": 0.7, "body_friction_force_n": 5.7e-7},
                   standard_errors={"friction_force_n": 0.01, "body_friction_force_n": 7e-9})
    assert numbers_of(ended).startswith("friction_force_n 0.700 ± 0.010 N, body_friction_force_n 0 N")
    assert [chance(p) for p in (1e-30, 2e-4, 0.3, 1.0)] == ["below 1e-9", "0.0002", "0.30", "1.00"]


@pytest.mark.parametrize(("name", "unit"), [
    ("decay_per_s", "1/s"), ("curvature_per_m", "1/m"), ("mass_kg_per_m", "kg/m"), ("power_w_per_m", "W/m"),
    ("quadratic_damping_n_s2_per_m2", "N s2/m2"), ("bar_n_m_per_rad", "N m/rad"), ("torque_n_m", "N m"),
    ("top_speed_mps", "m/s"), ("kick_mps2", "m/s2"), ("drag_n_per_mps", "N/(m/s)"), ("rate_n_per_m_s", "N/(m s)"),
    ("jerk_m_per_s3", "m/s3"), ("creep_n_per_m_per_s", "N/m/s"), ("per_s", "1/s"), ("force_per_wheel_n", "N"),
    ("mass_kg_per_axle", ""), ("share_per_wheel", ""), ("n", ""), ("gears", ""), ("item", ""), ("hammer", ""),
    ("shape_m_kg", "kg"),
])
def test_a_unit_is_the_whole_end_of_a_name(name: str, unit: str) -> None:
    assert unit_of(name) == unit


OVER = {"n": "N", "kg": "kg", "m": "m", "s": "s", "hz": "Hz", "w": "W", "j": "J", "pa": "Pa", "rad": "rad", "mm": "mm",
        "n_s": "N s", "n_s2": "N s2", "n_m": "N m", "kg_m2": "kg m2", "m2": "m2", "m3": "m3", "s2": "s2"}
UNDER = {one: OVER[one] for one in ("kg", "m", "s", "hz", "rad", "m2", "m3", "s2")}


@given(st.sampled_from(["decay", "stop_stiffness", "share_per_wheel", "x1"]), st.sampled_from([*OVER]),
       st.sampled_from([*UNDER]))
def test_units_over_others(word: str, over: str, under: str) -> None:
    assert unit_of(f"{word}_{over}") == OVER[over]
    assert unit_of(f"{word}_per_{under}") == f"1/{UNDER[under]}"
    assert unit_of(f"{word}_{over}_per_{under}") == f"{OVER[over]}/{UNDER[under]}"
    assert unit_of(f"{word}_{over}_ratio") == ""


ENDINGS = {f"_{over}": OVER[over] for over in OVER} | {f"_per_{under}": f"1/{UNDER[under]}" for under in UNDER} | {
    f"_{over}_per_{under}": f"{OVER[over]}/{UNDER[under]}" for over in OVER for under in UNDER}


@pytest.mark.parametrize("name", shipped_effects())
def test_units_of_the_effects_that_come_with_ridelog(name: str) -> None:
    """The longest of the endings above; without one, a number without a unit."""
    for one in shipped_effects()[name].parameters:
        ending = max((end for end in ENDINGS if one.name.endswith(end)), key=len, default="")
        assert unit_of(one.name) == ENDINGS.get(ending, ""), one.name


def test_only_errors_that_are_known_are_kept() -> None:
    assert finite({"a": 1.0, "b": float("inf"), "c": float("nan")}) == {"a": 1.0}
