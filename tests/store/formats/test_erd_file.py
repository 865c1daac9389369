"""ERD files: written here by hand from the specification, read back in metres."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.errors import BadInput
from logger.store.formats.profile_file import Wheelpaths, parse_erd, read_profile

LEFT = np.array([0.0, 1.0, -2.0, 3.5])
RIGHT = np.array([10.0, 20.0, 30.0, -40.0])


def header(layout: str, *lines: str) -> str:
    return "\n".join(["ERDFILEV2.00", layout, "TITLE   US-23, lane 2", *lines, "END", ""])


def read(tmp_path: Path, content: str | bytes, numbers: bytes | None = None, suffix: str = ".erd.bin") -> Wheelpaths:
    path = tmp_path / "road.erd"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    if numbers is not None:
        path.with_suffix(suffix).write_bytes(numbers)
    return read_profile(path)


def refusal(tmp_path: Path, content: str | bytes, numbers: bytes | None = None) -> str:
    with pytest.raises(BadInput) as error:
        read(tmp_path, content, numbers)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < len(str(tmp_path)) + 250
    return str(error.value).removeprefix(str(tmp_path / "road.erd"))


def test_text_as_the_pavement_archives_write_it(tmp_path: Path) -> None:
    """Three tracks in millimetres at 25 mm; the middle one belongs to no wheel."""
    profile = read(tmp_path, (
        "ERDFILEV2.00\r\n      3,      4,     -1,      1,      5,       0.0250,     -1,\r\n"
        "TITLE   Section 06B410SF: Run 1\r\nSHORTNAMLElev.  CElev.  RElev.  \r\nUNITSNAMmm      mm      mm\r\n"
        "XUNITS  m\r\nDATE    11/Apr/1997\r\n\r\nEND\r\n"
        " 0.0 7.0 10.0\r\n 1.0 7.0 20.0\r\n-2.0 7.0 30.0\r\n 3.5 7.0 -40.0\r\n"))
    assert (profile.start_m, profile.spacing_m) == (0.0, 0.025)
    assert profile.elevation_m == pytest.approx(LEFT / 1000)
    assert profile.elevation_right_m == pytest.approx(RIGHT / 1000)


@pytest.mark.parametrize(("unit", "unit_m"), [
    ("in", 0.0254), ("in.", 0.0254), ("ft", 0.3048), ("mm", 0.001), ("m", 1.0), ("CM", 0.01), ("mils", 2.54e-5)])
def test_units_become_metres(tmp_path: Path, unit: str, unit_m: float) -> None:
    profile = read(tmp_path, header("1, 4, -1, 1, 5, 0.5, -1,", f"UNITSNAM{unit}", "XUNITS  ft") + "0 1 -2\n3.5")
    assert profile.spacing_m == pytest.approx(0.1524)
    assert profile.elevation_m == pytest.approx(LEFT * unit_m)
    assert profile.elevation_right_m is None


@pytest.mark.parametrize(("key", "kind"), [(0, "<i2"), (1, "<f4"), (2, "<f8")])
@pytest.mark.parametrize("place", ["inside", ".erd.bin", ".bin"])
@pytest.mark.parametrize("samples", [4, -1])
def test_binary_numbers_inside_or_beside(tmp_path: Path, key: int, kind: str, place: str, samples: int) -> None:
    text = header(f"2,{samples},1,{16 * key},{key},0.25,-1,", "SHORTNAMRElev.  LElev.", "UNITSNAMin      in",
                  "XUNITS  m", "GAIN     2.0 1.0", "OFFSET   0.0 3.0").encode()
    table = np.column_stack([RIGHT, LEFT]).astype(kind)
    raw = table.astype(float)
    inside = place == "inside"
    profile = read(tmp_path, text + table.tobytes() * inside, None if inside else table.tobytes(), place)
    right, left = (raw[:, 0] * 2, raw[:, 1] + 3) if key == 0 else (raw[:, 0], raw[:, 1])
    assert profile.elevation_m == pytest.approx(left * 0.0254)
    assert profile.elevation_right_m == pytest.approx(right * 0.0254)


def test_records_may_be_padded(tmp_path: Path) -> None:
    text = header("1,4,2,12,1,0.25,-1", "UNITSNAMm", "XUNITS  m").encode()
    assert len(read(tmp_path, text + np.arange(6, dtype="<f4").tobytes()).elevation_m) == 4


@pytest.mark.parametrize("names", [
    "SHORTNAMLElev.  RElev.", "SHORTNAMLeft    Right", "SHORTNAML Prof  R Prof", "SHORTNAMLWP RWP",
    "LONGNAMELeft Elevation                  Right Elevation", "SHORTNAMLElev.\n&1000   RElev.", "TITLE   none"])
def test_tracks_are_recognised_by_their_names(tmp_path: Path, names: str) -> None:
    text = header("2, 2, -1, 1, 5, 0.25, -1", names, "UNITSNAMm       m", "XUNITS  m") + "1 2\n3 4\n"
    profile = read(tmp_path, text)
    assert profile.elevation_m.tolist() == [1, 3]
    assert profile.elevation_right_m is not None
    assert profile.elevation_right_m.tolist() == [2, 4]


GOOD = ("UNITSNAMm       m", "XUNITS  m")
SECOND = ":2: expected channels, samples, records, bytes, key, step"


@pytest.mark.parametrize(("content", "expected"), [
    ("ERDFILEV2.00\n", ":2: expected a line END"),
    ("ERDFILEV2.00\n1,2,-1,1,5,0.25,-1\nXUNITS  m\n1 2 3\n", ":5: expected a line END"),
    (header("one,two", *GOOD), SECOND + ", found 'one,two'"),
    (header("1,2,-1,1,5", *GOOD), SECOND + ", found '1,2,-1,1,5'"),
    (header("0,2,-1,1,5,0.25,-1", *GOOD), SECOND + ", found 0 channels"),
    (header("1,999999999999,-1,1,5,0.25", *GOOD), SECOND + ", found 9"),
    (header("2,2,-1,1,5,-0.25,-1", *GOOD), SECOND + " above 0, found"),
    (header("2,2,-1,1,5,nan,-1", *GOOD), SECOND + " above 0, found"),
    (header("2,2,-1,1,7,0.25,-1", *GOOD), SECOND + " with key 0, 1, 2 "),
    (header("2,2,-1,1,5,0.25,-1", GOOD[0]) + "1 2 3 4", ":2: expected XUNITS m, mm, ft or in, found nothing"),
    (header("2,2,-1,1,5,0.25,-1", GOOD[0], "XUNITS  s") + "1 2 3 4", ":5: expected XUNITS m, mm, ft or in, found 's'"),
    (header("2,2,-1,1,5,0.25,-1", GOOD[1]) + "1 2 3 4", ":2: expected elevations in m, mm, ft or in, found nothing"),
    (header("2,2,-1,1,5,0.25,-1", "UNITSNAMg       g", GOOD[1]) + "1 2 3 4", ":2: expected elevations in m, mm, ft or"),
    (header("2,2,-1,1,5,0.25,-1", "UNITSNAMm", GOOD[1]) + "1 2 3 4", ":2: expected elevations in m, mm, ft or in, fou"),
    (header("2,2,-1,1,5,0.25,-1", "UNITSNAMmillimetre inches and", GOOD[1]) + "1 2 3 4", ":4: expected 2 entries"),
    (header("2,2,-1,1,5,0.25,-1", "SHORTNAMDist    Elev.", *GOOD) + "1 2 3 4", ":2: expected one channel, or one na"),
    (header("2,2,-1,1,5,0.25,-1", *GOOD) + "1 2\n3 x", ":8: expected numbers, found 'x'"),
    (header("2,2,-1,1,5,0.25,-1", *GOOD) + "1 2\n3 nan", ":8: expected numbers, found 'nan'"),
    (header("2,2,-1,1,5,0.25,-1", *GOOD) + "1 2\n3", ":2: expected 2 samples of 2 numbers, found 3 numbers"),
    (header("2,-1,-1,1,5,0.25,-1", *GOOD) + "1 2\n3", ":2: expected rows of 2 numbers, found 3 numbers"),
    (header("2,2,-1,1,5,0.25,-1", *GOOD), ":2: expected 2 samples of 2 numbers, found 0 numbers"),
    (header("2,2,-1,1,5,0.25,-1", *GOOD) + "1 2 3 20000", ":2: expected elevations within 10000 m, found 2e+04 (ano"),
    (header("3,1,-1,1,5,0.25,-1", "UNITSNAMm       m       m", GOOD[1]) + "1 2 3", ":2: expected one channel, or one"),
    (header("2,1,-1,1,5,0.25,-1", "SHORTNAMLElev.  LElev.", *GOOD) + "1 2", ":2: expected one channel, or one named l"),
    (header("2,2,-1,8,1,0.25,-1", *GOOD), ": expected its binary numbers in road.erd.bin or road.bin beside it"),
    (header("2,2,-1,8,0,0.25,-1", "GAIN    1 x", *GOOD).encode() + b"12345678", ":4: expected 2 numbers after GAIN"),
    (header("2,2,-1,8,1,0.25,-1", *GOOD).encode() + b"123", ": expected 16 bytes of numbers, found 3"),
    (header("2,2,-1,8,1,0.25,-1", *GOOD).encode() + b"1" * 17, ": expected 16 bytes of numbers, found 17"),
    (header("2,-1,-1,8,1,0.25,-1", *GOOD).encode() + b"1" * 17, ": expected 16 bytes of numbers, found 17"),
    (header("1,2,-1,8,1,0.25,-1", *GOOD).encode() + np.array([1, np.nan], "<f4").tobytes(),
     ": expected finite numbers, found none in sample 2"),
])
def test_what_is_no_erd_file_is_refused(tmp_path: Path, content: str | bytes, expected: str) -> None:
    assert refusal(tmp_path, content).startswith(expected)


@given(st.binary(max_size=300), st.sampled_from([b"", b"ERDFILEV2.00\n", b"ERDFILEV2.00\n2,-1,-1,8,1,0.25,-1\n",
                                                 header("2,-1,-1,1,5,0.25,-1", *GOOD).encode(),
                                                 header("1,-1,-1,1,2,0.25,-1", *GOOD).encode()]))
@settings(max_examples=150)
def test_any_bytes_are_read_or_refused(noise: bytes, start: bytes) -> None:
    try:
        erd = parse_erd(start + noise, "noise.erd")
        tracks = erd.wheel_tracks()
    except BadInput as error:
        assert str(error).startswith("noise.erd:")
    else:
        assert all(np.isfinite(track).all() for track in tracks)
