"""From settings to working parts: decoders, pipeline, and what a log must carry to stand alone."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from math import sqrt
from pathlib import Path
from typing import Any

from drivers.bma220 import Bma220Decoder, Bma220Settings, mps2_per_count
from drivers.dump import DumpHeader
from drivers.errors import SettingsError
from drivers.nmea import NmeaDecoder
from drivers.pasco import FrameLayout, PascoDecoder, Profile, load_profile
from logger.dsp.fixed_point import FixedFilter
from logger.dsp.sections import BlockFilter
from logger.dsp.weightings.wk import WEIGHTING
from logger.errors import BadInput
from logger.roads.from_acceleration import RmsRelation, rms_relation
from logger.service.chain import Axis, SignalChain, recorder_gain
from logger.service.config import AXES, AccelerometerConfig, Config
from logger.service.core import AccelerationDecoder
from logger.service.pipeline import Pipeline, PipelineSettings
from logger.shipped import vehicle_file, vehicle_names, version
from logger.store.vehicle_file import read_vehicle

# R.m.s. noise on the 100 Hz grid that no data sheet states: of the chip beside its steps, and of a serial sensor.
BMA220_NOISE_MPS2 = 0.1
SERIAL_NOISE_MPS2 = 0.05


@dataclass(frozen=True)
class Instrument:
    """What the settings say about the accelerometer: its decoder, its step, and a description for the logs."""

    decoder: AccelerationDecoder
    oversample: int
    noise_rms_mps2: float
    description: dict[str, Any]


def bma220_settings(config: AccelerometerConfig) -> Bma220Settings:
    """The driver's settings."""
    chip = config.bma220
    return Bma220Settings(range_g=chip.range_g, bandwidth_hz=chip.bandwidth_hz, oversample=chip.oversample)


def instrument(config: AccelerometerConfig) -> Instrument:
    """Decoder and description of the configured accelerometer. Raises SettingsError for what it cannot be."""
    if config.driver == "bma220":
        chip = bma220_settings(config)
        step_mps2 = mps2_per_count(chip.range_g)
        noise_mps2 = sqrt((step_mps2**2 / 12.0 + BMA220_NOISE_MPS2**2) / chip.oversample)
        description = {
            "driver": "bma220",
            "verified": True,
            "range_g": chip.range_g,
            "mps2_per_count": step_mps2,
            "bandwidth_hz": chip.filter_hz,
            "oversample": chip.oversample,
        }
        return Instrument(Bma220Decoder(chip.range_g), chip.oversample, noise_mps2, description)
    profile = _mounted(load_profile(config.pasco.profile), Axis.from_word(config.vertical_axis))
    description = {
        "driver": "pasco",
        "profile": profile.name,
        "profile_version": profile.version,
        "verified": profile.verified,
        "calibration": asdict(config.pasco.calibration) if config.pasco.calibration else None,
    }
    decoder = PascoDecoder(profile, config.pasco.calibration)
    return Instrument(decoder, 1, SERIAL_NOISE_MPS2, description)


def gps_decoder(config: Config) -> NmeaDecoder:
    """Decoder of the receiver's sentences."""
    return NmeaDecoder(week_rollovers=config.gps.week_rollovers)


def relation(config: Config) -> tuple[RmsRelation, dict[str, Any]]:
    """The vehicle's r.m.s. relation as this recorder sees it, and the vehicle for the logs."""
    vehicle = read_vehicle(config.vehicle)
    gain = recorder_gain(config.pipeline.low_pass_hz)
    return rms_relation(vehicle, gain), asdict(vehicle)


def pipeline(config: Config, sensor: Instrument, vehicle_relation: RmsRelation) -> Pipeline:
    """The pipeline as the settings want it."""
    settings = PipelineSettings(
        window_m=config.pipeline.window_m,
        blind_window_s=config.pipeline.blind_window_s,
        bridge_s=config.gps.bridge_s,
        slow_mps=config.pipeline.slow_mps,
        stationary_mps=config.pipeline.stationary_mps,
        drive_end_s=config.pipeline.drive_end_s,
        latency_s=config.gps.latency_s,
        noise_rms_mps2=sensor.noise_rms_mps2,
    )
    axis = Axis.from_word(config.accelerometer.vertical_axis)
    make_filter = FixedFilter.for_acceleration if config.pipeline.arithmetic == "fixed" else BlockFilter
    chain = SignalChain(axis, WEIGHTING, sensor.oversample, config.pipeline.low_pass_hz, make_filter)
    return Pipeline(settings, chain, vehicle_relation)


def sidecar(config: Config, sensor: Instrument, vehicle: dict[str, Any]) -> dict[str, Any]:
    """What lies beside every log file so that it can be read alone."""
    return {
        "ridelog_version": version(),
        "sensor": sensor.description,
        "vehicle": vehicle,
        "settings": _plain(asdict(config)),
        "iri_m_per_km": "r.m.s. relation of the vehicle at the measured speed; the same value as iri_rms_m_per_km",
        "sees_up_to_hz": 50,
    }


def dump_header(config: Config, sensor: Instrument) -> DumpHeader:
    """First line of a dump recorded by the live service. Its UTC start is not known: a Pi has no clock at boot."""
    keep = ("driver", "range_g", "oversample", "profile")
    accelerometer = {key: sensor.description[key] for key in keep if key in sensor.description}
    accelerometer["vertical_axis"] = config.accelerometer.vertical_axis
    return DumpHeader(None, accelerometer, {"baud": config.gps.baud}, config.vehicle.stem)


def config_for_dump(header: DumpHeader, config: Config, vehicle: str | None, place: str = "header") -> Config:
    """Settings for a replay: those given, with what the recording says about its sensor and its vehicle.

    Raises BadInput, beginning with ``place``, where the recording says what cannot be or names what is not known here.
    """
    says = header.accelerometer
    chip, serial = config.accelerometer.bma220, config.accelerometer.pasco
    axis = says.get("vertical_axis", config.accelerometer.vertical_axis)
    if axis not in AXES:
        raise BadInput(f"{place}: expected 'vertical_axis' out of {', '.join(AXES)}, found {axis!r}")
    range_g, oversample = (says.get(key, getattr(chip, key)) for key in ("range_g", "oversample"))
    if type(range_g) is not int or type(oversample) is not int:
        raise BadInput(f"{place}: expected whole numbers for 'range_g' and 'oversample'")
    profile = says.get("profile", serial.profile)
    if not isinstance(profile, str):
        raise BadInput(f"{place}: expected 'profile' as a name")
    name = vehicle or header.vehicle
    path = vehicle_file(name) if name in vehicle_names() else Path(name)
    if not path.is_file():
        raise BadInput(
            f"{place}: the recording's vehicle {name!r} is not known here; expected --vehicle FILE.yaml or one of: "
            f"{', '.join(vehicle_names())}"
        )
    sensor = AccelerometerConfig(
        driver=says["driver"],
        vertical_axis=axis,
        bma220=replace(chip, range_g=range_g, oversample=oversample),
        pasco=replace(serial, profile=profile),
    )
    try:
        instrument(sensor)
    except SettingsError as error:
        raise BadInput(f"{place}: {error}") from None
    return replace(config, accelerometer=sensor, vehicle=path)


def _mounted(profile: Profile, up: Axis) -> Profile:
    """The profile for a sensor mounted this way: frames without start bytes are told apart by gravity."""
    if not isinstance(profile.layout, FrameLayout) or profile.layout.upright_axis is None:
        return profile
    return replace(profile, layout=replace(profile.layout, upright_axis=up.column))


def _plain(value: Any) -> Any:
    """Settings as JSON can hold them."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return str(value) if isinstance(value, Path) else value
