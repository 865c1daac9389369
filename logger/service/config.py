"""The settings of the service: one YAML file, read into frozen dataclasses.

Problem. A misspelt key that silently becomes a default costs a season of data. So a setting is taken only when
its name, type and range are right, and anything else is refused with file, line and what was expected.

Solution. One dataclass per section holds of each key its default and how it is read. The shipped
``config/ridelog.yaml`` is the documentation, and holds every key with its default.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

from drivers.accelerometers import DEFAULT, accelerometers
from drivers.accelerometers.accelerometer import Accelerometer
from drivers.errors import SettingsError
from drivers.nmea import GPS_BEGAN, ROLLOVERS_MAX
from drivers.readings import BAUDS, Decimal, OrNone, Whole
from logger.errors import BadInput
from logger.question import CAR_MASS, READING_NOISE, WHEELBASE
from logger.shipped import shipped, vehicle_file, vehicle_path
from logger.store.export.sticks import MODES, NOT_PAIRED, Pairing
from logger.store.formats.yaml_nodes import Node, load_mapping
from logger.store.log.log_name import CAR
from logger.units import WINDOW_M
from logger.vehicle.vehicle import GENERIC

log = logging.getLogger(__name__)

MACHINE_CONFIG = Path("/etc/ridelog/ridelog.yaml")

AUTO = "auto"
AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
GRAVITY_TOLERANCE_G = 0.4  # of what the axis that points up feels
Read = Callable[[Node], Any]
Section = TypeVar("Section")


def _setting(default: Any, read: Read) -> Any:
    """A field of a section: its default, and how it is read."""
    return field(default=default, metadata={"read": read})


def _section(kind: type[Section], readers: Mapping[str, Read] | None = None) -> Callable[[Node], Section]:
    """Make the reader of a mapping: each key there is by its own reader, the others keep the dataclass's default.
    ``readers`` None: they stand in its fields."""
    known = readers if readers is not None else {
        one.name: one.metadata["read"] for one in fields(kind)}  # type: ignore[arg-type]

    def read(node: Node) -> Section:
        return kind(**{key: known[key](entry) for key, entry in node.mapping(optional=known).items()})
    return read


def _noise(node: Node) -> float | str:
    """A noise, or ``AUTO``; ``null``, as earlier versions shipped, says nothing."""
    noise = None if node.is_null() else OrNone(AUTO, Decimal(*READING_NOISE[:2])).read(node)
    return AUTO if noise is None else float(noise)


def _file_to_write(node: Node) -> Path:
    path = node.path()
    if path.exists() and not path.is_file():
        raise node.wrong("the name of a file to write (this is a folder or a device)")
    return path


def _vehicle(node: Node) -> Path:
    if node.text() == AUTO:
        return Path(AUTO)
    try:
        path = vehicle_path(node.text(), beside=Path(node.file).parent.resolve())
    except BadInput as error:
        raise BadInput(f"{node.file}:{node.line}: {error}") from None
    if not replace(node, content=str(path)).path().is_file():
        raise node.wrong("a vehicle's file (there is no such file)")
    return path


def _section_of(accelerometer: Accelerometer[Any]) -> Read:
    read = _section(accelerometer.settings, {key: kind.read for key, kind in accelerometer.keys.items()})

    def read_checked(node: Node) -> Any:
        try:
            return read(node)
        except SettingsError as error:
            raise _blamed(error, node) from None
    return read_checked


def _blamed(error: SettingsError, section: Node) -> BadInput:
    """The error with the line of its key, or of the section."""
    entry = section.content.get(error.key, section) if isinstance(section.content, Mapping) else section
    return BadInput(f"{entry.file}:{entry.line}: {error}")


def _date(node: Node) -> str:
    text = node.text()
    try:
        day = date.fromisoformat(text)
    except ValueError:
        raise node.wrong(f"a date such as {GPS_BEGAN:%Y-%m-%d}") from None
    if day < GPS_BEGAN:
        raise node.wrong(f"a date from {GPS_BEGAN:%Y-%m-%d} on, when GPS time began")
    return day.isoformat()


@dataclass(frozen=True)
class AccelerometerConfig:
    """``driver`` is the name of the accelerometer; ``vertical_axis`` one of ``AXES``: the sensor's axis that points up;
    ``sections`` the settings of each accelerometer by its name, of which only those of ``driver`` are used;
    ``noise_mps2`` the r.m.s. noise of one reading (``AUTO``: learned; None, in no settings but those of recordings by
    loggers that did not learn it: what is usual of it)."""

    driver: str = DEFAULT
    vertical_axis: str = "+z"
    sections: Mapping[str, Any] = field(
        default_factory=lambda: {name: kind.settings() for name, kind in accelerometers().items()})
    noise_mps2: float | str | None = AUTO

    @property
    def kind(self) -> Accelerometer[Any]:
        return accelerometers()[self.driver]

    @property
    def settings(self) -> Any:
        return self.sections[self.driver]


def _accelerometer(node: Node) -> AccelerometerConfig:
    kinds = accelerometers()
    readers: dict[str, Read] = {
        "driver": lambda entry: entry.choice(*kinds),
        "vertical_axis": lambda entry: entry.choice(*AXES),
        "noise_mps2": _noise,
        **{name: _section_of(kind) for name, kind in kinds.items()},
    }
    read = {key: readers[key](entry) for key, entry in node.mapping(optional=readers).items()}
    usual = AccelerometerConfig()
    config = AccelerometerConfig(read.get("driver", usual.driver), read.get("vertical_axis", usual.vertical_axis),
                                 {name: read.get(name, settings) for name, settings in usual.sections.items()},
                                 read.get("noise_mps2", usual.noise_mps2))
    try:
        config.kind.check_chosen(config.settings)
    except SettingsError as error:
        raise _blamed(error, node.mapping().get(config.driver, node)) from None
    return config


@dataclass(frozen=True)
class GpsConfig:
    """The receiver's line; its latency (None: as it was learned), the longest loss that is bridged, 1024-week periods
    to add, and the date (ISO 8601) before which what it says cannot be true; where its antenna sits, and how far off
    the places are that it gives from one window to another (standard deviation)."""

    port: str = _setting("/dev/serial0", Node.text)
    baud: int = _setting(9600, BAUDS.read)
    latency_s: float | None = _setting(None, OrNone("auto", Decimal(0, 2)).read)
    bridge_s: float = _setting(10.0, Decimal(0, 60).read)
    week_rollovers: int = _setting(0, Whole(0, ROLLOVERS_MAX).read)
    earliest_date: str = _setting("2026-01-01", _date)
    antenna_behind_front_axle_m: float = _setting(0.0, Decimal(-3, 15).read)
    place_std_m: float = _setting(1.0, Decimal(0, 100).read)


@dataclass(frozen=True)
class PipelineConfig:
    """``low_pass_hz`` None: no low-pass before the roughness relation; ``arithmetic`` is float or fixed."""

    window_m: float = _setting(WINDOW_M, Decimal(1, 1000).read)
    low_pass_hz: float | None = _setting(None, OrNone("null", Decimal(1, 45)).read)
    slow_mps: float = _setting(4.5, Decimal(0.1, 50).read)
    stationary_mps: float = _setting(0.5, Decimal(0.05, 5).read)
    drive_end_s: float = _setting(300.0, Decimal(10, 86400).read)
    blind_window_s: float = _setting(5.0, Decimal(1, 60).read)
    arithmetic: str = _setting("float", lambda node: node.choice("float", "fixed"))


def _pipeline(node: Node) -> PipelineConfig:
    pipeline = _section(PipelineConfig)(node)
    if pipeline.stationary_mps >= pipeline.slow_mps:
        entry = node.mapping().get("stationary_mps", node)
        raise BadInput(f"{entry.file}:{entry.line}: expected stationary_mps to be less than slow_mps, found "
                       f"{pipeline.stationary_mps:g} and {pipeline.slow_mps:g}")
    return pipeline


@dataclass(frozen=True)
class LogConfig:
    """Where the logs go, when a file is full, how long a row may stay off the disk, and the room that may be used."""

    directory: Path = _setting(Path("/var/lib/ridelog"), Node.path)
    max_file_bytes: int = _setting(4_000_000, Whole(10_000, 1_000_000_000).read)
    record_dump: bool = _setting(False, Node.boolean)
    sync_s: float = _setting(1.0, Decimal(0.1, 60).read)
    quota_bytes: int | None = _setting(None, OrNone("null", Whole(200_000_000, 10**15)).read)
    keep_free_bytes: int = _setting(200_000_000, Whole(0, 10**15).read)


_pairing = _section(Pairing, {"mode": lambda node: node.choice(*MODES), "key_file": Node.path})


@dataclass(frozen=True)
class Config:
    """All settings of the service. ``vehicle`` is the path of its file; of a car that is not known (``GENERIC``) its
    wheelbase [m] and curb weight [kg] may be; None: neither is. Paths are resolved."""

    accelerometer: AccelerometerConfig = field(default_factory=AccelerometerConfig, metadata={"read": _accelerometer})
    gps: GpsConfig = _setting(GpsConfig(), _section(GpsConfig))
    vehicle: Path = field(default_factory=lambda: vehicle_file(GENERIC), metadata={"read": _vehicle})
    wheelbase_m: float | None = _setting(None, OrNone("null", Decimal(*WHEELBASE[:2])).read)
    mass_kg: float | None = _setting(None, OrNone("null", Decimal(*CAR_MASS[:2])).read)
    vehicle_error: float = _setting(0.05, Decimal(0, 1).read)
    pipeline: PipelineConfig = _setting(PipelineConfig(), _pipeline)
    log: LogConfig = _setting(LogConfig(), _section(LogConfig))
    pairing: Pairing = _setting(NOT_PAIRED, _pairing)
    status_file: Path = _setting(Path("/run/ridelog/status.json"), _file_to_write)


def find_config(given: Path | None) -> Path:
    """The file to read: the one given, else the machine's (``MACHINE_CONFIG``), else the shipped one."""
    if given is not None:
        return given
    return MACHINE_CONFIG if MACHINE_CONFIG.exists() else shipped("config") / "ridelog.yaml"


def load_config(path: Path) -> Config:
    """Read the settings of a file. Raises BadInput, ``FILE:LINE: expected ...``, for anything not as documented."""
    config = _section(Config)(load_mapping(path))
    if config.vehicle != Path(AUTO):
        return config
    if config.wheelbase_m is None:
        raise BadInput(f"{path}: vehicle: auto: expected wheelbase_m, which drives are compared with, found none")
    return replace(config, vehicle=_learned_car(config.log.directory) or vehicle_file(GENERIC))


def learned_path(folder: Path, session: int) -> Path:
    """The file of what ``vehicle: auto`` learns from the logs in a folder, up to those of a session. A car keeps its
    file, so that a recording can be replayed with the one it was driven with."""
    return folder / f"car-{session:05d}.yaml"


def _learned_car(folder: Path) -> Path | None:
    """The last car that was learned. Nobody is there to take away a file that a card has spoilt: it is passed over."""
    from logger.store.formats.vehicle_file import read_on_board

    sessions = [int(match[1]) for path in folder.glob("car-*.yaml") if (match := CAR.fullmatch(path.name))]
    for path in (learned_path(folder, one) for one in sorted(sessions, reverse=True)):
        try:
            read_on_board(path)
        except (BadInput, OSError) as error:
            log.warning("vehicle: auto: passed over %s", error)
        else:
            return path
    return None


def learns_car(path: Path) -> bool:
    """Whether the settings of a file want the car learned from the logs."""
    entry = load_mapping(path).mapping().get("vehicle")
    return entry is not None and entry.text() == AUTO


def load_pairing(path: Path) -> Pairing:
    """The pairing alone, of settings in which other keys may be wrong. Raises BadInput where it cannot be read."""
    entry = load_mapping(path).mapping().get("pairing")
    return NOT_PAIRED if entry is None else _pairing(entry)
