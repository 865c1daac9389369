"""From settings to working parts: decoders, pipeline, and what a log must carry to stand alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from math import sqrt
from pathlib import Path
from typing import Any

from drivers.bma220 import Bma220Decoder, Bma220Settings, mps2_per_count
from drivers.dump import DumpHeader
from drivers.errors import SettingsError, shortened
from drivers.nmea import NmeaDecoder
from drivers.pasco import FrameLayout, PascoDecoder, Profile, load_profile
from logger.dsp.fixed_point import FixedFilter
from logger.dsp.sections import BlockFilter
from logger.dsp.weightings.wk import WEIGHTING
from logger.errors import BadInput
from logger.estimation.rms_relation import rms_relation
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import RoadEstimator
from logger.service.chain import Axis, SignalChain, recorder_gain
from logger.service.config import AXES, AccelerometerConfig, Config
from logger.service.core import AccelerationDecoder
from logger.service.pipeline import Pipeline, PipelineSettings
from logger.shipped import vehicle_file, vehicle_names, version
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point
from logger.vehicle.vehicle import Vehicle

# R.m.s. noise on the 100 Hz grid that no data sheet states: of the chip beside its steps, and of a serial sensor.
BMA220_NOISE_MPS2 = 0.1
SERIAL_NOISE_MPS2 = 0.05


@dataclass(frozen=True)
class Instrument:
    """What the settings say about the accelerometer: its decoder, what its readings on the 100 Hz grid are, a
    description for the logs, and a look at what the decoder has counted."""

    decoder: AccelerationDecoder
    oversample: int
    sensor: Sensor
    description: dict[str, Any]
    counters: Callable[[], dict[str, int]]


def bma220_settings(config: AccelerometerConfig) -> Bma220Settings:
    """The driver's settings."""
    chip = config.bma220
    return Bma220Settings(range_g=chip.range_g, bandwidth_hz=chip.bandwidth_hz, oversample=chip.oversample)


def instrument(config: AccelerometerConfig) -> Instrument:
    """Decoder and description of the configured accelerometer. Raises SettingsError for what it cannot be."""
    if config.driver == "bma220":
        chip = bma220_settings(config)
        step_mps2 = mps2_per_count(chip.range_g)
        sensor = Sensor(BMA220_NOISE_MPS2, step_mps2)
        if chip.oversample > 1:  # the mean of several readings is on no step any more
            sensor = Sensor(sqrt(sensor.variance_mps2_2 / chip.oversample), 0.0)
        description = {
            "driver": "bma220",
            "verified": True,
            "range_g": chip.range_g,
            "mps2_per_count": step_mps2,
            "bandwidth_hz": chip.filter_hz,
            "oversample": chip.oversample,
        }
        bytes_decoder = Bma220Decoder(chip.range_g)

        def counters() -> dict[str, int]:
            return {"odd_bits": bytes_decoder.anomalies, "repeated_samples": bytes_decoder.repeats}

        return Instrument(bytes_decoder, chip.oversample, sensor, description, counters)
    profile = _mounted(load_profile(config.pasco.profile), Axis.from_word(config.vertical_axis))
    description = {
        "driver": "pasco",
        "profile": profile.name,
        "profile_version": profile.version,
        "verified": profile.verified,
        "calibration": asdict(config.pasco.calibration) if config.pasco.calibration else None,
    }
    decoder = PascoDecoder(profile, config.pasco.calibration)
    sensor = Sensor(SERIAL_NOISE_MPS2, 0.0)
    return Instrument(decoder, 1, sensor, description, lambda: asdict(decoder.counters))


def gps_decoder(config: Config) -> NmeaDecoder:
    """Decoder of the receiver's sentences."""
    return NmeaDecoder(week_rollovers=config.gps.week_rollovers)


def pipeline(config: Config, sensor: Instrument, vehicle: Vehicle) -> Pipeline:
    """The pipeline as the settings want it."""
    settings = PipelineSettings(
        window_m=config.pipeline.window_m,
        blind_window_s=config.pipeline.blind_window_s,
        bridge_s=config.gps.bridge_s,
        slow_mps=config.pipeline.slow_mps,
        stationary_mps=config.pipeline.stationary_mps,
        drive_end_s=config.pipeline.drive_end_s,
        latency_s=config.gps.latency_s,
        front_axle_ahead_m=config.gps.antenna_behind_front_axle_m,
    )
    axis = Axis.from_word(config.accelerometer.vertical_axis)
    make_filter = FixedFilter.for_acceleration if config.pipeline.arithmetic == "fixed" else BlockFilter
    low_pass_hz = config.pipeline.low_pass_hz
    chain = SignalChain(axis, WEIGHTING, sensor.oversample, low_pass_hz, sensor.sensor.is_coarse, make_filter)
    structure = structure_of(vehicle)
    place = body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m)
    estimator = RoadEstimator(
        structure, place, sensor.sensor, config.pipeline.window_m, config.gps.place_std_m, config.vehicle_error
    )
    return Pipeline(settings, chain, rms_relation(vehicle, recorder_gain(low_pass_hz)), estimator)


def notices(vehicle: Vehicle) -> tuple[str, ...]:
    """What the settings allow and somebody should know all the same."""
    if not vehicle.sensor.left_m:
        return ()
    side = "left" if vehicle.sensor.left_m > 0 else "right"
    return (f"vehicle {vehicle.name}: the sensor sits {abs(vehicle.sensor.left_m):g} m {side} of the middle "
            "(sensor.left_m): roll is not corrected, it reads as roughness. Mount it in the middle.",)


def sidecar(config: Config, sensor: Instrument, vehicle: Vehicle) -> dict[str, Any]:
    """What lies beside every log file so that it can be read alone."""
    return {
        "ridelog_version": version(),
        "sensor": sensor.description,
        "vehicle": asdict(vehicle),
        "settings": _plain(asdict(config)),
        "iri_m_per_km": "IRI of the road estimated from acceleration, speed and the vehicle's model",
        "sees_up_to_hz": 50,
    }


def dump_header(config: Config) -> DumpHeader:
    """First line of a dump recorded by the live service. Its UTC start is not known: a Pi has no clock at boot."""
    sensor = config.accelerometer
    accelerometer: dict[str, Any] = {"driver": sensor.driver, "vertical_axis": sensor.vertical_axis}
    if sensor.driver == "bma220":
        accelerometer |= {"range_g": sensor.bma220.range_g, "oversample": sensor.bma220.oversample}
    else:
        accelerometer |= {"profile": sensor.pasco.profile, "calibrated": sensor.pasco.calibration is not None}
    stem = config.vehicle.stem
    is_shipped = stem in vehicle_names() and config.vehicle == vehicle_file(stem)
    return DumpHeader(None, accelerometer, {"baud": config.gps.baud}, stem if is_shipped else str(config.vehicle))


def config_for_dump(header: DumpHeader, given: Config | None, vehicle: str | None, place: str = "header") -> Config:
    """Settings for a replay. What is in the bytes (driver, range, oversampling) is always the recording's; the rest is
    that of the settings ``given``, or without them the defaults with what the recording's header says.

    Raises BadInput, beginning with ``place``, where the recording says what cannot be or names what is not known here.
    """
    says = header.accelerometer
    config = given or Config()
    chip, serial = config.accelerometer.bma220, config.accelerometer.pasco
    axis, profile = config.accelerometer.vertical_axis, serial.profile
    if given is None:
        axis, profile = says.get("vertical_axis", axis), says.get("profile", profile)
        if says.get("calibrated"):
            raise BadInput(f"{place}: recorded with a calibration of its own; expected its settings, --config FILE")
    range_g, oversample = (says.get(key, getattr(chip, key)) for key in ("range_g", "oversample"))
    if axis not in AXES:
        raise BadInput(f"{place}: expected 'vertical_axis' out of {', '.join(AXES)}, found {shortened(str(axis))}")
    if type(range_g) is not int or type(oversample) is not int:
        raise BadInput(f"{place}: expected whole numbers for 'range_g' and 'oversample'")
    if not isinstance(profile, str):
        raise BadInput(f"{place}: expected 'profile' as a name")
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
    if given is None or vehicle is not None:
        config = replace(config, vehicle=_vehicle_file(vehicle or header.vehicle, place))
    return replace(config, accelerometer=sensor)


def _vehicle_file(name: str, place: str) -> Path:
    path = vehicle_file(name) if name in vehicle_names() else Path(name)
    try:
        known = path.is_file()
    except OSError:  # a name that can be none
        known = False
    if not known:
        raise BadInput(
            f"{place}: the recording's vehicle {shortened(name)} is not known here; expected --vehicle FILE.yaml or "
            f"one of: {', '.join(vehicle_names())}"
        )
    return path


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
