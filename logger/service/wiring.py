"""From settings or a recording to working parts: decoders, pipeline, and what a log must carry to stand alone.

Readings that come at another rate than a recording's header says are refused: all samples of the grid would be holes,
and every window would be flagged for it without a word on why.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import date
from itertools import islice
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from drivers.accelerometers import accelerometers
from drivers.accelerometers.accelerometer import Decoder
from drivers.dump import DumpHeader, open_dump
from drivers.errors import SettingsError
from drivers.nmea import NmeaDecoder, midnight_utc_us
from drivers.readings import BAUDS, GPS, RecordedWords
from logger.bounds import UNUSUAL_SIGMA
from logger.comfort.uncertain_ride import NoiseFloor
from logger.dsp.filters import BlockFilter
from logger.dsp.fixed_point import FixedFilter
from logger.dsp.resample import GRID_RATE_HZ
from logger.dsp.weightings.wk import WEIGHTING
from logger.errors import BadInput, as_bad_input
from logger.estimation.car_response import LOG_WAVES, WAVE_NUMBERS_CPM, CarResponse
from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.drive_spectra import SpectraKeeper
from logger.estimation.iri_posterior import slope_knowledge
from logger.estimation.receiver_delay import CarriedDelay
from logger.estimation.rms_calibration import rms_relation
from logger.estimation.road_spectrum import COMMON_ROAD
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.streaming import RoadEstimator
from logger.question import CAR_MASS, READING_NOISE, WHEELBASE
from logger.service.config import AUTO, AXES, AccelerometerConfig, Config
from logger.service.drive_readings import RangeUse
from logger.service.learning import DELAY, NOISE, KnownNoise, delay_at_start, is_loggers
from logger.service.pipeline import Pipeline, PipelineSettings
from logger.service.signal_chain import Axis, ComfortColumns, SignalChain, recorder_gain, weighted_response
from logger.shipped import vehicle_file, vehicle_names, vehicle_path, version
from logger.store.formats.vehicle_file import CarModel, read_on_board
from logger.units import WINDOW_M
from logger.vehicle.compose import Car, compose
from logger.vehicle.linearise import known_car, known_vehicle
from logger.vehicle.published_cars import WHEELBASE_ERROR, generic_car
from logger.vehicle.uncertain import cars_off, not_known
from logger.vehicle.vehicle import GENERIC


def check_recorded_rate(dump: Path, sensor: "Instrument") -> None:
    """Raise BadInput where the readings of a sensor that is read several times per sample came too seldom for that."""
    looked_at = 2000  # events
    slower = 1.5  # as many times as long between most readings is no busy bus, but another rate
    if sensor.oversample == 1:
        return
    with open_dump(dump) as reader:
        times_us = np.array([t_us for t_us, source, _ in islice(reader, looked_at) if source != GPS], dtype=float)
    if len(times_us) < 2:
        return
    rate_hz, found_us = GRID_RATE_HZ * sensor.oversample, float(np.median(np.diff(times_us)))
    if found_us * rate_hz > slower * 1e6:
        raise BadInput(f"{dump}:1: expected readings at {rate_hz:g} Hz, as 'oversample': {sensor.oversample} says, "
                       f"found them at about {1e6 / found_us:.3g} Hz")


_READS = "reads"  # how many readings per sample there are, each of which has the noise that is said


@dataclass(frozen=True)
class Instrument:
    """What the settings say about the accelerometer: its decoder, what its readings are, and a description for the
    logs.

    sensor   of a reading: of each of them where the steps are larger than the noise, else of what several per sample of
             the 100 Hz grid are thinned out to
    noise    what is believed of the noise of such a reading, which the pipeline then learns; None: it is that of the
             sensor
    """

    decoder: Decoder
    oversample: int
    sensor: Sensor
    description: dict[str, Any]
    noise: NoiseBelief | None = None

    @property
    def reads(self) -> int:
        """Readings of each sample of the grid that the road's estimate is made of."""
        return self.oversample if self.sensor.is_coarse else 1

    def on_grid(self, noise_mps2: float) -> Sensor:
        """Of the samples of the grid, for such a noise of a reading: the mean of several is taken to have no steps."""
        reading = Sensor(noise_mps2, self.sensor.step_mps2)
        return reading if self.reads == 1 else _thinned(reading, self.reads)


def instrument(config: AccelerometerConfig, known: KnownNoise | None = None) -> Instrument:
    """Decoder and description of the configured accelerometer. Raises SettingsError for what it cannot be.

    known    what earlier drives showed of its noise, where it is to be learned; None: nothing
    """
    kind, settings = config.kind, config.settings
    readings = kind.readings(settings)
    given = config.noise_mps2
    sensor = Sensor(given if isinstance(given, float) else readings.noise_mps2, readings.step_mps2)
    if readings.oversample > 1 and not sensor.is_coarse:
        sensor = _thinned(sensor, readings.oversample)
    decoder = kind.decoder(settings, Axis.from_word(config.vertical_axis).column)
    noise = None
    if given == AUTO:
        noise = known.belief if known else NoiseBelief.guessed(sensor.noise_rms_mps2)
    return Instrument(decoder, readings.oversample, sensor, {"driver": kind.name, **kind.facts(settings)}, noise)


def _thinned(reading: Sensor, count: int) -> Sensor:
    """Of the mean of ``count`` readings, whose rounding has become noise."""
    return Sensor(sqrt(reading.variance_mps2_2 / count), 0.0)


def gps_decoder(config: Config) -> NmeaDecoder:
    """Decoder of the receiver's sentences."""
    earliest_us = midnight_utc_us(date.fromisoformat(config.gps.earliest_date))
    return NmeaDecoder(week_rollovers=config.gps.week_rollovers, earliest_utc_us=earliest_us, baud=config.gps.baud)


def pipeline(config: Config, sensor: Instrument, model: CarModel, receiver: CarriedDelay | None = None) -> Pipeline:
    """The pipeline as the settings want it. ``receiver``: what is known of its delay; None: as before any drive.

    Raises BadInput for a vehicle that lacks what its model or an effect needs.
    """
    receiver = receiver or delay_at_start(config.gps, None)
    low_pass_hz = config.pipeline.low_pass_hz
    settings = PipelineSettings(window_m=config.pipeline.window_m, blind_window_s=config.pipeline.blind_window_s,
                                bridge_s=config.gps.bridge_s, slow_mps=config.pipeline.slow_mps,
                                stationary_mps=config.pipeline.stationary_mps, drive_end_s=config.pipeline.drive_end_s,
                                latency_s=receiver.delay_s, front_axle_ahead_m=config.gps.antenna_behind_front_axle_m)
    axis = Axis.from_word(config.accelerometer.vertical_axis)
    vehicle, effects = model.vehicle, model.effects
    try:
        composed = compose(vehicle, effects)
        car, off = known_car(composed), cars_off(vehicle, effects, model.errors)
    except ValueError as error:
        raise BadInput(f"vehicle {vehicle.name}: {error}") from None
    estimator = RoadEstimator(
        car, sensor.sensor, config.pipeline.window_m, config.gps.place_std_m, config.vehicle_error,
        late_std_s=receiver.std_s,
        noise=sensor.noise,
        # Where the noise blurs the steps, its power is all there is to take off: no model of the car is needed.
        ride_response=weighted_response(WEIGHTING, low_pass_hz) if sensor.sensor.is_coarse else None,
        ride_ahead_m=settings.front_axle_ahead_m,
        off=off,
        is_measured=vehicle.name != GENERIC,
        driven_share=_driven_share(composed),
        reads=sensor.reads,
    )
    alignment = DriveAlignment(axis.column, axis.sign)
    columns = ComfortColumns(_noise_floor(sensor, low_pass_hz), sensor.sensor)
    relation = rms_relation(car, recorder_gain(low_pass_hz))
    on_grid = sensor.on_grid(sensor.sensor.noise_rms_mps2)
    spectra = SpectraKeeper(GRID_RATE_HZ, 2 * on_grid.variance_mps2_2 / GRID_RATE_HZ)
    return Pipeline(settings, signal_chain(config, sensor), relation, estimator, alignment, columns,
                    RangeUse(config.accelerometer.kind.others(config.accelerometer.settings)), spectra)


def car_of(config: Config, read: Callable[[Path], CarModel] = read_on_board) -> CarModel:
    """The car of the settings: its file, as ``read`` reads it; of a car that is not known what its wheelbase and mass
    tell besides. Raises BadInput as ``read``."""
    model = read(config.vehicle)
    if model.vehicle.name != GENERIC:
        return model
    vehicle, errors = generic_car(config.wheelbase_m, config.mass_kg)
    return replace(model, vehicle=replace(vehicle, sensor=model.vehicle.sensor), errors=errors)


def _driven_share(car: Car) -> float:
    """Way that is driven while the distance that is recorded grows by one metre [m]; 1 where nothing is said of it."""
    if not car.drives:
        return 1.0
    begin_m, end_m = car.driven(np.array([0.0, 1.0]))
    return float(end_m - begin_m)


def signal_chain(config: Config, sensor: Instrument) -> SignalChain:
    """The filters between the sensor and the windows."""
    axis = Axis.from_word(config.accelerometer.vertical_axis)
    make_filter = FixedFilter.for_acceleration if config.pipeline.arithmetic == "fixed" else BlockFilter
    return SignalChain(axis, WEIGHTING, sensor.oversample, config.pipeline.low_pass_hz, sensor.sensor.is_coarse,
                       make_filter)


def _noise_floor(sensor: Instrument, low_pass_hz: float | None) -> NoiseFloor:
    floor_lines = 1025  # finer than the slowest wave that a weighting lets through
    f_hz = np.linspace(0.0, GRID_RATE_HZ / 2, floor_lines)
    gain = np.abs(weighted_response(WEIGHTING, low_pass_hz)(f_hz))
    return NoiseFloor(gain, GRID_RATE_HZ, sensor.sensor.step_mps2, sensor.reads)


def notices(config: Config, model: CarModel, sensor: Instrument) -> tuple[str, ...]:
    """What the settings allow and somebody should know all the same."""
    same_wheelbase = UNUSUAL_SIGMA * WHEELBASE_ERROR
    vehicle, found = model.vehicle, []
    if vehicle.sensor.left_m:
        side = "left" if vehicle.sensor.left_m > 0 else "right"
        found.append(f"vehicle {vehicle.name}: the sensor sits {abs(vehicle.sensor.left_m):g} m {side} of the middle "
                     "(sensor.left_m): ridelog does not correct for roll, which reads as roughness. Mount it in the "
                     "middle.")
    if vehicle.name == GENERIC:
        missing = "" if config.wheelbase_m is not None else " Until then, give its wheelbase there (wheelbase_m)."
        found.append(f"vehicle: {not_known(iri_share_std(model, sensor))}{missing}")
    elif (said := config.wheelbase_m) is not None and vehicle.rear is not None:
        wheelbase_m = vehicle.front.cg_distance_m + vehicle.rear.cg_distance_m
        if abs(wheelbase_m / said - 1) > same_wheelbase:
            found.append(f"vehicle {vehicle.name}: its wheelbase is {wheelbase_m:.2f} m, and wheelbase_m says "
                         f"{said:g}: it is another car, and the IRI is wrong. Set vehicle: generic, or run ridelog "
                         "learn-car.")
    return tuple(found)


def iri_share_std(model: CarModel, sensor: Instrument) -> float:
    """Share by which the IRI may be off because nobody knows the car: the largest of some speeds."""
    speeds_mps = (10.0, 20.0, 30.0)  # town, road, motorway
    psd = COMMON_ROAD.psd_of(LOG_WAVES)
    car, off = known_vehicle(model.vehicle, model.effects), cars_off(model.vehicle, model.effects, model.errors)
    shares = []
    for speed_mps in speeds_mps:
        response = CarResponse(car.at(speed_mps, WAVE_NUMBERS_CPM, psd),
                               [one.at(speed_mps, WAVE_NUMBERS_CPM, psd) for one in off])
        shares.append(slope_knowledge(response, speed_mps, COMMON_ROAD, sensor.sensor.variance_mps2_2, GRID_RATE_HZ,
                                      WINDOW_M, 1).vehicle_std)
    return max(shares)


def sidecar(config: Config, sensor: Instrument, model: CarModel, receiver: CarriedDelay | None = None,
            noise: KnownNoise | None = None) -> dict[str, Any]:
    """What lies beside every log file so that it can be read alone."""
    return {
        "ridelog_version": version(),
        "sensor": sensor.description,
        "vehicle": asdict(model.vehicle) | _more_of(model),
        "settings": _plain(_as_written(config)),
        "receiver": DELAY.fields(receiver or delay_at_start(config.gps, None)),
        **_noise_said(config.accelerometer, noise),
        **({"iri_vehicle_share_std": round(iri_share_std(model, sensor), 3)} if model.errors is not None else {}),
        "iri_m_per_km": "IRI of the road estimated from acceleration, speed and the vehicle's model",
        "sees_up_to_hz": 50,
    }


def _more_of(model: CarModel) -> dict[str, Any]:
    """What a vehicle has beside its plain numbers."""
    effects = [{"name": one.effect.name, **one.values} for one in model.effects]
    errors = asdict(model.errors) if model.errors is not None else {}
    return ({"effects": effects} if effects else {}) | errors


def _noise_said(config: AccelerometerConfig, known: KnownNoise | None) -> dict[str, Any]:
    """For a dump's header and a sidecar: the noise that a drive began with; nothing where it is what is usual."""
    if config.noise_mps2 is None:
        return {}
    of = {_READS: reads} if known and (reads := instrument(config).reads) > 1 else {}
    return {"noise": {"noise_mps2": config.noise_mps2, **(NOISE.fields(known) if known else {}), **of}}


def dump_header(config: Config, receiver: CarriedDelay | None = None, noise: KnownNoise | None = None) -> DumpHeader:
    """First line of a dump recorded by the live service. Its UTC start is not known: a Pi has no clock at boot."""
    gps = {"baud": config.gps.baud, **DELAY.fields(receiver or delay_at_start(config.gps, None))}
    sensor = config.accelerometer
    accelerometer = {"driver": sensor.driver, "vertical_axis": sensor.vertical_axis,
                     **sensor.kind.header(sensor.settings), **_noise_said(sensor, noise)}
    stem = config.vehicle.stem
    is_shipped = stem in vehicle_names() and config.vehicle == vehicle_file(stem)
    return DumpHeader(None, accelerometer, gps, stem if is_shipped else str(config.vehicle),
                      config.wheelbase_m, config.mass_kg)


def config_for_dump(header: DumpHeader, given: Config | None, vehicle: str | None, place: str = "header") -> Config:
    """Settings for a replay. What is in the bytes (driver, range, oversampling, baud rate) is always the recording's;
    the rest is that of the settings ``given``, or without them the defaults with what the recording's header says.

    Raises BadInput, beginning with ``place``, where the recording says what cannot be or names what is not known here.
    """
    said = RecordedWords({**header.accelerometer, "vehicle": header.vehicle,
                          "wheelbase_m": header.wheelbase_m, "mass_kg": header.mass_kg})
    config = given or Config()
    axis, noise_mps2 = config.accelerometer.vertical_axis, config.accelerometer.noise_mps2
    with as_bad_input(place, SettingsError):
        kind = accelerometers()[said.name("driver", "", tuple(accelerometers()))]
        if given is None:
            axis, noise_mps2 = said.name("vertical_axis", axis, AXES), _noise_setting(said, is_loggers(header.gps))
        sections = config.accelerometer.sections
        settings = kind.recorded(said, sections[kind.name], is_given=given is not None)
        sensor = AccelerometerConfig(kind.name, axis, {**sections, kind.name: settings}, noise_mps2)
        instrument(sensor)
        baud = round(RecordedWords(header.gps).number("baud", config.gps.baud, min(BAUDS.numbers), max(BAUDS.numbers)))
        if given is None and vehicle is None:
            vehicle = said.name("vehicle", "", vehicle_names(), "--vehicle FILE.yaml or ")
            config = replace(config, wheelbase_m=said.number_or_none("wheelbase_m", None, *WHEELBASE[:2]),
                             mass_kg=said.number_or_none("mass_kg", None, *CAR_MASS[:2]))
    return replace(config, accelerometer=sensor, gps=replace(config.gps, baud=baud),
                   vehicle=config.vehicle if vehicle is None else vehicle_path(vehicle))


def receiver_for_dump(header: DumpHeader, config: Config, place: str = "header") -> CarriedDelay:
    """What was known of the receiver's delay when the recording began, unless the settings say a number. Raises
    BadInput, beginning with ``place``, where the recording says what cannot be."""
    with as_bad_input(place):
        return delay_at_start(config.gps, DELAY.from_fields(header.gps))


def noise_for_dump(header: DumpHeader, config: Config, place: str = "header") -> KnownNoise | None:
    """What was known of the sensor's noise when the recording began, where the settings want it learned; None: nothing.
    Raises BadInput, beginning with ``place``, where the recording says what cannot be."""
    if config.accelerometer.noise_mps2 != AUTO:
        return None
    said = header.accelerometer.get("noise", {})
    with as_bad_input(place):
        known = NOISE.from_fields(said)
        # Recordings by programs that learned the noise of the mean of several readings say nothing of one.
        return known if said.get(_READS, 1) == instrument(config.accelerometer).reads else None


def _noise_setting(said: RecordedWords, by_logger: bool) -> float | str | None:
    """The setting that a recording was made with, by its header. A logger that says what it knew of the receiver and
    nothing of the noise did not learn it; a header that says neither is no logger's. SettingsError for what cannot
    be."""
    noise = said.group("noise")
    if noise.says("noise_std_mps2") or noise.says("noise_mps2", AUTO):
        return AUTO
    number = noise.number_or_none("noise_mps2", None, *READING_NOISE[:2])
    return AUTO if number is None and not by_logger else number


def _as_written(config: Config) -> dict[str, Any]:
    """The settings, in the shape that they have in their file."""
    settings = asdict(config)
    sections = settings["accelerometer"].pop("sections")
    return settings | {"accelerometer": settings["accelerometer"] | sections}


def _plain(value: Any) -> Any:
    """Settings as JSON can hold them."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return str(value) if isinstance(value, Path) else value
