"""What comes on a serial line, when it is not what was expected, and what to do.

Problem: "nothing that can be read" has many causes, and a wrong baud rate is only one of them: a receiver set to its
maker's binary protocol, sentences without checksum, lines of another form, the accelerometer at the receiver's port.
Solution: the last bytes are kept, and when somebody asks they are recognised: frames of known protocols by their
lengths and checks, NMEA sentences by their checksums, whole lines of printable text. A table (``ADVICE``) says what to
do about each kind at each port.

Sources of the frames: the makers' protocol descriptions, as far as a frame's length and check go (u-blox UBX; CSR SiRF
binary; RTCM 10403; Septentrio SBF; NovAtel OEM; SkyTraq; MediaTek; Trimble TSIP; Garmin serial; WitMotion; Xsens;
MicroStrain; MAVLink).
"""

import re
from binascii import crc_hqx
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from typing import NamedTuple
from zlib import crc32

from drivers.errors import shortened
from drivers.framing import exclusive_or, fletcher8, numbers_in
from drivers.nmea_sentences import Checksum, MalformedError, check, parse_checked

RECENT_BYTES = 4096
_MOST = 0.5

RECEIVER, SENSOR = "receiver", "sensor"


class RecentBytes:
    """The last bytes of a stream."""

    def __init__(self) -> None:
        self._data = bytearray()

    def note(self, data: bytes) -> None:
        self._data += data
        if len(self._data) > 2 * RECENT_BYTES:
            del self._data[:-RECENT_BYTES]

    def advice(self, port: str, expected: str) -> str:
        """What comes and what to do, at the port of a ``RECEIVER`` or ``SENSOR``; ``expected``: there."""
        contents = recognise(bytes(self._data[-RECENT_BYTES:]))
        shown = f" (such as {contents.shown})" if contents.shown else ""
        return ADVICE[port, contents.kind].format(what=contents.what, shown=shown, expected=expected)

    def sentence_kinds(self) -> str:
        """Names of the NMEA sentences with the right checksum that came."""
        return _kinds([line for line in _sentences(bytes(self._data)) if check(line) is Checksum.GOOD])


class Contents(NamedTuple):
    """What was recognised: a key of ``ADVICE``, words for it, and a line or some bytes of it, printable."""

    kind: str
    what: str
    shown: str


class _Protocol(NamedTuple):
    """Frames that begin with ``sync``; ``size`` gives a frame's length by its first ``head`` bytes, ``is_right`` looks
    at the whole frame; ``by``: who sends such."""

    name: str
    by: str
    sync: bytes
    head: int
    size: Callable[[bytes], int]
    is_right: Callable[[bytes], bool]


def _low(data: bytes) -> int:
    return int.from_bytes(data, "little")


def _high(data: bytes) -> int:
    return int.from_bytes(data, "big")


@cache
def _crc24q_of(byte: int) -> int:
    register = byte << 16
    for _ in range(8):
        register = (register << 1) ^ (0x1864CFB if register & 0x800000 else 0)
    return register


def _crc24q(data: bytes) -> int:
    """RTCM's cyclic redundancy check, highest bit first, from zero."""
    register = 0
    for byte in data:
        register = ((register & 0xFFFF) << 8) ^ _crc24q_of((register >> 16) ^ byte)
    return register


_PROTOCOLS = (
    _Protocol("UBX frames (u-blox binary)", RECEIVER, b"\xb5\x62", 6, lambda h: 8 + _low(h[4:6]),
              lambda f: fletcher8(f[2:-2]) == f[-2:]),
    _Protocol("SiRF binary frames", RECEIVER, b"\xa0\xa2", 4, lambda h: 8 + _high(h[2:4]),
              lambda f: f[-2:] == b"\xb0\xb3" and sum(f[4:-4]) & 0x7FFF == _high(f[-4:-2])),
    _Protocol("SkyTraq binary frames", RECEIVER, b"\xa0\xa1", 4, lambda h: 7 + _high(h[2:4]),
              lambda f: f[-2:] == b"\r\n" and _folded(f[4:-3]) == f[-3]),
    _Protocol("RTCM correction messages", RECEIVER, b"\xd3", 3, lambda h: 6 + (_high(h[1:3]) & 0x3FF),
              lambda f: _crc24q(f[:-3]) == _high(f[-3:])),
    _Protocol("Septentrio SBF blocks", RECEIVER, b"$@", 8, lambda h: _low(h[6:8]),
              lambda f: crc_hqx(f[4:], 0) == _low(f[2:4])),
    _Protocol("NovAtel binary messages", RECEIVER, b"\xaa\x44\x12", 10, lambda h: 4 + h[3] + _low(h[8:10]),
              lambda f: crc32(f[:-4], 0xFFFFFFFF) ^ 0xFFFFFFFF == _low(f[-4:])),
    _Protocol("MediaTek binary packets", RECEIVER, b"\x04\x24", 4, lambda h: _low(h[2:4]),
              lambda f: f[-2:] == b"\r\n" and _folded(f[2:-3]) == f[-3]),
    _Protocol("WitMotion frames", SENSOR, b"\x55", 2, lambda h: 11 if 0x4F < h[1] < 0x60 else 0,
              lambda f: sum(f[:-1]) & 0xFF == f[-1]),
    _Protocol("Xsens messages", SENSOR, b"\xfa\xff", 4, lambda h: 5 + h[3], lambda f: sum(f[1:]) & 0xFF == 0),
    _Protocol("MicroStrain packets", SENSOR, b"\x75\x65", 4, lambda h: 6 + h[3],
              lambda f: fletcher8(f[:-2]) == f[-2:]),
)
_GARMIN_OR_TSIP = re.compile(rb"\x10([^\x03\x10])((?:[^\x10]|\x10\x10){1,255}?)\x10\x03")
_MAVLINK = {0xFE: (8, 2), 0xFD: (12, 4)}
"""First byte of a message of version 1 and 2: how many bytes it has beside its load, and where it is numbered."""


def _folded(data: bytes) -> int:
    """Exclusive-or of all bytes, however many."""
    folded = 0
    for at in range(0, len(data), 128):
        folded ^= exclusive_or(data[at : at + 128])
    return folded


def recognise(data: bytes) -> Contents:
    """What some thousand bytes of a line are."""
    one_byte_share, least_text_share, fewest_sentences = 0.9, 0.9, 3
    framed = _frames(data)
    if framed is None and data and max(data.count(byte) for byte in set(data)) >= one_byte_share * len(data):
        byte = max(set(data), key=data.count)
        return Contents("level", f"hardly anything but the byte 0x{byte:02x}", "")
    sentences: dict[Checksum, list[bytes]] = {found: [] for found in Checksum}
    for line in _sentences(data):
        sentences[check(line)].append(line)
    good, bad, unchecked = (sentences[found] for found in (Checksum.GOOD, Checksum.BAD, Checksum.MISSING))
    if framed is not None and not good:
        return framed
    lines, text_share = _text_lines(data)
    count = len(good) + len(bad) + len(unchecked)
    if count >= fewest_sentences or 2 * count > len(lines) > 0:
        if len(good) > max(len(bad), len(unchecked)):
            malformed = [line for line in good if _is_malformed(line)]
            return Contents("malformed" if malformed else "sentences", _kinds(malformed or good),
                            _shown((malformed or good)[-1]))
        if len(unchecked) > len(bad):
            return Contents("no_checksum", _kinds(unchecked), _shown(unchecked[-1]))
        return Contents("damaged", f"{len(bad)} of {count}", _shown(bad[-1]))
    if text_share < least_text_share:
        return Contents("noise", "", f"the bytes {data[-12:].hex(' ')}" if data else "")
    if not lines:
        return Contents("endless", "", _shown(data))
    form = _form_of_numbers(lines)
    return Contents("numbers" if form else "text", form, _shown(lines[-1]))


def _frames(data: bytes) -> Contents | None:
    """The protocol whose frames make most of the bytes; None where none does."""
    largest_frame = 2048
    found: list[tuple[int, str, str]] = []
    for protocol in _PROTOCOLS:
        covered, at = 0, data.find(protocol.sync)
        while 0 <= at <= len(data) - protocol.head:
            size = protocol.size(data[at : at + protocol.head])
            frame = data[at : at + size]
            right = protocol.head <= size <= largest_frame and len(frame) == size and protocol.is_right(frame)
            covered += size if right else 0
            at = data.find(protocol.sync, at + (size if right else 1))
        found.append((covered, protocol.by, protocol.name))
    found += _stuffed_frames(data)
    found += [(_chained(data, sync, more, number_at), SENSOR, "MAVLink messages (a flight controller)")
              for sync, (more, number_at) in _MAVLINK.items()]
    covered, by, name = max(found)
    return Contents(f"{by}_binary", name, "") if covered > _MOST * len(data) else None


def _stuffed_frames(data: bytes) -> list[tuple[int, str, str]]:
    """Bytes in frames between DLE and DLE ETX: Garmin's have a sum, Trimble's have none."""
    garmin = tsip = 0
    for match in _GARMIN_OR_TSIP.finditer(data):
        body = match[1] + match[2].replace(b"\x10\x10", b"\x10")
        is_garmin = len(body) > 2 and len(body) == body[1] + 3 and sum(body) & 0xFF == 0
        garmin += len(match[0]) if is_garmin else 0
        tsip += len(match[0])
    return [(garmin + 1 if garmin else 0, RECEIVER, "Garmin binary packets"), (tsip, RECEIVER, "Trimble TSIP packets")]


def _chained(data: bytes, sync: int, more: int, number_at: int) -> int:
    """Bytes in frames whose second byte says their length and behind which the next one begins, numbered one higher;
    none where few numbers come: a line at a wrong baud rate has few values, which fit by chance."""
    fewest_numbers = 4
    numbers: set[int] = set()
    covered, at = 0, data.find(sync)
    while 0 <= at < len(data) - number_at:
        end = at + data[at + 1] + more
        right = (end + number_at < len(data) and data[end] == sync
                 and data[end + number_at] == (data[at + number_at] + 1) & 0xFF)
        if right:
            covered += end - at
            numbers.add(data[at + number_at])
        at = end if right else data.find(sync, at + 1)
    return covered if len(numbers) >= fewest_numbers else 0


_SENTENCE = re.compile(rb"[$!](?:P[A-Z]{2}|[A-Z]{2}[A-Z\d]{3},)[ -#%-~]*")


def _sentences(data: bytes) -> list[bytes]:
    """Lines that begin as NMEA sentences do, but for the first and the last, which may be cut."""
    found = [match[0] for match in _SENTENCE.finditer(data)]
    return [line for line in (found if data[-1:] in b"\r\n" else found[:-1]) if b"," in line]


def _is_malformed(sentence: bytes) -> bool:
    try:
        parse_checked(sentence)
    except MalformedError:
        return True
    return False


def _kinds(sentences: Sequence[bytes]) -> str:
    """``RMC, GGA and GSV``; proprietary ones by their whole name."""
    names = []
    for line in sentences:
        address = line[1:].split(b",")[0].split(b"*")[0][:10].decode("ascii", "replace")
        names.append(address if address.startswith("P") or len(address) < 4 else address[2:])
    once = sorted(dict.fromkeys(names), key=names.count, reverse=True)[:8]
    return " and ".join([", ".join(once[:-1]), once[-1]] if len(once) > 1 else once)


def _text_lines(data: bytes) -> tuple[list[bytes], float]:
    """Whole lines of printable text, and the share of all bytes that is such text."""
    parts = re.split(rb"[\r\n]+", data)
    texts = [part for part in parts if _is_text(part)]
    whole = [part for part in parts[1:-1] if part and _is_text(part)] or [part for part in parts[:-1] if _is_text(part)]
    size = sum(map(len, parts))
    return [part for part in whole if part], sum(map(len, texts)) / size if size else 0.0


_ESCAPE = re.compile(rb"\x1b\[[\d;?]*[A-Za-z]")
_NOT_ASCII = re.compile(rb"[\x80-\xff]")
_CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def _is_text(line: bytes) -> bool:
    """A line of UTF-8, or of ASCII with some other bytes: a degree sign of an older code, a terminal's colours."""
    # Of random bytes 0.38 are printable ASCII; of a line with a degree or square sign at each of three numbers, 0.9.
    ascii_share = 0.75
    try:
        if line.decode("utf-8").replace("\t", " ").isprintable():
            return True
    except UnicodeDecodeError:
        pass
    plain = _ESCAPE.sub(b"", line)
    return not _CONTROL.search(plain) and len(_NOT_ASCII.sub(b"", plain)) >= ascii_share * len(plain)


_PLAIN = re.compile(r" *[+-]?[\d.]+ *(?:, *[+-]?[\d.]+ *){2}(?:\*[0-9A-Fa-f]{2} *)?")


def _form_of_numbers(lines: list[bytes]) -> str:
    """How lines with three numbers or more differ from ``x,y,z``; empty where they are no such lines."""
    texts = [line.decode("utf-8", "replace") for line in lines]
    rows = [numbers_in(line) for line in lines]
    count = sorted(map(len, rows))[len(rows) // 2]
    same = [row for row in rows if len(row) == count]
    if count < 3 or len(same) < _MOST * len(rows):
        return ""
    text = texts[-1]
    if all(map(_PLAIN.fullmatch, texts[-3:])):
        largest = max(abs(value) for row in same for value in row)
        return f"three numbers up to {largest:g}, too large for a sample in this profile's unit and range"
    more = f"{count} numbers"
    if count > 3 and len(same) > 2 and all(a[0] < b[0] for a, b in pairwise(same)):
        more += ", the first of which grows like a time,"
    if any(letter.isalpha() for letter in text):
        return f"{more} with words beside them"
    between = [name for sign, name in ((";", "semicolons"), ("\t", "tabs"), (",", "commas")) if sign in text]
    if text.rstrip().endswith((",", ";")):
        return f"{more} with a separator after the last one"
    return f"{more} with {between[0] if between else 'blanks'} between them"


def _shown(line: bytes) -> str:
    return shortened(line.decode("utf-8", "replace").strip())


_EXCHANGED = ("{{expected}} expected, but what comes is {{what}}{{shown}}, as {other} sends: the two ports may be "
              "swapped. Compare gps.port and the accelerometer's port in the settings with ls -l /dev/serial/by-id")
_LEVEL = ("{what} comes: the line is at the wrong level. Check that TX, RX and ground are not swapped, and that no "
          "RS-232 plug is on a 3.3 V input")
_NOISE = ("bytes arrive, but none that can be read{shown}: check the baud rate in the settings, and that no other "
          "device is on this port")
_DAMAGED = ("{what} sentences have a wrong checksum{shown}, so they are damaged on the way: check the ground wire, the "
            "length of the cable, and that no other device is on this port")

ADVICE = {
    (RECEIVER, "sentences"): "it sends {what}{shown}, but ridelog takes positions only from RMC, GGA and GLL: have it "
                             "send RMC, which has time, date, position and speed in one sentence",
    (RECEIVER, "no_checksum"): "its sentences ({what}) come without a checksum{shown}, so ridelog ignores them, as "
                               "damage would go unnoticed: switch the checksum on in the receiver",
    (RECEIVER, "damaged"): _DAMAGED,
    (RECEIVER, "malformed"): "its {what} have the right checksum, but a field in them has an impossible value{shown}: "
                             "update its firmware, or have it send other sentences ({expected} expected)",
    (RECEIVER, "receiver_binary"): "it sends {what}, and {expected} expected: switch it to NMEA at this port (RMC and "
                                   "GGA are enough)",
    (RECEIVER, "text"): "whole lines of text come, so the baud rate is right, but they are not NMEA sentences{shown}; "
                        "{expected} expected: switch the receiver to NMEA 0183, and check that this is its port",
    (RECEIVER, "sensor_binary"): _EXCHANGED.format(other="an accelerometer"),
    (RECEIVER, "numbers"): _EXCHANGED.format(other="an accelerometer").replace("{what}", "lines of {what}"),
    (SENSOR, "sentences"): _EXCHANGED.format(other="a GPS receiver").replace("{what}", "NMEA sentences ({what})"),
    (SENSOR, "sensor_binary"): "it sends {what}, and {expected} expected: have the device send that, or write a "
                               "profile of your own for its frames (docs/installation.md)",
    (SENSOR, "numbers"): "whole lines come, so the baud rate is right, but with {what}{shown}; {expected} expected: "
                         "have the device send that, or write a profile that says which of the numbers are X, Y "
                         "and Z (docs/installation.md)",
    (SENSOR, "text"): "whole lines of text come, so the baud rate is right, but no samples{shown}; {expected} "
                      "expected: have the device send that (docs/installation.md)",
    (SENSOR, "receiver_binary"): _EXCHANGED.format(other="a GPS receiver"),
    **{(port, "endless"): "text comes without line ends{shown}; {expected} expected: have each line end with CR, LF or "
                          "both" for port in (RECEIVER, SENSOR)},
    **{(port, "level"): _LEVEL for port in (RECEIVER, SENSOR)},
    **{(port, "noise"): _NOISE for port in (RECEIVER, SENSOR)},
}
ADVICE |= {(SENSOR, kind): ADVICE[SENSOR, "sentences"] for kind in ("no_checksum", "damaged", "malformed")}
