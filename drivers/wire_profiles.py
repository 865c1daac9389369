"""What the bytes of an accelerometer on a serial line mean, as a data file: a profile.

Problem: what an instrument sends may not be public, and everybody's bridge sends lines of its own; that must stay out
of the code until a real device has settled it. Solution: a profile says where the numbers stand in a frame and what
they mean. Shipped ones lie in ``drivers/profiles``, anyone may name another by its path.
"""

from dataclasses import dataclass, replace
from importlib import resources
from math import inf
from pathlib import Path

import numpy as np
import numpy.typing as npt

from drivers.disk import open_regular
from drivers.errors import SettingsError, shortened
from drivers.plain_yaml import Node, parse_mapping
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
            raise SettingsError("calibration: expected at least one count between 0 g and 1 g on every axis")

    @property
    def mps2_per_count(self) -> Triple:
        """Scale of X, Y, Z [m/s2 per count]."""
        x, y, z = (STANDARD_GRAVITY_MPS2 / (one - zero)
                   for zero, one in zip(self.zero_g_raw, self.one_g_raw, strict=True))
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
        return _profile(parse_mapping(text.decode(), place, Node))
    except UnicodeDecodeError:
        raise SettingsError(f"{place}: expected YAML in UTF-8") from None


_KEYS = ("name", "version", "verified", "source", "framing", "rate_hz", "clock_tolerance_ppm")
_FRAME_KEYS = ("length_bytes", "sync", "word", "offsets", "valid_raw", "upright_axis", "zero_g_raw", "one_g_raw")


def _profile(top: Node) -> WireProfile:
    framing = top.mapping(_KEYS, ("frame", "line"))["framing"].choice("frames", "lines")
    key, layout = ("frame", _frame_layout) if framing == "frames" else ("line", _line_layout)
    keys = top.mapping((*_KEYS, key))
    return WireProfile(name=keys["name"].text(), version=keys["version"].integer(1, 1_000_000),
                       verified=keys["verified"].boolean(), source=keys["source"].text().strip(),
                       rate_hz=keys["rate_hz"].number(1, 10_000),
                       clock_tolerance=keys["clock_tolerance_ppm"].number(1, 50_000) * 1e-6, layout=layout(keys[key]))


def _items(node: Node, count: int) -> tuple[Node, ...]:
    """The nodes of a list of so many numbers, each under the key of the list."""
    if len(node.items()) != count:
        raise node.wrong(f"a list of {count} numbers")
    return tuple(replace(one, key=node.key) for one in node.items())


def _frame_layout(node: Node) -> FrameLayout:
    keys = node.mapping(_FRAME_KEYS)
    length = keys["length_bytes"].integer(6, 256)
    try:
        sync = bytes.fromhex(str(keys["sync"].content))
    except ValueError:
        raise keys["sync"].wrong("bytes in hex, or empty") from None
    if len(sync) > length - 6:
        raise keys["sync"].wrong("start bytes that leave six bytes of the frame for X, Y, Z")
    x, y, z = (one.integer(len(sync), length - 2) for one in _items(keys["offsets"], 3))
    low, high = (one.integer(-32768, 65535) for one in _items(keys["valid_raw"], 2))
    if low >= high:
        raise keys["valid_raw"].wrong("the lower count first")
    axis = keys["upright_axis"].choice(*AXES, "none")
    zero, one_g = ([one.number(-32768, 65535) for one in _items(keys[key], 3)] for key in ("zero_g_raw", "one_g_raw"))
    if any(abs(a - b) < 1 for a, b in zip(zero, one_g, strict=True)):
        raise keys["one_g_raw"].wrong("counts that differ by one or more from those of zero_g_raw")
    return FrameLayout(length_bytes=length, sync=sync, word=keys["word"].choice(*WORDS), offsets=(x, y, z),
                       valid_raw=(low, high), upright_axis=None if axis == "none" else AXES.index(axis),
                       calibration=ScaleCalibration((zero[0], zero[1], zero[2]), (one_g[0], one_g[1], one_g[2])))


def _line_layout(node: Node) -> LineLayout:
    most_numbers = 40  # of one digit in a line of 80 characters
    keys = node.mapping(("unit", "range"), ("numbers", "columns"))
    layout = LineLayout(UNITS_MPS2[keys["unit"].choice(*UNITS_MPS2)], keys["range"].number(1e-3, 1e4))
    if len(keys) == 2:
        return layout
    keys = node.mapping(("unit", "range", "numbers", "columns"))
    numbers = keys["numbers"].integer(3, most_numbers)
    x, y, z = (one.integer(1, numbers) for one in _items(keys["columns"], 3))
    return replace(layout, numbers=numbers, columns=(x, y, z))
