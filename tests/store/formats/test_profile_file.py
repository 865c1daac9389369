"""Profiles in CSV: what is read, and the one line that each fault becomes."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.errors import BadInput
from logger.store.formats.profile_file import parse_table, read_profile

HEADER = "distance_m,elevation_m"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "road.csv"


def refusal(path: Path, content: str | bytes, resample_m: float | None = None) -> str:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(BadInput) as error:
        read_profile(path, resample_m)
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < len(str(path)) + 250
    return message.removeprefix(str(path))


def rows(distances: np.ndarray, decimals: int = 3) -> str:
    return "\n".join([HEADER, *(f"{x:.{decimals}f},{np.sin(x):.5f}" for x in distances)])


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("tail", ["", "\n", "\n\n \n"])
def test_two_tracks_are_read(path: Path, ending: str, mark: bytes, tail: str) -> None:
    text = "distance_m, elevation_m ,elevation_right_m\n478, 1e-2,-.5\n478.25,583.,+6\n478.50 ,0,1E+1" + tail
    path.write_bytes(mark + text.replace("\n", ending).encode())
    profile = read_profile(path)
    assert (profile.start_m, profile.spacing_m, profile.widest_step_m) == (478.0, 0.25, None)
    assert profile.elevation_m.tolist() == [0.01, 583.0, 0.0]
    assert profile.elevation_right_m is not None
    assert profile.elevation_right_m.tolist() == [-0.5, 6.0, 10.0]


@given(st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), min_size=1, max_size=20))
@settings(max_examples=50)
def test_numbers_survive_to_the_last_bit(pairs: list[tuple[float, float]]) -> None:
    text = "\n".join([HEADER, *(f"{a!r},{b!r}" for a, b in pairs)])
    assert parse_table(text.encode(), "x")[0].tolist() == [list(pair) for pair in pairs]


@pytest.mark.parametrize(("content", "expected"), [
    ("", ":1: expected the header distance_m,elevation_m[,elevation_right_m] "
     "(other units by name: distance_ft,elevation_in), found nothing"),
    ("0,1\n0.25,1\n", ":1: expected the header distance_m,elevation_m[,elevation_right_m] "
     "(other units by name: distance_ft,elevation_in), found numbers: no line"),
    ("distance;elevation\n0;1", ":1: expected the header distance_m,elevation_m[,elevation_right_m] "
     "(other units by name: distance_ft,elevation_in), found 'dist"),
    ("elevation_m,distance_m\n0,1\n", ":1: expected the header"),
    (HEADER + ",roll\n0,1,2\n", ":1: expected the header"),
    (b"\x00" * 5000, ":1: expected text"),
    (HEADER, ":2: expected numbers below the header, found nothing"),
    (HEADER + "\n\n\n", ":2: expected numbers below the header, found nothing"),
    (HEADER + "\n0,1\n", ":3: expected at least two samples, found the end of the file"),
    (HEADER + "\n0,1\n0.25;1\n0.5,1", ":3: expected 2 fields (distance_m,elevation_m), found '0.25;1'"),
    (HEADER + "\n0,1\n0.25,1,2\n0.5,1", ":3: expected 2 fields (distance_m,elevation_m), found '0.25,1,2'"),
    (HEADER + "\n0,1\n0.25,\n0.5,1", ":3: expected a number for elevation_m, found nothing"),
    (HEADER + "\n0,1\n0.25,nan\n0.5,1", ":3: expected a number for elevation_m, found 'nan'"),
    (HEADER + "\n0,1\ninf,2\n0.5,1", ":3: expected a number for distance_m, found 'inf'"),
    (HEADER + "\n0,1\n0.25,1e999\n", ":3: expected a number for elevation_m, found '1e999'"),
    (HEADER + "\n0,1\n0.25,1_0\n", ":3: expected a number for elevation_m, found '1_0'"),
    (HEADER + "\n0,1\n0.25,0x1\n", ":3: expected a number for elevation_m, found '0x1'"),
    (HEADER + "\n0,1\nroad\n", ":3: expected 2 fields"),
    (HEADER + "\n0,1\n0.25," + "9" * 100_000 + "x\n", ":3: expected a number for elevation_m, found '9999"),
    (HEADER.encode() + b"\n0,1\n0.25,\xff\x00\n", ":3: expected text"),
    (HEADER + "\n0,1\n0.25,1\n0.25,1\n", ":4: expected a distance above 0.25 m, found 0.25"),
    (HEADER + "\n0,1\n0.25,1\n0.20,1\n", ":4: expected a distance above 0.25 m, found 0.2"),
])
def test_what_is_no_profile_is_refused_with_its_line(path: Path, content: str | bytes, expected: str) -> None:
    assert refusal(path, content).startswith(expected)


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    for place in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(BadInput, match=r"expected a (readable )?file"):
            read_profile(place)


@pytest.mark.parametrize("spacing_m", [0.0127, 0.0254, 0.1524, 0.25, 1 / 3])
def test_distances_rounded_to_millimetres_are_even(path: Path, spacing_m: float) -> None:
    path.write_text(rows(100 + spacing_m * np.arange(500)))
    assert read_profile(path).spacing_m == pytest.approx(spacing_m, rel=1e-5)


def test_an_uneven_step_is_refused_with_its_line(path: Path) -> None:
    even = 0.25 * np.arange(100)
    late = even.copy()
    late[40:] += 0.1
    assert refusal(path, rows(late)).startswith(":42: expected even steps of 0.25 m, found a step of 0.35 m (--res")
    hole = np.delete(even, slice(40, 44))
    found = refusal(path, rows(hole))
    assert found.startswith(":42: expected even steps of 0.25 m, found a gap of 1.25 m (cut the profile there)")
    jitter = even + 0.01 * np.random.default_rng(1).standard_normal(100)
    assert re.match(r":\d+: expected even steps of 0\.2[45]\d* m, found a step of", refusal(path, rows(jitter)))


def test_drifting_steps_are_refused_with_a_line(path: Path) -> None:
    steps = np.arange(1000)
    drifting = rows(0.25 * steps + 1e-7 * steps**2, decimals=6)
    assert refusal(path, drifting).startswith(":9: expected even steps of 0.2501 m to reach 1.7507 m, found 1.750")


def test_resampling_takes_straight_lines_and_says_how_far(path: Path) -> None:
    path.write_text(HEADER + "\n10,0\n10.2,2\n11.2,-8\n11.3,-8\n")
    profile = read_profile(path, resample_m=0.25)
    assert (profile.start_m, profile.spacing_m) == (10.0, 0.25)
    assert profile.widest_step_m == pytest.approx(1.0)
    assert profile.elevation_m == pytest.approx([0, 1.5, -1, -3.5, -6, -8])


def test_resampling_cannot_mend_everything(path: Path) -> None:
    assert refusal(path, HEADER + "\n0,1\n1,1\n1,2\n", 0.25).startswith(":4: expected a distance above")
    for spacing_m in (0.0, -1.0, 5.0, 1e-12, float("nan"), float("inf")):
        assert "to resample to, found" in refusal(path, HEADER + "\n0,1\n1,1\n2,2\n", spacing_m)


def test_a_wide_gap_is_not_bridged_and_wild_heights_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "road.csv"
    holed = HEADER + "".join(f"\n{0.25 * i},0" for i in range(60)) + "".join(f"\n{60 + 0.25 * i},0" for i in range(60))
    assert ":62: expected no gap above 1 m, found one of 45.25 m" in refusal(path, holed, 0.25)
    assert ":3: expected elevations within 10000 m" in refusal(path, HEADER + "\n0,1\n0.25,1.7e308\n0.5,1")
