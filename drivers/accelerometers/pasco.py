"""An accelerometer on a serial line: the PASCO PS-2119, or anything that sends samples or lines of text.

The problem: what an AirLink 2 sends is not public, so what a frame means must stay out of the code until a real
device has settled it. And a radio link delivers late and in bursts what the sensor measured at even intervals, while
road roughness wants the time of each sample.

The solution, three layers: a ``BytePort`` brings bytes, ``drivers.framing`` finds frames in them, and a profile
(``drivers.wire_profiles``) says what a frame means. ``SampleClock`` finds the rate of the samples and their times from
the arrival times.
"""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.accelerometers.accelerometer import SERIAL_NOISE_MPS2, ReadingQuality, SerialAccelerometer, setting
from drivers.errors import SettingsError
from drivers.framing import Arrivals, FixedFramer, Frame, LineFramer, exclusive_or, numbers_in
from drivers.plain_yaml import Node
from drivers.readings import BAUDS, STANDARD_GRAVITY_MPS2, AccelerationBlock, Flag, OrNone, RecordedWords, Special, Text
from drivers.sample_clock import DatedSamples, UndatedSamples
from drivers.wire_contents import SENSOR, RecentBytes
from drivers.wire_profiles import (
    FrameLayout,
    LineLayout,
    ScaleCalibration,
    Triple,
    WireProfile,
    load_profile,
    shipped_profiles,
)


class _Decoded(NamedTuple):
    """Decoded samples and where they began in the stream: offsets (n,), m/s2 (n, 3), clipped (n,), good (n,)."""

    after_loss: bool
    offsets: npt.NDArray[np.int64]
    accel_mps2: npt.NDArray[np.float64]
    clipped: npt.NDArray[np.bool_]
    good: npt.NDArray[np.bool_]


class _FrameReader:
    """Bytes to samples by a frame layout."""

    def __init__(self, layout: FrameLayout) -> None:
        set_by_gravity = layout.upright_axis is not None and not layout.sync
        self._layout = layout
        self.framer = FixedFramer(layout.length_bytes, layout.plausible, layout.oriented if set_by_gravity else None,
                                  layout.sync)

    def read(self, data: bytes) -> list[_Decoded]:
        return [self._samples(frame) for frame in self.framer.feed(data)]

    def _samples(self, run: Frame) -> _Decoded:
        layout = self._layout
        frames = np.frombuffer(run.data, dtype=np.uint8).reshape(-1, layout.length_bytes)
        counts = layout.counts(frames)
        low, high = layout.valid_raw
        calibration = layout.calibration
        zero_raw, scale_mps2 = np.array((calibration.zero_g_raw, calibration.mps2_per_count), dtype=np.float64)
        accel_mps2: npt.NDArray[np.float64] = (counts - zero_raw) * scale_mps2
        offsets = run.start + layout.length_bytes * np.arange(len(frames), dtype=np.int64)
        clipped = np.asarray(((counts <= low) | (counts >= high)).any(axis=1))
        return _Decoded(run.after_loss, offsets, accel_mps2, clipped, layout.plausible(frames))


_DECIMAL = rb" *([+-]?(?:\d{1,6}(?:\.\d{0,12})?|\.\d{1,12})) *"
_LINE = re.compile(_DECIMAL + rb"," + _DECIMAL + rb"," + _DECIMAL + rb"(?:\*([0-9A-Fa-f]{2}) *)?")
_NO_SAMPLE = (np.nan, np.nan, np.nan)


class _LineReader:
    """Lines of text to samples. A bad line still takes the place of one sample."""

    def __init__(self, layout: LineLayout) -> None:
        self._layout = layout
        self.framer = LineFramer()

    def read(self, data: bytes) -> list[_Decoded]:
        frames = self.framer.feed(data)
        cuts = [0, *(k for k, frame in enumerate(frames) if k and frame.after_loss), len(frames)]
        return [self._samples(frames[a:b]) for a, b in pairwise(cuts) if a < b]

    def _samples(self, lines: list[Frame]) -> _Decoded:
        values = np.array([_triple(line.data, self._layout) for line in lines], dtype=np.float64)
        largest = np.abs(values).max(axis=1)
        return _Decoded(lines[0].after_loss, np.array([line.start for line in lines], dtype=np.int64),
                      values * self._layout.unit_mps2, largest >= self._layout.range_units,
                      largest <= 2 * self._layout.range_units)


def _triple(line: bytes, layout: LineLayout) -> Triple:
    """The three numbers of a line; not-a-numbers when it is damaged."""
    if layout.numbers is not None:
        found = numbers_in(line)
        x, y, z = layout.columns
        return (found[x - 1], found[y - 1], found[z - 1]) if len(found) == layout.numbers else _NO_SAMPLE
    match = _LINE.fullmatch(line)
    if match is None or (match[4] and exclusive_or(line[: line.index(b"*")]) != int(match[4], 16)):
        return _NO_SAMPLE
    return float(match[1]), float(match[2]), float(match[3])


class PascoDecoder:
    """Bytes of the device in, blocks of acceleration out, by a profile. Raises nothing, whatever the bytes.

    calibration   of this very unit, instead of the profile's; SettingsError where the profile has no raw counts

    Samples come out a second late, at the start 1.2 s together: by then it is known whether any were lost on the way.
    ``flush`` gives what is held at the end. A bad frame is left out and counted; so are samples that come at a rate
    that cannot be used. What ``take`` returns over time does not depend on when it is called.
    """

    def __init__(self, profile: WireProfile, calibration: ScaleCalibration | None = None) -> None:
        self._reader: _FrameReader | _LineReader
        if isinstance(profile.layout, FrameLayout):
            layout = profile.layout if calibration is None else replace(profile.layout, calibration=calibration)
            self._reader = _FrameReader(layout)
        elif calibration is None:
            self._reader = _LineReader(profile.layout)
        else:
            raise SettingsError(f"profile {profile.name}: expected no calibration, its values are accelerations")
        self._profile = profile
        self._samples = DatedSamples(profile.rate_hz, profile.clock_tolerance)
        self._arrivals = Arrivals()
        self._chunks: list[bytes] = []
        self._recent = RecentBytes()

    name = "pasco"

    @property
    def doubt(self) -> str:
        """What is wrong with the samples that come, and what to do; empty: nothing."""
        return self._samples.doubt(f"Check the rate of the device (the profile {self._profile.name} says "
                                   f"{self._profile.rate_hz:g} a second), the baud rate at both ends, the cable, and "
                                   "whether the bridge keeps up")

    @property
    def note(self) -> str:
        """How the samples come; empty: as they should."""
        return self._samples.note

    @property
    def unread(self) -> str:
        """What arrives and what to do, where nothing of it becomes a sample."""
        return self._recent.advice(SENSOR, f"by the profile {self._profile.name}, {self._profile.layout.words} are")

    @property
    def counts(self) -> dict[str, int]:
        """What came in so far.

        frames          good ones
        bad_frames      in their place, but with values or a checksum that cannot be
        dropped_bytes   bytes that belonged to no frame
        resyncs         times the sample clock lost the line and had to find it again: samples went missing unseen
        lost            samples that were noticed to be missing between others
        undated         samples left out because they came at a rate that cannot be used, or too many were lost among
                        them
        """
        counts = self._samples.counts
        return {"frames": counts.pop("samples"), "bad_frames": self._samples.bad,
                "dropped_bytes": self._reader.framer.dropped_bytes, **counts}

    def feed(self, t_us: int, data: bytes) -> None:
        """Take the bytes that arrived at ``t_us`` [us, monotonic]."""
        self._arrivals.note(t_us, len(data))
        self._chunks.append(data)
        self._recent.note(data)

    def flush(self) -> None:
        """No more bytes will come: the next ``take`` gives all."""
        self._samples.flush()

    def take(self) -> AccelerationBlock:
        """All samples that are complete and have their times, oldest first; may be none."""
        found = self._reader.read(b"".join(self._chunks))
        self._chunks.clear()
        for some in found:
            self._samples.add(UndatedSamples(some.after_loss, self._arrivals.many(some.offsets), *some[2:]))
        self._arrivals.forget(self._reader.framer.position)
        return self._samples.take()


def _profile_name(node: Node) -> str:
    """The name of a shipped profile, or a path, relative to the folder of the settings."""
    is_path = "/" in node.text() or node.text().endswith((".yaml", ".yml"))
    return str(node.path()) if is_path else node.text()


def _calibration(node: Node) -> ScaleCalibration:
    axes = node.mapping(required=("x", "y", "z"))
    zeros_raw, ones_raw = zip(*(_counts_at_0_and_1_g(axes[axis]) for axis in "xyz"), strict=True)
    return ScaleCalibration(zero_g_raw=zeros_raw, one_g_raw=ones_raw)


def _counts_at_0_and_1_g(node: Node) -> tuple[float, float]:
    """Two points of an axis, extended to the counts at 0 and at 1 g."""
    largest_count = 65536
    least_step_g = 0.1
    values = [item.number(-largest_count, largest_count) for item in node.items()]
    if len(values) != 4 or abs(values[3] - values[1]) < least_step_g:
        raise node.wrong(f"two different points [raw, g, raw, g], {least_step_g} g or more apart")
    first_raw, first_g, second_raw, second_g = values
    counts_per_g = (second_raw - first_raw) / (second_g - first_g)
    if abs(counts_per_g) < 1:
        raise node.wrong("two different points [raw, g, raw, g], a count per g or more apart")
    zero_g_raw = first_raw - first_g * counts_per_g
    return zero_g_raw, zero_g_raw + counts_per_g


@dataclass(frozen=True)
class PascoConfig:
    """``profile`` is a shipped name or a path; ``calibration`` None takes the profile's own."""

    port: str = setting("/dev/ttyUSB0", Text())
    baud: int = setting(115200, BAUDS)
    profile: str = setting("lines", Special(_profile_name, ("lines", "lines_mps2")))
    accept_unverified: bool = setting(False, Flag())
    calibration: ScaleCalibration | None = setting(None, OrNone("null", Special(_calibration, (
        "{x: [4096, 0, 4424, 1], y: [4096, 0, 4424, 1], z: [4096, 0, 4424, 1]}",))))


class _Pasco(SerialAccelerometer[PascoConfig]):
    """Any sensor on a serial line for which there is a profile."""

    name = "pasco"
    title = "serial sensor"
    settings = PascoConfig
    lines: ClassVar[Mapping[str, Any]] = {"profile": "lines"}

    def check_chosen(self, settings: PascoConfig) -> None:
        """A profile that nobody has seen work on hardware runs only where the settings say that this is known."""
        try:
            profile = load_profile(settings.profile)
        except SettingsError as error:
            raise SettingsError(str(error), "profile") from None
        if not profile.verified and not settings.accept_unverified:
            raise SettingsError(f"expected a verified profile, and {profile.name!r} is not verified on hardware; set "
                                "accept_unverified: true as well to use it anyway", "profile")

    def line(self, settings: PascoConfig) -> tuple[str, int]:
        return settings.port, settings.baud

    def decoder(self, settings: PascoConfig, upright_axis: int) -> PascoDecoder:
        """By the profile; frames without start bytes are distinguished by the axis that feels gravity."""
        profile = load_profile(settings.profile)
        if isinstance(profile.layout, FrameLayout) and profile.layout.upright_axis is not None:
            profile = replace(profile, layout=replace(profile.layout, upright_axis=upright_axis))
        return PascoDecoder(profile, settings.calibration)

    def readings(self, settings: PascoConfig) -> ReadingQuality:
        """Fine steps, at a rate that the decoder finds out."""
        return ReadingQuality(SERIAL_NOISE_MPS2)

    def facts(self, settings: PascoConfig) -> dict[str, Any]:
        profile = load_profile(settings.profile)
        return {"profile": profile.name, "profile_version": profile.version, "verified": profile.verified,
                "calibration": asdict(settings.calibration) if settings.calibration else None}

    def header(self, settings: PascoConfig) -> dict[str, Any]:
        """The profile, and whether a calibration of this very sensor is needed."""
        return {"profile": settings.profile, "calibrated": settings.calibration is not None}

    def simulated(self, settings: PascoConfig, accel_mps2: npt.NDArray[np.float64]) -> list[bytes]:
        """Lines ``x,y,z`` in g, as the profile ``lines`` reads them."""
        return [b"%.4f,%.4f,%.4f\n" % tuple(row) for row in (accel_mps2 / STANDARD_GRAVITY_MPS2).tolist()]

    def recorded(self, said: RecordedWords, settings: PascoConfig, is_given: bool) -> PascoConfig:
        """The settings' own profile, or that of the recording where none are given, if it comes with the driver."""
        if is_given:
            return settings
        if said.flag("calibrated"):
            raise SettingsError("recorded with its own calibration; expected the settings of that drive, --config FILE")
        return replace(settings, profile=said.name("profile", settings.profile, shipped_profiles(),
                                                   "the settings of the recording, --config FILE, or "))


ACCELEROMETER = _Pasco()
