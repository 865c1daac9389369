"""``ridelog capture``: a recording of what a serial port sends, and a first look at it."""

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from drivers.accelerometers import line_reader
from drivers.dump import DumpHeader, DumpWriter, Event
from drivers.hardware import BytePort, open_serial, port_advice
from drivers.sources import READ_BYTES
from logger.errors import BadInput
from logger.question import Argument, Checked, Option, Question, Verb, more_than_0
from logger.service.main_loop import monotonic_us as now_us
from logger.service.systemd_notify import stopped_by_signals
from logger.units import US_PER_S

_WAIT_S = 0.2
_LOOK_BYTES = 65536
_SHOWN_BYTES = 64
_LONGEST_FRAME = 128


def _name_of_a_dump(out: Path) -> None:
    if not out.name.endswith((".dump", ".dump.gz")):
        raise ValueError("expected a name that ends in .dump or .dump.gz")


@dataclass(frozen=True, kw_only=True)
class CaptureQuestion(Question):
    """Record the raw bytes of a serial port, with the time of their arrival, as a dump.

      ridelog capture /dev/ttyUSB0 --out sensor.dump.gz
      ridelog capture /dev/ttyACM0 --baud 9600 --seconds 60 --out receiver.dump.gz

    For an instrument with an unknown protocol: every byte is kept, and a summary at the end shows what the frames may
    be. End it with Ctrl-C.
    """

    port: Annotated[str, Argument("serial port, such as /dev/ttyUSB0", metavar="PORT")]
    baud: Annotated[int, Option("bits per second", metavar="N")] = 115200
    seconds: Annotated[float | None, Option("end after this time (default: at Ctrl-C)", metavar="N",
                                            check=more_than_0)] = None
    out: Annotated[Path, Option("dump to write; must be new", metavar="FILE.dump[.gz]", read=Path,
                                check=_name_of_a_dump)]


VERB = Verb(CaptureQuestion, "logger.commands.capture:captured", has_json=False)


def captured(asked: CaptureQuestion) -> Checked:
    """Record until it is told to stop; the first look at what came."""
    port = open_serial(asked.port, asked.baud)
    try:
        header = DumpHeader(None, {"driver": line_reader().name, "port": asked.port, "baud": asked.baud}, {}, "unknown")
        writer = _new_dump(asked.out, header)
        print(f"recording {asked.port} at {asked.baud} baud to {asked.out}; Ctrl-C ends it", file=sys.stderr)
        try:
            with stopped_by_signals() as stop:
                look, total, duration_s, fault = _record(port, writer, asked.seconds, stop.is_set, now_us)
        finally:
            writer.close()
    finally:
        port.close()
    print("\r", end="", file=sys.stderr, flush=True)
    advice = "" if total else port_advice(asked.port)
    if fault is not None:
        print(f"ridelog: {fault}; everything before it is kept", file=sys.stderr)
    lines = [f"{total} bytes in {duration_s:.1f} s, {total / max(duration_s, 1e-6):.0f} bytes/s, in {asked.out}",
             *first_look(look), *([f"{advice}."] if advice else [])]
    return Checked("\n".join(lines), {}, bool(total) and fault is None)


def first_look(data: bytes) -> list[str]:
    """What a stream of bytes looks like, as lines for a person: text or frames, and how long they may be."""
    if not data:
        return ["Nothing arrived. Check that the device is on and sends, the baud rate, and TX against RX."]
    lines = ["First bytes:", *_hex_rows(data[:_SHOWN_BYTES])]
    text = sum(byte in b"\t\r\n" or 32 <= byte < 127 for byte in data) / len(data)
    if text > 0.95 and b"\n" in data:
        whole = data.split(b"\n")[1:-1] or data.split(b"\n")[:1]
        sample = whole[len(whole) // 2].decode("ascii", "replace").strip()
        return [*lines, f"Looks like text, {len(whole)} lines; one of them: {sample!r}",
                "If a line is \"x,y,z\", the profile 'lines' reads it."]
    lines.append(f"Looks binary: {text:.0%} of the bytes are printable.")
    common = ", ".join(f"{byte:02x} ({count / len(data):.0%})" for byte, count in Counter(data).most_common(4))
    lines.append(f"Most common bytes: {common}")
    distances = repeat_distances(data)
    if distances:
        shown = ", ".join(f"{distance} ({share:.0%})" for distance, share in distances)
        lines.append(f"Bytes repeat most often every: {shown} bytes. The first is probably the frame length.")
    return lines


def repeat_distances(data: bytes) -> list[tuple[int, float]]:
    """The shortest distances after which a byte comes again clearly more often than usual, with the share that does.

    Frames of fixed length with fixed bytes in them show as their length and multiples of it; nothing else shows.
    """
    stream = np.frombuffer(data, dtype=np.uint8)
    longest = min(_LONGEST_FRAME, len(data) // 4)
    shares = [float(np.mean(stream[distance:] == stream[:-distance])) for distance in range(1, longest + 1)]
    if not shares:
        return []
    most, usual = max(shares), float(np.mean(shares))
    if most < max(1.5 * usual, 0.05):
        return []
    return [entry for entry in enumerate(shares, start=1) if entry[1] > (most + usual) / 2][:3]


def _record(port: BytePort, writer: DumpWriter, seconds: float | None, stopped: Callable[[], bool],
            now_us: Callable[[], int]) -> tuple[bytes, int, float, str | None]:
    """Move bytes from the port to the dump until stopped, timed out or cut off.

    Gives the first bytes, how many there were, the time [s], and what cut it off.
    """
    look = bytearray()
    total = 0
    source = line_reader().name
    start_us = shown_us = now_us()
    shown_bytes = 0
    fault = None
    while not stopped() and (seconds is None or now_us() - start_us < seconds * US_PER_S):
        try:
            data = port.read(READ_BYTES, _WAIT_S)
        except OSError as error:
            fault = error.strerror or str(error)
            break
        at_us = now_us()
        if data:
            writer.write(Event(at_us, source, data))
            look += data[:_LOOK_BYTES - len(look)]
            total += len(data)
        if at_us - shown_us >= US_PER_S:
            rate = (total - shown_bytes) * US_PER_S / (at_us - shown_us)
            print(f"\r{total} bytes, {rate:.0f} bytes/s   ", end="", file=sys.stderr, flush=True)
            shown_us, shown_bytes = at_us, total
            writer.flush(sync=True)
    return bytes(look), total, (now_us() - start_us) / US_PER_S, fault


def _new_dump(path: Path, header: DumpHeader) -> DumpWriter:
    try:
        return DumpWriter(path, header)
    except FileExistsError:
        raise BadInput(f"{path}: expected a name that is not taken; a recording is never overwritten") from None
    except OSError as error:
        raise BadInput(f"{path}: expected a place where a dump can be written ({error.strerror})") from None


def _hex_rows(data: bytes) -> list[str]:
    return [f"  {data[start:start + 16].hex(' '):47}  "
            + "".join(chr(byte) if 32 <= byte < 127 else "." for byte in data[start:start + 16])
            for start in range(0, len(data), 16)]
