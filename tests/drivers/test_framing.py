"""Framers: the same bytes give the same frames however they are cut, and no garbage hides what follows."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.framing import (
    LINE_BYTES_MAX,
    SENTENCE_BYTES_MAX,
    Arrivals,
    FixedFramer,
    LineFramer,
    NmeaFramer,
    exclusive_or,
)


def ubx(payload, kind=b"\x01\x07"):
    """A UBX frame, its check bytes by the loop of u-blox's protocol description."""
    body = kind + len(payload).to_bytes(2, "little") + payload
    a = b = 0
    for byte in body:
        a = (a + byte) % 256
        b = (b + a) % 256
    return b"\xb5\x62" + body + bytes((a, b))


def in_range(frames):
    words = np.ascontiguousarray(frames).view("<u2")
    return ((words >= 800) & (words <= 7400)).all(axis=1)


def third_largest(groups):
    words = np.ascontiguousarray(groups).view("<u2").astype(int)
    return np.abs(np.median(words, axis=1) - 4096).argmax(axis=1) == 2


def words(count, seed=1, upright=4424):
    """(count, 3) counts of a sensor on a road, third axis up, and their bytes."""
    rng = np.random.default_rng(seed)
    counts = np.array((4096, 4096, upright)) + rng.integers(-60, 61, (count, 3))
    return counts.astype("<u2").tobytes()


def fixed(oriented=True, sync=b""):
    return FixedFramer(6 + len(sync), in_range_after(sync), third_largest if oriented else None, sync)


def in_range_after(sync):
    return lambda frames: in_range(frames[:, len(sync) :])


def cut(data, places):
    edges = [0, *sorted(min(place, len(data)) for place in places), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


def outcome(framer, chunks):
    frames = [frame for chunk in chunks for frame in framer.feed(chunk)]
    return frames, framer.dropped_bytes, framer.position


def by_frame(frames, length):
    """Runs of a FixedFramer as single frames."""
    return [
        (run.start + k, run.data[k : k + length], run.after_loss and k == 0)
        for run in frames
        for k in range(0, len(run.data), length)
    ]


def test_exclusive_or_of_any_short_string():
    rng = np.random.default_rng(0)
    for size in range(129):
        data = rng.bytes(size)
        assert exclusive_or(data) == int(np.bitwise_xor.reduce(np.frombuffer(data, np.uint8), initial=0))


def test_sentences_end_at_line_ends_and_at_the_next_dollar():
    framer = NmeaFramer()
    frames = framer.feed(b"x$A,1*00\r\n$B,2\r\r\n$C$D,4\n$E")
    assert [frame.data for frame in frames] == [b"$A,1*00", b"$B,2", b"$C", b"$D,4"]
    assert [frame.start for frame in frames] == [1, 10, 17, 19]
    assert [frame.after_loss for frame in frames] == [True, False, False, False]
    assert framer.dropped_bytes == 1
    assert framer.position == 24


def test_a_sentence_may_have_130_characters_and_no_more():
    longest = b"$" + b"a" * (SENTENCE_BYTES_MAX - 1)
    assert [frame.data for frame in NmeaFramer().feed(longest + b"\n")] == [longest]
    framer = NmeaFramer()
    assert [frame.data for frame in framer.feed(longest + b"a\n$B\n")] == [b"$B"]
    assert framer.dropped_bytes == SENTENCE_BYTES_MAX + 1


def test_ubx_is_stepped_over_though_it_holds_a_whole_sentence():
    frame = ubx(b"\n$GPXXX,1*00\r\n\xb5\x62")
    framer = NmeaFramer()
    assert [f.data for f in framer.feed(b"$A\r\n" + frame + b"$B\r\n" + frame + frame)] == [b"$A", b"$B"]
    assert framer.ubx_frames == 3
    assert framer.dropped_bytes == 0


def test_a_damaged_ubx_frame_hides_nothing_behind_it():
    frame = bytearray(ubx(b"abc"))
    frame[-1] ^= 1
    framer = NmeaFramer()
    assert [f.data for f in framer.feed(bytes(frame) + b"$B\r\n")] == [b"$B"]
    assert framer.ubx_frames == 0
    assert framer.dropped_bytes == len(frame)


def test_a_ubx_length_beyond_belief_does_not_hold_up_sentences():
    framer = NmeaFramer()
    assert [f.data for f in framer.feed(b"\xb5\x62\x01\x02\xff\xff$B\r\n")] == [b"$B"]


TEXT_PIECES = [b"$GPRMC,1*00\r\n", b"$", b"$GP", b"\x00", b"\r", b"\n"]
PIECES = st.sampled_from([*TEXT_PIECES, b"\xb5", b"\xb5\x62", ubx(b""), ubx(b"$A\n"), ubx(bytes(300))])


@settings(max_examples=150)
@given(
    st.lists(st.one_of(PIECES, st.binary(max_size=20)), max_size=12).map(b"".join),
    st.lists(st.integers(0, 600), max_size=8),
)
@pytest.mark.parametrize("kind", [NmeaFramer, LineFramer])
def test_cuts_do_not_matter(kind, data, places):
    assert outcome(kind(), cut(data, places)) == outcome(kind(), [data])


def test_one_byte_at_a_time_does_not_matter():
    data = (b"$GPRMC,1,2*00\r\n" + ubx(b"$A\n") + b"junk\xb5$X") * 3
    single = [data[k : k + 1] for k in range(len(data))]
    assert outcome(NmeaFramer(), single) == outcome(NmeaFramer(), [data])


@pytest.mark.parametrize("kind", [NmeaFramer, LineFramer, FixedFramer])
@pytest.mark.parametrize("junk", [b"$", b"\xb5\x62", b"a", b"\x00", b"\xff\x07\xb5\x62"])
def test_memory_stays_bounded(kind, junk):
    framer = fixed() if kind is FixedFramer else kind()
    for fed in range(1, 301):
        framer.feed(junk * 50)
        assert 50 * fed * len(junk) - framer.position <= 2100


def test_lines_begin_after_the_first_line_end():
    framer = LineFramer()
    frames = framer.feed(b"2.5,1\r\n1,2,3\r\n\n4,5,6\r7,8")
    assert [(frame.start, frame.data) for frame in frames] == [(7, b"1,2,3"), (15, b"4,5,6")]
    assert framer.dropped_bytes == 5
    assert [frame.data for frame in framer.feed(b",9\n")] == [b"7,8,9"]


def test_an_overlong_line_is_dropped_to_its_end():
    framer = LineFramer()
    frames = framer.feed(b"\n" + b"1" * (LINE_BYTES_MAX + 1)) + framer.feed(b"2,3\n4,5,6\n")
    assert [(frame.data, frame.after_loss) for frame in frames] == [(b"4,5,6", True)]
    assert framer.dropped_bytes == LINE_BYTES_MAX + 4


@pytest.mark.parametrize("skip", range(6))
def test_alignment_from_any_byte_of_a_stream(skip):
    data = words(200)
    framer = fixed()
    frames = by_frame(framer.feed(data[skip:]), 6)
    assert framer.dropped_bytes == -skip % 6
    assert b"".join(frame for _, frame, _ in frames) == data[-(-skip // 6) * 6 :]


@pytest.mark.parametrize("lost", range(1, 12))
def test_place_is_found_again_after_lost_bytes(lost):
    """Odd losses show in the counts, even ones only in the direction of gravity."""
    data = words(400)
    framer = fixed()
    frames = by_frame(framer.feed(data[:900] + data[900 + lost :]), 6)
    right = {data[k : k + 6] for k in range(0, len(data), 6)}
    wrong = [start for start, frame, _ in frames if frame not in right]
    assert len(wrong) <= 34
    assert all(900 - 6 < start < 900 + 36 * 6 for start in wrong)
    assert framer.dropped_bytes <= 2 * 6
    assert frames[-1][1] == data[-6:]


def test_a_single_damaged_frame_does_not_lose_the_place():
    data = bytearray(words(100))
    data[301] = 0xFF
    framer = fixed()
    assert b"".join(run.data for run in framer.feed(bytes(data))) == bytes(data)
    assert framer.dropped_bytes == 0


def test_garbage_is_dropped_and_counted():
    data = words(60)
    garbage = np.random.default_rng(2).bytes(10_000)
    framer = fixed()
    frames = framer.feed(garbage + data)
    assert framer.dropped_bytes == len(garbage)
    assert b"".join(run.data for run in frames) == data
    assert frames[0].after_loss


def test_noise_is_hardly_ever_taken_for_frames():
    framer = fixed()
    assert framer.feed(np.random.default_rng(3).bytes(100_000)) == []


def test_start_bytes_settle_the_place():
    data = b"".join(b"\xaa\x55" + words(1, seed) for seed in range(60))
    for skip in range(8):
        framer = fixed(oriented=False, sync=b"\xaa\x55")
        frames = by_frame(framer.feed(data[skip:] + b"\x00" * 3 + data), 8)
        assert {frame[:2] for _, frame, _ in frames} == {b"\xaa\x55"}
        assert len(frames) >= 115


@settings(max_examples=80)
@given(
    st.lists(st.one_of(st.integers(1, 60).map(words), st.binary(max_size=9)), max_size=6).map(b"".join),
    st.lists(st.integers(0, 1500), max_size=8),
)
def test_cuts_do_not_matter_to_fixed_frames(data, places):
    whole, pieces = fixed(), fixed()
    assert by_frame(whole.feed(data), 6) == by_frame([f for c in cut(data, places) for f in pieces.feed(c)], 6)
    assert (whole.dropped_bytes, whole.position) == (pieces.dropped_bytes, pieces.position)


def test_arrival_of_any_byte():
    arrivals = Arrivals()
    for t_us, size in ((10, 3), (20, 0), (30, 1), (30, 2), (40, 5)):
        arrivals.note(t_us, size)
    expected = [10] * 3 + [30] * 3 + [40] * 5
    assert [arrivals.at(k) for k in range(11)] == expected
    arrivals.forget(4)
    assert [arrivals.at(k) for k in range(4, 11)] == expected[4:]
    assert arrivals.many(np.arange(4, 11)).tolist() == expected[4:]
    arrivals.forget(11)
    arrivals.note(50, 1)
    assert arrivals.at(11) == 50
