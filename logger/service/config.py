"""The settings of the service: one YAML file, read into frozen dataclasses.

Problem. A misspelt key that silently becomes a default costs a season of data. So a setting is taken only when
its name, type and range are right, and anything else is refused with file, line and what was expected.

Solution. One dataclass per section holds the defaults; one table per section says how each key is read. The
shipped ``config/ridelog.yaml`` is the documentation, and holds every key with its default.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from drivers.bma220 import Bma220Settings
from drivers.errors import SettingsError
from drivers.nmea import ROLLOVERS_MAX
from logger.errors import BadInput
from logger.shipped import is_path, shipped, vehicle_file, vehicle_path
from logger.store.pairing import MODES, NOT_PAIRED, Pairing
from logger.store.yaml_lines import Node, load_mapping
from logger.units import WINDOW_M

if TYPE_CHECKING:
    from drivers.pasco import Calibration

MACHINE_CONFIG = Path("/etc/ridelog/ridelog.yaml")

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
_RANGES_G = ("2", "4", "8", "16")
_BANDWIDTHS_HZ = ("32", "64", "125", "250", "500", "1000")
_BAUDS = ("1200", "2400", "4800", "9600", "19200", "38400", "57600", "115200", "230400", "460800", "921600")
_DUMP = "dump:"
_LARGEST_COUNT = 65536
_LEAST_STEP_G = 0.1


@dataclass(frozen=True)
class Bma220Config:
    """``i2c_bus`` is the N of /dev/i2c-N, or the path of a recorded drive; ``bandwidth_hz`` None means automatic."""

    i2c_bus: int | Path = 1
    range_g: int = 2
    bandwidth_hz: int | None = None
    oversample: int = 1


@dataclass(frozen=True)
class PascoConfig:
    """``profile`` is a shipped name or a path; ``calibration`` None takes the profile's own."""

    port: str = "/dev/ttyUSB0"
    baud: int = 115200
    profile: str = "lines"
    accept_unverified: bool = False
    calibration: Calibration | None = None


@dataclass(frozen=True)
class AccelerometerConfig:
    """``driver`` is bma220 or pasco; ``vertical_axis`` one of ``AXES``: the sensor's axis that points up."""

    driver: str = "bma220"
    vertical_axis: str = "+z"
    bma220: Bma220Config = Bma220Config()
    pasco: PascoConfig = PascoConfig()


@dataclass(frozen=True)
class GpsConfig:
    """The receiver's line; its latency, the longest loss that is bridged, 1024-week periods to add; where its antenna
    sits, and how far off the places are that it gives from one window to another (standard deviation)."""

    port: str = "/dev/serial0"
    baud: int = 9600
    latency_s: float = 0.10
    bridge_s: float = 10.0
    week_rollovers: int = 0
    antenna_behind_front_axle_m: float = 0.0
    place_std_m: float = 1.0


@dataclass(frozen=True)
class PipelineConfig:
    """``low_pass_hz`` None: no low-pass before the roughness relation; ``arithmetic`` is float or fixed."""

    window_m: float = WINDOW_M
    low_pass_hz: float | None = None
    slow_mps: float = 4.5
    stationary_mps: float = 0.5
    drive_end_s: float = 300.0
    blind_window_s: float = 5.0
    arithmetic: str = "float"


@dataclass(frozen=True)
class LogConfig:
    """Where the logs go, when a file is full, how long a row may stay off the disk, and the room that may be used."""

    directory: Path = Path("/var/lib/ridelog")
    max_file_bytes: int = 4_000_000
    record_dump: bool = False
    sync_s: float = 1.0
    quota_bytes: int | None = None
    keep_free_bytes: int = 200_000_000


@dataclass(frozen=True)
class Config:
    """All settings of the service. ``vehicle`` is the path of its file. Paths are resolved."""

    accelerometer: AccelerometerConfig = AccelerometerConfig()
    gps: GpsConfig = GpsConfig()
    vehicle: Path = field(default_factory=lambda: vehicle_file("rav4-2009"))
    vehicle_error: float = 0.05
    pipeline: PipelineConfig = PipelineConfig()
    log: LogConfig = LogConfig()
    pairing: Pairing = NOT_PAIRED
    status_file: Path = Path("/run/ridelog/status.json")


def find_config(given: Path | None) -> Path:
    """The file to read: the one given, else the machine's (``MACHINE_CONFIG``), else the shipped one."""
    if given is not None:
        return given
    return MACHINE_CONFIG if MACHINE_CONFIG.exists() else shipped("config") / "ridelog.yaml"


def load_config(path: Path) -> Config:
    """Read the settings of a file. Raises BadInput, ``FILE:LINE: expected ...``, for anything not as documented."""
    return _section(Config, {
        "accelerometer": _accelerometer,
        "gps": _gps,
        "vehicle": _vehicle,
        "vehicle_error": _number(0, 1),
        "pipeline": _pipeline,
        "log": _log,
        "pairing": _pairing,
        "status_file": _file_to_write,
    })(load_mapping(path))


def load_pairing(path: Path) -> Pairing:
    """The pairing alone, of settings in which other keys may be wrong. Raises BadInput where it cannot be read."""
    entry = load_mapping(path).mapping().get("pairing")
    return NOT_PAIRED if entry is None else _pairing(entry)


Read = Callable[[Node], Any]
Section = TypeVar("Section")


def _section(kind: type[Section], readers: Mapping[str, Read]) -> Callable[[Node], Section]:
    """Make the reader of a mapping: each key there is by its own reader, the others keep the dataclass's default."""
    def read(node: Node) -> Section:
        entries = node.mapping(optional=readers)
        return kind(**{key: readers[key](entry) for key, entry in entries.items()})
    return read


def _number(low: float, high: float) -> Read:
    return lambda node: node.number(low, high)


def _whole(low: int, high: int) -> Read:
    return lambda node: node.integer(low, high)


def _number_out_of(allowed: tuple[str, ...]) -> Read:
    return lambda node: int(node.choice(*allowed))


def _or_none(word: str, read: Read) -> Read:
    """Let ``word`` stand for None (``null``: any way YAML has to write nothing)."""
    def read_or_none(node: Node) -> Any:
        nothing = node.is_null() if word == "null" else node.content == word
        if nothing:
            return None
        if not isinstance(node.content, str):
            return read(node)
        try:
            return read(node)
        except BadInput as error:
            raise BadInput(str(error).replace("expected ", f"expected {word} or ", 1)) from None
    return read_or_none


def _path(node: Node) -> Path:
    path = Path(node.file).parent.resolve() / node.text()
    try:
        path.exists()
    except OSError as error:
        raise node.wrong(f"a path that can be ({error.strerror})") from None
    return path


def _file_to_write(node: Node) -> Path:
    path = _path(node)
    if path.exists() and not path.is_file():
        raise node.wrong("the name of a file to write (this is a folder or a device)")
    return path


def _vehicle(node: Node) -> Path:
    try:
        path = vehicle_path(node.text(), beside=Path(node.file).parent.resolve())
    except BadInput as error:
        raise BadInput(f"{node.file}:{node.line}: {error}") from None
    if not _path(replace(node, content=str(path))).is_file():
        raise node.wrong("a vehicle's file (there is no such file)")
    return path


def _i2c_bus(node: Node) -> int | Path:
    text = node.content
    if isinstance(text, str) and text.startswith(_DUMP):
        path = _path(replace(node, content=text.removeprefix(_DUMP)))
        if not path.is_file():
            raise node.wrong("a recorded dump (there is no such file)")
        return path
    if not node.plain or not isinstance(text, str) or not text.isdigit():
        raise node.wrong("the number of an I2C bus from 0 to 255, or dump:FILE")
    return node.integer(0, 255)


def _profile(node: Node) -> str:
    return str(_path(node)) if is_path(node.text()) else node.text()


def _calibration(node: Node) -> Calibration:
    from drivers.pasco import Calibration  # only loaded for this instrument

    axes = node.mapping(required=("x", "y", "z"))
    zeros_raw, ones_raw = zip(*(_counts_at_0_and_1_g(axes[axis]) for axis in "xyz"), strict=True)
    return Calibration(zero_g_raw=zeros_raw, one_g_raw=ones_raw)


def _counts_at_0_and_1_g(node: Node) -> tuple[float, float]:
    """Two points of an axis, extended to the counts at 0 and at 1 g."""
    values = [item.number(-_LARGEST_COUNT, _LARGEST_COUNT) for item in node.items()]
    if len(values) != 4 or abs(values[3] - values[1]) < _LEAST_STEP_G:
        raise node.wrong(f"two different points [raw, g, raw, g], {_LEAST_STEP_G} g or more apart")
    first_raw, first_g, second_raw, second_g = values
    counts_per_g = (second_raw - first_raw) / (second_g - first_g)
    if abs(counts_per_g) < 1:
        raise node.wrong("two different points [raw, g, raw, g], a count per g or more apart")
    zero_g_raw = first_raw - first_g * counts_per_g
    return zero_g_raw, zero_g_raw + counts_per_g


_read_pasco = _section(PascoConfig, {
    "port": Node.text,
    "baud": _number_out_of(_BAUDS),
    "profile": _profile,
    "accept_unverified": Node.boolean,
    "calibration": _or_none("null", _calibration),
})

_read_bma220 = _section(Bma220Config, {
    "i2c_bus": _i2c_bus,
    "range_g": _number_out_of(_RANGES_G),
    "bandwidth_hz": _or_none("auto", _number_out_of(_BANDWIDTHS_HZ)),
    "oversample": _whole(1, 8),
})


def _bma220(node: Node) -> Bma220Config:
    config = _read_bma220(node)
    try:
        Bma220Settings(range_g=config.range_g, bandwidth_hz=config.bandwidth_hz, oversample=config.oversample)
    except SettingsError as error:
        raise BadInput(f"{node.file}:{node.line}: {error}") from None
    return config


_read_accelerometer = _section(AccelerometerConfig, {
    "driver": lambda node: node.choice("bma220", "pasco"),
    "vertical_axis": lambda node: node.choice(*AXES),
    "bma220": _bma220,
    "pasco": _read_pasco,
})

_gps = _section(GpsConfig, {
    "port": Node.text,
    "baud": _number_out_of(_BAUDS),
    "latency_s": _number(0, 2),
    "bridge_s": _number(0, 60),
    "week_rollovers": _whole(0, ROLLOVERS_MAX),
    "antenna_behind_front_axle_m": _number(-3, 15),
    "place_std_m": _number(0, 100),
})

_read_pipeline = _section(PipelineConfig, {
    "window_m": _number(1, 1000),
    "low_pass_hz": _or_none("null", _number(1, 45)),
    "slow_mps": _number(0.1, 50),
    "stationary_mps": _number(0.05, 5),
    "drive_end_s": _number(10, 86400),
    "blind_window_s": _number(1, 60),
    "arithmetic": lambda node: node.choice("float", "fixed"),
})

_log = _section(LogConfig, {
    "directory": _path,
    "max_file_bytes": _whole(10_000, 1_000_000_000),
    "record_dump": Node.boolean,
    "sync_s": _number(0.1, 60),
    "quota_bytes": _or_none("null", _whole(200_000_000, 10**15)),
    "keep_free_bytes": _whole(0, 10**15),
})


_pairing = _section(Pairing, {
    "mode": lambda node: node.choice(*MODES),
    "key_file": _path,
})


def _pipeline(node: Node) -> PipelineConfig:
    pipeline = _read_pipeline(node)
    if pipeline.stationary_mps >= pipeline.slow_mps:
        entry = node.mapping().get("stationary_mps", node)
        raise BadInput(f"{entry.file}:{entry.line}: expected stationary_mps to be less than slow_mps, found "
                       f"{pipeline.stationary_mps:g} and {pipeline.slow_mps:g}")
    return pipeline


def _accelerometer(node: Node) -> AccelerometerConfig:
    settings = _read_accelerometer(node)
    if settings.driver == "pasco":
        pasco = node.mapping().get("pasco", node)
        _refuse_silent_guess(settings.pasco, pasco)
    return settings


def _refuse_silent_guess(pasco: PascoConfig, node: Node) -> None:
    """Refuse a profile that nobody has seen work on hardware, unless the file says that this is known."""
    from drivers.pasco import load_profile  # only loaded for this instrument

    entry = node.mapping().get("profile", node)
    try:
        profile = load_profile(pasco.profile)
    except SettingsError as error:
        raise BadInput(f"{entry.file}:{entry.line}: {error}") from None
    if not profile.verified and not pasco.accept_unverified:
        raise BadInput(f"{entry.file}:{entry.line}: expected a verified profile, and {profile.name!r} is not verified "
                       "on hardware; set accept_unverified: true beside it to use it all the same")
