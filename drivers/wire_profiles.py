"""What the bytes of an accelerometer on a serial line mean, as a data file: a profile.

Problem: what an instrument sends may not be public, and everybody's bridge sends lines of its own; that must stay out
of the code until a real device has settled it. Solution: a profile says where the numbers stand in a frame and what
they mean. Shipped ones lie in ``drivers/profiles``, anyone may name another by its path.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import resources
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from yaml import YAMLError
from yaml.constructor import SafeConstructor

from drivers.disk import open_regular
from drivers.errors import SettingsError, shortened
from drivers.plain_yaml import NotPlainError, compose_plain, lines_of
from drivers.readings import STANDARD_GRAVITY_MPS2

WORDS = {"u16le": "<u2", "u16be": ">u2", "i16le": "<i2", "i16be": ">i2"}
UNITS_MPS2 = {"g": STANDARD_GRAVITY_MPS2, "mps2": 1.0}
AXES = "xyz"

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class ScaleCalibration:
    """Raw counts of X, Y, Z at 0 g and at +1 g, each axis by itself."""

    zero_g_raw: Triple
    one_g_raw: Triple

    def __post_init__(self) -> None:
        if not all(1 <= abs(one - zero) < inf for zero, one in zip(self.zero_g_raw, self.one_g_raw, strict=True)):
            raise SettingsError("calibration: expected a count or more between 0 g and 1 g on every axis")

    @property
    def mps2_per_count(self) -> Triple:
        """Scale of X, Y, Z [m/s2 per count]."""
        x, y, z = (STANDARD_GRAVITY_MPS2 / (one - zero) for zero,
                   one in zip(self.zero_g_raw, self.one_g_raw, strict=True))
        return x, y, z


@dataclass(frozen=True)
class FrameLayout:
    """Where X, Y and Z stand in a frame of fixed length, as 16-bit words.

    valid_raw       (lowest, highest) count the sensor gives; there it is clipped, outside it is no sample
    upright_axis    0, 1, 2: the axis along which the sensor feels gravity; None: mounted anyhow
    """

    length_bytes: int
    sync: bytes
    word: str
    offsets: tuple[int, int, int]
    valid_raw: tuple[int, int]
    upright_axis: int | None
    calibration: ScaleCalibration

    @property
    def words(self) -> str:
        """What comes, for people."""
        return f"frames of {self.length_bytes} bytes"

    def counts(self, frames: npt.NDArray[np.uint8]) -> npt.NDArray[np.int64]:
        """(..., length) bytes to (..., 3) counts of X, Y, Z."""
        columns = [offset + byte for offset in self.offsets for byte in (0, 1)]
        words = np.ascontiguousarray(frames[..., columns]).view(WORDS[self.word])
        return words.astype(np.int64)

    def plausible(self, frames: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
        """(n, length) bytes -> (n,): all three counts are such as the sensor gives."""
        counts = self.counts(frames)
        low, high = self.valid_raw
        return np.asarray(((counts >= low) & (counts <= high)).all(axis=1))

    def oriented(self, groups: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
        """(m, k, length) bytes -> (m,): over k frames gravity is felt along the upright axis (by the medians)."""
        middle = np.sort(self.counts(groups), axis=1)[:, groups.shape[1] // 2]
        accel = np.abs((middle - self.calibration.zero_g_raw) * self.calibration.mps2_per_count)
        along: npt.NDArray[np.bool_] = np.argmax(accel, axis=1) == self.upright_axis
        return along


@dataclass(frozen=True)
class LineLayout:
    """Lines ``x,y,z``: m/s2 per unit, and where the range ends [in units].

    numbers, columns   lines of another form: so many numbers, whatever stands between them, of which these (counted
                       from 1) are X, Y, Z; None: lines ``x,y,z`` and nothing else
    """

    unit_mps2: float
    range_units: float
    numbers: int | None = None
    columns: tuple[int, int, int] = (1, 2, 3)

    @property
    def words(self) -> str:
        """What comes, for people."""
        unit = next(name for name, unit_mps2 in UNITS_MPS2.items() if unit_mps2 == self.unit_mps2)
        if self.numbers is not None:
            return f"lines with {self.numbers} numbers, in {unit},"
        return f"lines x,y,z in {unit} (three numbers, two commas, nothing else)"


@dataclass(frozen=True)
class WireProfile:
    """What the bytes of a device mean. ``verified``: a real device has confirmed it. ``scale``: see below."""

    name: str
    version: int
    verified: bool
    source: str
    rate_hz: float
    clock_tolerance: float
    layout: FrameLayout | LineLayout

    @property
    def scale(self) -> Triple:
        """m/s2 per count or unit of X, Y, Z by the profile's own calibration."""
        if isinstance(self.layout, FrameLayout):
            return self.layout.calibration.mps2_per_count
        return (self.layout.unit_mps2,) * 3


def shipped_profiles() -> list[str]:
    """Names of the profiles in the package."""
    files = resources.files("drivers.profiles").iterdir()
    return sorted(file.name.removesuffix(".yaml") for file in files if file.name.endswith(".yaml"))


def load_profile(name_or_path: str | Path) -> WireProfile:
    """A shipped profile by its name, or a user's own by its path (ending in .yaml or .yml).

    Raises SettingsError naming file, line, key and what was expected.
    """
    profile_bytes_max = 65_536
    place = str(name_or_path)
    if place.endswith((".yaml", ".yml")):
        try:
            with open_regular(place) as file:
                text = file.read(profile_bytes_max + 1)
        except OSError as error:
            raise SettingsError(f"{place}: expected a readable profile file ({error.strerror})") from error
        except ValueError:
            raise SettingsError(f"{shortened(place)}: expected the name of a file") from None
    elif place in shipped_profiles():
        place += ".yaml"
        text = resources.files("drivers.profiles").joinpath(place).read_bytes()
    else:
        known = ", ".join(shipped_profiles())
        raise SettingsError(f"profile {shortened(place)}: expected one of {known}, or the path of a .yaml file")
    if len(text) > profile_bytes_max:
        raise SettingsError(f"{place}: expected at most {profile_bytes_max} bytes")
    try:
        top = compose_plain(text.decode())
        lines = dict(lines_of(top)) if top is not None else {}
        content = SafeConstructor().construct_document(top) if top is not None else None
    except NotPlainError as error:
        raise SettingsError(f"{place}:{error.line}: {error}") from None
    except (YAMLError, ValueError, OverflowError):  # dates and the like that cannot be; text that is no UTF-8
        raise SettingsError(f"{place}: expected YAML in UTF-8, with numbers and words as values") from None
    return _profile(_Keys(place, "", content, lines))


class _Keys:
    """The keys of one mapping in a profile file: each asked for once, none left over."""

    def __init__(self, place: str, path: str, content: object, lines: Mapping[str, int]) -> None:
        self._place = place
        self._path = path
        self._lines = lines
        self._line = lines.get(path.rstrip("."), 1)
        if not isinstance(content, Mapping):
            raise SettingsError(f"{place}:{self._line}: {path.rstrip('.') or 'file'}: expected keys with values")
        self._content: dict[Any, Any] = dict(content)

    def wrong(self, key: str, expected: str) -> SettingsError:
        line = self._lines.get(f"{self._path}{key}", self._line)
        return SettingsError(f"{self._place}:{line}: {self._path}{key}: expected {expected}")

    def _take(self, key: str, expected: str) -> Any:
        if key not in self._content:
            raise self.wrong(key, f"{expected}, but the key is missing")
        return self._content.pop(key)

    def has(self, key: str) -> bool:
        return key in self._content

    def inner(self, key: str) -> _Keys:
        return _Keys(self._place, f"{self._path}{key}.", self._take(key, "keys with values"), self._lines)

    def text(self, key: str) -> str:
        value = self._take(key, "text")
        if not isinstance(value, str):
            raise self.wrong(key, "text")
        return value.strip()

    def flag(self, key: str) -> bool:
        value = self._take(key, "true or false")
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def choice(self, key: str, options: list[str]) -> str:
        expected = " or ".join(options)
        value = self._take(key, expected)
        if value not in options:
            raise self.wrong(key, expected)
        return str(value)

    def number(self, key: str, low: float, high: float) -> float:
        expected = f"a number from {low:g} to {high:g}"
        return self._checked(key, self._take(key, expected), low, high, expected)

    def whole(self, key: str, low: int, high: int) -> int:
        expected = f"a whole number from {low} to {high}"
        return self._whole(key, self._take(key, expected), low, high, expected)

    def numbers(self, key: str, count: int, low: float, high: float) -> list[float]:
        expected = f"a list of {count} numbers from {low:g} to {high:g}"
        return [self._checked(key, value, low, high, expected) for value in self._list(key, count, expected)]

    def wholes(self, key: str, count: int, low: int, high: int) -> list[int]:
        expected = f"a list of {count} whole numbers from {low} to {high}"
        return [self._whole(key, value, low, high, expected) for value in self._list(key, count, expected)]

    def _list(self, key: str, count: int, expected: str) -> list[object]:
        values = self._take(key, expected)
        if not isinstance(values, list) or len(values) != count:
            raise self.wrong(key, expected)
        return values

    def _checked(self, key: str, value: object, low: float, high: float, expected: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise self.wrong(key, expected)
        return float(value)

    def _whole(self, key: str, value: object, low: int, high: int, expected: str) -> int:
        if not isinstance(value, int):
            raise self.wrong(key, expected)
        return int(self._checked(key, value, low, high, expected))

    def finish(self) -> None:
        for key in self._content:
            raise self.wrong(shortened(str(key))[1:-1], "no such key")


def _profile(keys: _Keys) -> WireProfile:
    framing = keys.choice("framing", ["frames", "lines"])
    layout = _frame_layout(keys.inner("frame")) if framing == "frames" else _line_layout(keys.inner("line"))
    profile = WireProfile(name=keys.text("name"), version=keys.whole("version", 1, 1_000_000),
                          verified=keys.flag("verified"), source=keys.text("source"),
                          rate_hz=keys.number("rate_hz", 1, 10_000),
                          clock_tolerance=keys.number("clock_tolerance_ppm", 1, 50_000) * 1e-6, layout=layout)
    keys.finish()
    return profile


def _frame_layout(keys: _Keys) -> FrameLayout:
    length = keys.whole("length_bytes", 6, 256)
    sync_text = keys.text("sync")
    try:
        sync = bytes.fromhex(sync_text)
    except ValueError:
        raise keys.wrong("sync", "bytes in hex, or empty") from None
    if len(sync) > length - 6:
        raise keys.wrong("sync", "start bytes that leave six bytes of the frame for X, Y, Z")
    x, y, z = keys.wholes("offsets", 3, len(sync), length - 2)
    low, high = keys.wholes("valid_raw", 2, -32768, 65535)
    if low >= high:
        raise keys.wrong("valid_raw", "the lower count first")
    axis = keys.choice("upright_axis", [*AXES, "none"])
    zero, one = (keys.numbers(key, 3, -32768, 65535) for key in ("zero_g_raw", "one_g_raw"))
    if any(abs(a - b) < 1 for a, b in zip(zero, one, strict=True)):
        raise keys.wrong("one_g_raw", "counts that differ by one or more from those of zero_g_raw")
    layout = FrameLayout(length_bytes=length, sync=sync, word=keys.choice("word", list(WORDS)), offsets=(x, y, z),
                         valid_raw=(low, high), upright_axis=None if axis == "none" else AXES.index(axis),
                         calibration=ScaleCalibration((zero[0], zero[1], zero[2]), (one[0], one[1], one[2])))
    keys.finish()
    return layout


def _line_layout(keys: _Keys) -> LineLayout:
    most_numbers = 40  # of one digit in a line of 80 characters
    layout = LineLayout(UNITS_MPS2[keys.choice("unit", list(UNITS_MPS2))], keys.number("range", 1e-3, 1e4))
    if keys.has("numbers") or keys.has("columns"):
        numbers = keys.whole("numbers", 3, most_numbers)
        x, y, z = keys.wholes("columns", 3, 1, numbers)
        layout = replace(layout, numbers=numbers, columns=(x, y, z))
    keys.finish()
    return layout
