"""``ridelog hil``: hardware in the loop."""

import sys
import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from drivers.accelerometers import accelerometers, serial_accelerometers
from drivers.accelerometers.accelerometer import SerialAccelerometer
from drivers.dump import DumpReader, open_dump
from drivers.hardware import open_serial
from drivers.readings import GPS
from logger.errors import BadInput
from logger.estimation.receiver_delay import CarriedDelay
from logger.question import Argument, Checked, LongQuestion, Option, Verb, more_than_0
from logger.records import WindowRecord
from logger.report.quantities import known
from logger.service.config import Config, find_config, load_config
from logger.service.hil.log_comparison import Difference, LogAgreement, compare, newest_sidecar, read_sessions
from logger.service.hil.playback import Sent, Wired, expected_rows, send, wired
from logger.service.learning import DELAY, NOISE, KnownNoise, read_delay
from logger.service.main_loop import monotonic_us

LATE_MS = 50.0
LATE_WHY = "the service reads its ports that often"
WRITTEN_S = 2.0
_MOVED_M = 1.0


@dataclass(frozen=True, kw_only=True)
class HilQuestion(LongQuestion):
    """Hardware in the loop: play a recorded drive into serial ports for a running service, then check what it logged.

      ridelog hil drive.dump.gz --nmea-port /dev/ttyUSB0 --accelerometer-port /dev/ttyUSB1
      ridelog hil drive.dump.gz --log hil-log

    The bytes go out with their recorded timing, over two USB-serial adapters or pseudo-terminals, to a service that has
    just been started. Its log is compared with a replay of the same bytes under the same settings. With ports and
    --log: play, then compare. With ports alone: only play, for a service on another machine. With --log alone: only
    compare, with a copy of its folder.

    The readings of a chip such as the BMA220 are sent as a bridge microcontroller would: as lines, profile `lines`.
    Exit status 1 when the log does not agree, or the bytes were sent too late to decide.
    """

    dump: Annotated[Path, Argument("recorded drive (.dump or .dump.gz)", metavar="DUMP", read=Path)]
    nmea_port: Annotated[str | None, Option("serial port wired to that of the service's GPS", metavar="PORT")] = None
    accelerometer_port: Annotated[str | None, Option("serial port wired to that of its accelerometer",
                                                     metavar="PORT")] = None
    log: Annotated[Path | None, Option("folder of the service's logs, or a copy of it", metavar="DIR",
                                       read=Path)] = None
    config: Annotated[Path | None, Option("settings of the service (default: those of 'run')", metavar="FILE",
                                          read=Path)] = None
    seconds: Annotated[float | None, Option("only the first N seconds of the recording", metavar="N",
                                            check=more_than_0)] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.nmea_port is None) != (self.accelerometer_port is None):
            raise self.complaint("expected `nmea_port` and `accelerometer_port`, or neither")
        if self.nmea_port is None and self.log is None:
            raise self.complaint("expected two ports to play into, `log` DIR to compare with, or all three")


VERB = Verb(HilQuestion, "logger.commands.hil:played")


def played(asked: HilQuestion) -> Checked:
    """Play, compare, or both."""
    config = load_config(find_config(asked.config))
    expected = None if asked.log is None else _expected(asked, asked.log, config)
    sent = _play(asked, config) if asked.nmea_port is not None else None
    if sent is not None and expected is not None:
        time.sleep(WRITTEN_S)
    agreement = None
    if expected is not None and asked.log is not None:
        agreement = compare(expected, read_sessions(asked.log), config.gps.bridge_s)
    result = PlayedDrive(_bridged(asked), sent, agreement)
    return Checked(result.text(), result.as_json(), result.ok)


@dataclass(frozen=True)
class PlayedDrive:
    """What was sent and what was found; None: not asked for. ``bridged``: title of the chip whose readings
    were sent as lines; empty: the bytes went as they are."""

    bridged: str
    sent: Sent | None
    agreement: LogAgreement | None

    @property
    def in_time(self) -> bool:
        """What was sent came early enough to judge the service by it."""
        return self.sent is None or self.sent.late_ms[1] <= LATE_MS

    @property
    def ok(self) -> bool:
        """All that was asked for is well."""
        return self.in_time and (self.agreement is None or self.agreement.ok)

    def as_json(self) -> dict[str, Any]:
        """Named fields, units in the names."""
        return {"ok": self.ok, "bridged_to_lines": bool(self.bridged), "sent": _sent_json(self.sent, self.in_time),
                "agreement": _agreement_json(self.agreement)}

    def text(self) -> str:
        """For a person."""
        lines = []
        if self.bridged:
            lines.append(f"The readings of the {self.bridged} go out as lines x,y,z in g: a serial port cannot replace "
                         "its I2C bus.")
        if self.sent is not None:
            size = ", ".join(f"{count} bytes of {source}" for source, count in self.sent.size_bytes.items())
            half, most, longest = self.sent.late_ms
            lines += [f"Sent {self.sent.duration_s:.0f} s: {size}.",
                      f"  late: median {half:.1f} ms, 99th percentile {most:.1f} ms ({LATE_MS:g} allowed: {LATE_WHY}), "
                      f"largest {longest:.1f} ms{'' if self.in_time else '  TOO LATE'}"]
        if self.agreement is not None:
            verdict = "AGREES" if self.agreement.ok else "does NOT AGREE"
            lines = [f"The log {verdict} with the replay.", *lines, *_agreement_text(self.agreement)]
        else:
            lines.append("To compare its log with a replay: ridelog hil DUMP --log DIR --config FILE (its settings).")
        return "\n".join(lines)


def _bridged(asked: HilQuestion) -> str:
    with open_dump(asked.dump) as reader:
        kind = accelerometers()[reader.header.accelerometer["driver"]]
    return "" if isinstance(kind, SerialAccelerometer) else kind.title


def _expected(asked: HilQuestion, log: Path, config: Config) -> list[WindowRecord]:
    """What the service should log; fails before anything is played when the comparison could not be made."""
    if not log.is_dir():
        raise BadInput(f"{log}: expected the folder of the service's logs; the service makes it when it starts: "
                       "ridelog run")
    if asked.nmea_port is not None and not list(log.glob("*.csv.part")):
        raise BadInput(f"{log}: expected the open log (.csv.part) of a running service; start it: ridelog run")
    with open_dump(asked.dump) as reader:
        expected = expected_rows(_wired(asked, reader), config, f"{asked.dump}:1", *_known_at_start(log))
    if not any(row.utc_us is not None for row in expected):
        raise BadInput(f"{asked.dump}: expected GPS fixes with date and time in it, by which its rows are found")
    return expected


def _known_at_start(folder: Path) -> tuple[CarriedDelay | None, KnownNoise | None]:
    """What the newest session in a folder knew of the receiver's delay and of the sensor's noise when it began, by its
    sidecar."""
    said = newest_sidecar(folder)
    try:
        receiver = DELAY.from_fields(said.get("receiver", {}))
        noise = NOISE.from_fields(said.get("noise", {}))
    except ValueError:
        receiver = noise = None
    return receiver or read_delay(folder), noise


def _play(asked: HilQuestion, config: Config) -> Sent:
    with ExitStack() as stack:
        reader = stack.enter_context(open_dump(asked.dump))
        recording = _wired(asked, reader)
        sensor = str(recording.header.accelerometer["driver"])
        _, baud = serial_accelerometers()[sensor].line(config.accelerometer.sections[sensor])
        ports = {}
        for source, name, rate in ((sensor, asked.accelerometer_port, baud), (GPS, asked.nmea_port, config.gps.baud)):
            ports[source] = open_serial(str(name), rate)
            stack.callback(ports[source].close)
            print(f"{source} to {name} at {rate} baud", file=sys.stderr)
        return send(recording.events, ports, monotonic_us, time.sleep,
                    lambda played_s: asked.progress(f"playing: {played_s:.0f} s"))


def _wired(asked: HilQuestion, reader: DumpReader) -> Wired:
    return wired(reader.header, reader, asked.seconds, f"{asked.dump}:1")


def _sent_json(sent: Sent | None, in_time: bool) -> dict[str, Any] | None:
    if sent is None:
        return None
    half, most, longest = sent.late_ms
    return {"duration_s": sent.duration_s, "size_bytes": dict(sent.size_bytes), "late_p50_ms": half,
            "late_p99_ms": most, "late_max_ms": longest, "late_p99_tolerance_ms": LATE_MS, "in_time": in_time}


def _agreement_json(agreement: LogAgreement | None) -> dict[str, Any] | None:
    if agreement is None:
        return None
    fields = asdict(agreement)
    for name in ("clock_shift_s", "moved_before_m"):
        fields[name] = known(fields[name])
    fields["differences"] = [
        {"quantity": each.tolerance.quantity, "unit": each.tolerance.unit, "compared": each.compared,
         "p95": known(each.p95), "largest": known(each.largest), "tolerance": each.tolerance.least,
         "or_share": each.tolerance.share, "of": each.tolerance.of, "outside": each.outside, "ok": each.ok,
         "why": each.tolerance.why}
        for each in agreement.differences
    ]
    return {"ok": agreement.ok, **fields}


def _agreement_text(agreement: LogAgreement) -> list[str]:
    if agreement.session is None:
        return [f"No row of this drive is in the log, of {agreement.expected} expected.",
                "  Check that the service runs, that its ports are the other ends of the wires, and that TX is on RX."]
    lines = [f"Session {agreement.session:05d}: {agreement.matched} of {agreement.expected} expected rows found, "
             f"{len(agreement.missing)} missing, {agreement.pending} not written yet, {len(agreement.surplus)} not "
             f"expected, {agreement.repeated} twice, {agreement.flags_differ} with other flags."]
    if abs(agreement.moved_before_m) > _MOVED_M:
        lines.append(f"  The service had counted {agreement.moved_before_m:.0f} m before, so its windows begin "
                     "elsewhere: restart it for each play.")
    for words, segments in (("missing", agreement.missing), ("not expected", agreement.surplus)):
        if segments:
            lines.append(f"  {words}: segments {', '.join(map(str, segments[:10]))}{' ...' if segments[10:] else ''}")
    lines.append(f"  {'':14} {'95th perc.':>10} {'largest':>8}         {'outside':>7}   allowed")
    return lines + [_difference_text(difference) for difference in agreement.differences]


def _difference_text(difference: Difference) -> str:
    tolerance = difference.tolerance
    share = f" or {tolerance.share:.0%} of {tolerance.of}" if tolerance.of else ""
    return (f"  {tolerance.quantity:14} {difference.p95:10.3f} {difference.largest:8.3f} {tolerance.unit:7} "
            f"{difference.outside:7d}   {tolerance.least:g}{share}: {tolerance.why}"
            f"{'' if difference.ok else '  TOO MANY OUTSIDE'}")
