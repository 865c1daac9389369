"""What comes on a serial line: frames made by their makers' descriptions, text, noise."""

from __future__ import annotations

import itertools
import random
import struct
import zlib
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from pynmeagps import NMEAMessage

from drivers.accelerometers.pasco import PascoDecoder
from drivers.nmea import NmeaDecoder
from drivers.wire_contents import ADVICE, RECEIVER, SENSOR, recognise
from drivers.wire_profiles import load_profile

from ..support.slow import slow

RNG = random.Random(5)


def payload(size: int) -> bytes:
    return bytes(RNG.randrange(256) for _ in range(size))


def fletcher(data: bytes) -> bytes:
    a = b = 0
    for byte in data:
        a = (a + byte) % 256
        b = (b + a) % 256
    return bytes((a, b))


def folded(data: bytes) -> bytes:
    total = 0
    for byte in data:
        total ^= byte
    return bytes((total,))


def remainder(data: bytes, polynomial: int, bits: int) -> bytes:
    """Of the polynomial division, as one long number."""
    number = int.from_bytes(data, "big") << bits
    divisor = polynomial | 1 << bits
    while number.bit_length() > bits:
        number ^= divisor << (number.bit_length() - bits - 1)
    return number.to_bytes(bits // 8, "big")


def ubx() -> bytes:
    body = b"\x01\x07" + struct.pack("<H", 92) + payload(92)
    return b"\xb5\x62" + body + fletcher(body)


def sirf() -> bytes:
    body = payload(41)
    return b"\xa0\xa2" + struct.pack(">H", 41) + body + struct.pack(">H", sum(body) & 0x7FFF) + b"\xb0\xb3"


def rtcm() -> bytes:
    head = b"\xd3" + struct.pack(">H", 60) + payload(60)
    return head + remainder(head, 0x864CFB, 24)


def sbf() -> bytes:
    body = struct.pack("<HH", 4007, 96) + payload(88)
    return b"$@" + remainder(body, 0x1021, 16)[::-1] + body


def novatel() -> bytes:
    frame = b"\xaa\x44\x12" + struct.pack("<BHBBH", 28, 42, 0, 0, 72) + payload(28 - 10) + payload(72)
    return frame + struct.pack("<I", zlib.crc32(frame, 0xFFFFFFFF) ^ 0xFFFFFFFF)


def mediatek() -> bytes:
    body = struct.pack("<H", 49) + payload(2 + 40)
    return b"\x04\x24" + body + folded(body) + b"\r\n"


def tsip() -> bytes:
    return b"\x10\x8f\x20" + payload(64).replace(b"\x10", b"\x10\x10") + b"\x10\x03"


def garmin() -> bytes:
    body = b"\x33\x40" + payload(64)
    body += bytes((-sum(body) % 256,))
    return b"\x10" + body.replace(b"\x10", b"\x10\x10") + b"\x10\x03"


def witmotion() -> bytes:
    body = b"\x55\x51" + payload(8)
    return body + bytes((sum(body) % 256,))


def xsens() -> bytes:
    body = b"\xff\x32" + bytes((36,)) + payload(36)
    return b"\xfa" + body + bytes((-sum(body) % 256,))


NUMBERS = itertools.cycle(range(256))


def mavlink() -> bytes:
    return b"\xfd" + bytes((28, 0, 0, next(NUMBERS))) + payload(5) + payload(28) + payload(2)


def of_another_baud_rate() -> bytes:
    """Bytes in which few edges fall: the same five again and again, 0xFE and others that begin frames among them."""
    return bytes(RNG.choice((0x00, 0x80, 0xF8, 0xFE, 0xE6, RNG.randrange(256))) for _ in range(40))


def lines(*texts: str) -> Callable[[], bytes]:
    return lambda: RNG.choice(texts).format(x=RNG.gauss(0, 0.1), y=RNG.gauss(0, 0.1), z=RNG.gauss(1, 0.1)).encode()


def nmea(kind: str, **fields: object) -> Callable[[], bytes]:
    return lambda: NMEAMessage("GP", kind, 0, **fields).serialize()


def without_checksum() -> bytes:
    return b"$GPRMC,090000.00,A,1220.4000,N,04540.2000,E,19.44,45.0,040526,,,A\r\n"


def damaged() -> bytes:
    return without_checksum().replace(b"\r\n", b"*00\r\n")


@pytest.mark.parametrize(("make", "kind"), [
    *((make, "receiver_binary") for make in (ubx, sirf, rtcm, sbf, novatel, mediatek, tsip, garmin)),
    (lambda: b"\xb5\x62" + (body := b"\x01\x07\x5c\x00" + bytes(92)) + fletcher(body), "receiver_binary"),
    *((make, "sensor_binary") for make in (witmotion, xsens, mavlink)),
    (nmea("GSV", numMsg=1, msgNum=1, numSV=0), "sentences"),
    (nmea("HDT", heading=12.5), "sentences"),
    (without_checksum, "no_checksum"),
    (damaged, "damaged"),
    (lines("{x:.3f},{y:.3f},{z:.3f}\r\n"), "numbers"),
    (lines("X: {x:.2f}  Y: {y:.2f}  Z: {z:.2f}  m/s^2 \r\n"), "numbers"),
    (lines('{{"ax": {x:.3f}, "ay": {y:.3f}, "az": {z:.3f}}}\n'), "numbers"),
    (lambda: "X: 0.49\xb0  Y: -0.98\xb0  Z: 9.80\xb0\r\n".encode("latin-1"), "numbers"),
    (lambda: b"\x1b[32m0.01,-0.02,0.98\x1b[0m\r\n", "text"),
    (lambda: b"$ACC,0.01,-0.02,0.98\r\n", "numbers"),
    (lines("I (1234) boot: chip revision: v0.1\r\n", "E (99) sensor not found\r\n"), "text"),
    (lines(">RPV54321+1234567-00123456712300012;ID=1;*7F<\r\n"), "text"),
    (lambda: b"\x00" * 40, "level"),
    (lambda: payload(40), "noise"),
    (of_another_baud_rate, "noise"),
], ids=lambda value: getattr(value, "__name__", value))
def test_what_comes_is_recognised_wherever_the_listening_began(make: Callable[[], bytes], kind: str) -> None:
    data = b"".join(make() for _ in range(60))
    assert {recognise(data[cut:]).kind for cut in (0, 1, 7, 13)} == {kind}
    for port in (RECEIVER, SENSOR):
        assert (port, kind) in ADVICE


def at_another_rate(data: bytes, ratio: float, idle_bits: int) -> bytes:
    """What a UART whose bits last ``ratio`` times as long reads, with so many idle bits behind each byte."""
    bits = [bit for byte in data for bit in (0, *(byte >> k & 1 for k in range(8)), *[1] * (1 + idle_bits))]
    found, at = bytearray(), 0.0
    while at + 10 * ratio < len(bits):
        if bits[int(at)]:
            at = int(at) + 1
            continue
        found.append(sum(bits[int(at + ratio * (k + 1.5))] << k for k in range(8)))
        at += 9.5 * ratio
    return bytes(found)


@pytest.mark.parametrize(("ratio", "idle_bits"), [
    (1 / 3, 3), (2, 40), *slow((1 / 3, 40), (2, 3), *product((1 / 6, 1 / 2, 3, 4), (3, 40)))])
def test_text_at_a_wrong_baud_rate_is_noise(ratio: float, idle_bits: int) -> None:
    for make in (without_checksum, lines("{x:.3f},{y:.3f},{z:.3f}\r\n")):
        found = at_another_rate(b"".join(make() for _ in range(200)), ratio, idle_bits)
        assert recognise(found).kind in ("noise", "level")
    decoder = NmeaDecoder()
    decoder.feed(0, at_another_rate(without_checksum() * 40, 2, 0))
    assert "check the baud rate" in decoder.unread


def test_at_the_receivers_port_it_says_what_comes_and_what_to_do() -> None:
    def said(make: Callable[[], bytes]) -> str:
        decoder = NmeaDecoder()
        decoder.feed(0, b"".join(make() for _ in range(40)))
        return decoder.unread

    assert said(nmea("GSV", numMsg=1, msgNum=1, numSV=0)).startswith("it sends GSV (such as '$")
    assert "ridelog takes positions only from RMC, GGA and GLL: have it send RMC" in said(
        nmea("GNS", posMode="AA", numSV=9, lat=45.0, NS="N", lon=7.0, EW="E"))
    assert "switch the checksum on" in said(without_checksum)
    assert "$GPRMC,090000.00,A" in said(without_checksum)
    assert "UBX frames" in said(ubx)
    assert "switch it to NMEA" in said(ubx)
    assert "ports may be swapped" in said(witmotion)
    assert "lines of three numbers" in said(lines("{x:.3f},{y:.3f},{z:.3f}\r\n"))
    assert "\\x1b[2J" in said(lambda: b"hello \xc2\xa0\r\n") or "hello" in said(lambda: b"hello world\r\n")
    assert all(words.isprintable() for words in map(said, (lambda: b"\x1b[2J\r\n", lambda: payload(30), damaged)))


@pytest.mark.parametrize(("form", "words"), [
    ("X: {x:.2f}  Y: {y:.2f}  Z: {z:.2f}  m/s^2 \r\n", "3 numbers with words beside them"),
    ("{x:.3f};{y:.3f};{z:.3f}\r\n", "3 numbers with semicolons between them"),
    ("{x:.3f},{y:.3f},{z:.3f},\r\n", "3 numbers with a separator after the last one"),
    ("{x:.3f} {y:.3f} {z:.3f}\r\n", "3 numbers with blanks between them"),
    ("16{x:+.0f}384,-16384,{z:.0f}6384\r\n", "too large for a sample"),
], ids=["words", "semicolons", "last comma", "blanks", "counts"])
def test_at_the_sensors_port_it_says_how_lines_differ(form: str, words: str) -> None:
    decoder = PascoDecoder(load_profile("lines"))
    make = lines(form) if "{x:+" not in form else lambda: b"163,-16384,16000\r\n"
    decoder.feed(0, b"".join(make() for _ in range(60)))
    assert len(decoder.take()) == 0
    assert words in decoder.unread
    assert "the baud rate is right" in decoder.unread
    assert "lines x,y,z in g" in decoder.unread


def test_at_the_sensors_port_a_time_or_a_receiver_is_recognised() -> None:
    decoder = PascoDecoder(load_profile("lines"))
    decoder.feed(0, b"".join(b"%d,0.01,0.02,0.99\r\n" % (10 * k) for k in range(60)))
    assert "4 numbers, the first of which grows like a time, with commas between them" in decoder.unread
    other = PascoDecoder(load_profile("lines"))
    other.feed(0, b"".join(nmea("GSV", numMsg=1, msgNum=1, numSV=0)() for _ in range(40)))
    assert "as a GPS receiver sends: the two ports may be swapped" in other.unread


@pytest.mark.parametrize(("line", "layout"), [
    ("X: 0.49  Y: -0.98  Z: 9.80  m/s^2 ", "{unit: mps2, range: 160, numbers: 3, columns: [1, 2, 3]}"),
    ("1200;0.05;-0.1;1;25.3;", "{unit: g, range: 16, numbers: 5, columns: [2, 3, 4]}"),
    ('{"az": 1.0, "ax": 0.05, "ay": -1e-1}', "{unit: g, range: 16, numbers: 3, columns: [2, 3, 1]}"),
], ids=["words", "time first, temperature last", "JSON"])
def test_a_profile_of_ones_own_reads_lines_of_another_form(line: str, layout: str, tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    path.write_text("name: own\nversion: 1\nverified: true\nsource: ours\nframing: lines\nrate_hz: 100\n"
                    f"clock_tolerance_ppm: 20000\nline: {layout}\n")
    decoder = PascoDecoder(load_profile(str(path)))
    for k in range(300):
        decoder.feed(10_000 * k, line.encode() + b"\r\n" if k != 200 else b"1.0 2.0\r\n")
    decoder.flush()
    block = decoder.take()
    assert np.allclose(block.accel_mps2, [0.49, -0.98, 9.80], atol=0.01)
    assert decoder.counts["bad_frames"] == 1
