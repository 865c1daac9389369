"""The serial accelerometer: profiles, counts to m/s2, and the sample times against a simulated device."""

from importlib import resources
from itertools import pairwise

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.accelerometers.pasco import PascoDecoder
from drivers.errors import SettingsError
from drivers.sample_clock import NO_TIME, SampleClock
from drivers.wire_profiles import ScaleCalibration, load_profile, shipped_profiles

from ..support.slow import slow

G_MPS2 = 9.80665


def counts(count, seed=1):
    """(count, 3) raw counts on a road, Z up."""
    rng = np.random.default_rng(seed)
    return np.array((4096, 4096, 4424)) + rng.integers(-60, 61, (count, 3))


def raw(values):
    return np.asarray(values).astype("<u2").tobytes()


def even_drive(values, period_us=10_000, start_us=1_000_000):
    """One frame per chunk, arriving as it is taken."""
    return [(start_us + k * period_us, raw(value)) for k, value in enumerate(values)]


def decode(profile, events, calibration=None, take_every=1):
    decoder = PascoDecoder(load_profile(profile), calibration)
    blocks = []
    for k, (t_us, data) in enumerate(events):
        decoder.feed(t_us, data)
        if k % take_every == 0:
            blocks.append(decoder.take())
    decoder.flush()
    blocks.append(decoder.take())
    times, accel, clipped = (
        np.concatenate([getattr(block, name) for block in blocks]) for name in ("t_us", "accel_mps2", "clipped")
    )
    return times, accel, clipped, decoder.counts


# --- profiles


def test_shipped_profiles():
    assert shipped_profiles() == ["lines", "lines_mps2", "ps2119"]
    for name in shipped_profiles():
        profile = load_profile(name)
        assert (profile.name, profile.version, profile.rate_hz) == (name, 1, 100.0)
        assert profile.source


def test_the_radio_frame_is_not_claimed_to_be_right():
    profile = load_profile("ps2119")
    assert profile.verified is False
    assert profile.scale == pytest.approx((0.029898,) * 3, abs=1e-6)  # data sheet: 3.05 mg, 0.0299 m/s2 per count
    assert load_profile("lines").scale == (G_MPS2,) * 3
    assert load_profile("lines_mps2").scale == (1.0,) * 3


def copy_of_ps2119(tmp_path, changes):
    """A user's copy of a shipped profile with some keys changed; None removes one, __ goes deeper."""
    content = yaml.safe_load(resources.files("drivers.profiles").joinpath("ps2119.yaml").read_text())
    for path, value in changes.items():
        *parents, key = path.split("__")
        inner = content
        for parent in parents:
            inner = inner[parent]
        if value is None:
            del inner[key]
        else:
            inner[key] = value
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(content))
    return file


def test_a_profile_of_ones_own(tmp_path):
    """Signed big-endian words behind two start bytes, in another order."""
    changes = {
        "name": "mine",
        "verified": True,
        "frame__length_bytes": 9,
        "frame__sync": "aa55",
        "frame__word": "i16be",
        "frame__offsets": [6, 4, 2],
        "frame__valid_raw": [-2000, 2000],
        "frame__zero_g_raw": [0, 0, 0],
        "frame__one_g_raw": [100, 100, -100],
    }
    path = copy_of_ps2119(tmp_path, changes)
    values = np.random.default_rng(4).integers(-150, 150, (100, 3))
    frames = b"".join(b"\xaa\x55" + value[::-1].astype(">i2").tobytes() + b"#" for value in values)
    _, accel, _, counters = decode(str(path), [(k * 90_000, frames[k * 81 : k * 81 + 81]) for k in range(12)])
    assert accel == pytest.approx(values * (G_MPS2 / 100, G_MPS2 / 100, -G_MPS2 / 100))
    assert counters["frames"] == 100


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"version": None}, "expected the key 'version' here, it is missing"),
        ({"version": "one"}, "expected a whole number from 1 to 1e6, found 'one' for 'version'"),
        ({"verified": "no idea"}, "expected true or false, found 'no idea' for 'verified'"),
        ({"name": [3]}, "expected a text, found a list for 'name'"),
        ({"framing": "packets"}, "expected one of frames, lines, found 'packets' for 'framing'"),
        ({"framing": ["frames"]}, "expected one of frames, lines, found a list for 'framing'"),
        ({"framing": "lines"}, "expected one of the keys name,"),
        ({"rate_hz": 0}, "expected a number from 1 to 10000, found '0' for 'rate_hz'"),
        ({"rate_hz": float("nan")}, "expected a number from 1 to 10000, found '.nan' for 'rate_hz'"),
        ({"rate_hz": True}, "expected a number from 1 to 10000, found 'true' for 'rate_hz'"),
        ({"speed": 3}, "expected one of the keys name, version, verified,"),
        ({"frame": 3}, "expected a mapping (key: value lines), found '3' for 'frame'"),
        ({"frame__speed": 3}, "expected one of the keys length_bytes, sync,"),
        ({"frame__length_bytes": 5}, "expected a whole number from 6 to 256, found '5' for 'length_bytes'"),
        ({"frame__sync": "xy"}, "expected bytes in hex, or empty, found 'xy' for 'sync'"),
        ({"frame__sync": "aa"}, "expected start bytes that leave"),
        ({"frame__word": "f32"}, "expected one of u16le, u16be, i16le, i16be, found 'f32' for 'word'"),
        ({"frame__offsets": [0, 2, 5]}, "expected a whole number from 0 to 4, found '5' for 'offsets'"),
        ({"frame__offsets": [0, 2]}, "expected a list of 3 numbers, found a list for 'offsets'"),
        ({"frame__valid_raw": [7400, 800]}, "expected the lower count first, found a list for 'valid_raw'"),
        ({"frame__upright_axis": "up"}, "expected one of x, y, z, none, found 'up' for 'upright_axis'"),
        ({"frame__one_g_raw": [4096, 4424, 4424]}, "expected counts that differ"),
    ],
)
def test_a_bad_profile_is_refused_by_file_and_key(tmp_path, changes, says):
    path = copy_of_ps2119(tmp_path, changes)
    with pytest.raises(SettingsError) as caught:
        load_profile(path)
    place, line, complaint = str(caught.value).split(":", 2)
    assert place == str(path)
    assert says in complaint
    key = complaint.rsplit("'", 2)[-2]
    lines = path.read_text().splitlines()
    there = lines[int(line) - 1]  # of an item of a list its own line
    assert key in there or there.lstrip().startswith("-") or not any(text.strip().startswith(key) for text in lines)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", [b"", b"- 1", b"a: [", b"\xff\xfe\x00", b"a: !!python/name:os.system", b"#" * 70_000])
def test_a_file_that_is_no_profile(tmp_path, text):
    path = tmp_path / "bad.yaml"
    path.write_bytes(text)
    with pytest.raises(SettingsError, match=r"bad\.yaml.*expected"):
        load_profile(path)


@pytest.mark.parametrize("name", ["ps2118", "../ps2119", "", "/nowhere/x.yaml"])
def test_a_profile_that_is_not_there(name):
    with pytest.raises(SettingsError, match="expected"):
        load_profile(name)


# --- what frames mean


def test_counts_become_accelerations():
    values = counts(100)
    values[50] = (4096, 4096 - 328, 4096 + 3 * 328)
    _, accel, clipped, counters = decode("ps2119", even_drive(values))
    assert accel == pytest.approx((values - 4096) / 328 * G_MPS2)
    assert accel[50] == pytest.approx((0, -G_MPS2, 3 * G_MPS2))
    assert not clipped.any()
    assert (counters["frames"], counters["bad_frames"], counters["dropped_bytes"]) == (100, 0, 0)


def test_a_unit_has_its_own_calibration():
    values = counts(60)
    own = ScaleCalibration((4100, 4090, 4096), (4430, 4420, 4420))
    _, accel, _, _ = decode("ps2119", even_drive(values), own)
    assert accel == pytest.approx((values - (4100, 4090, 4096)) / (330, 330, 324) * G_MPS2)
    with pytest.raises(SettingsError, match="no calibration"):
        PascoDecoder(load_profile("lines"), own)
    with pytest.raises(SettingsError, match="at least one count"):
        ScaleCalibration((1, 2, 3), (4, 5, 3))


def test_the_ends_of_the_range_are_clipped_and_beyond_is_no_sample():
    values = counts(100)
    values[[40, 50]] = (800, 4096, 4424), (4096, 4096, 7400)
    values[[60, 70]] = (799, 1, 1), (4096, 4096, 7401)
    times, accel, clipped, counters = decode("ps2119", even_drive(values))
    assert np.flatnonzero(clipped).tolist() == [40, 50]
    assert (len(accel), counters["frames"], counters["bad_frames"]) == (98, 98, 2)
    assert np.flatnonzero(np.diff(times) > 15_000).tolist() == [59, 68]


def test_lost_bytes_leave_a_hole_in_time_and_no_false_sample():
    values = counts(400)
    data = even_drive(values)
    data[200] = (data[200][0], data[200][1][:3])
    times, accel, _, counters = decode("ps2119", data)
    assert counters["frames"] == len(accel) == 399
    assert counters["dropped_bytes"] == 3
    expected = np.delete(np.arange(400) * 10_000 + 1_000_000, 200)
    assert np.abs(times - expected).max() <= 10
    assert accel == pytest.approx((np.delete(values, 200, axis=0) - 4096) / 328 * G_MPS2)


def text_line(values, checked=False):
    text = ",".join(f"{value:.4f}" for value in values).encode()
    total = 0
    for byte in text:
        total ^= byte
    return text + (b"*%02x" % total if checked else b"") + b"\r\n"


@pytest.mark.parametrize(("profile", "unit_mps2"), [("lines", G_MPS2), ("lines_mps2", 1.0)])
@pytest.mark.parametrize("checked", [False, True])
def test_lines_of_text(profile, unit_mps2, checked):
    values = np.round(np.random.default_rng(5).normal(0, 1, (80, 3)), 4)
    events = [(k * 10_000, text_line(value, checked)) for k, value in enumerate(values)]
    _, accel, clipped, counters = decode(profile, events)
    assert accel == pytest.approx(values[1:] * unit_mps2)
    assert not clipped.any()
    assert (counters["frames"], counters["bad_frames"]) == (79, 0)
    assert counters["dropped_bytes"] == len(events[0][1]) - 2


@pytest.mark.parametrize(
    ("line", "value"),
    [
        (b"1,2,3", (1, 2, 3)),
        (b" -1. , +.5 ,3.000 ", (-1, 0.5, 3)),
        (b"1,2,3*30", (1, 2, 3)),
        (b"1.5,2,3*2b", (1.5, 2, 3)),
        (b"1,2,3*31", None),
        (b"1,2,3*3", None),
        (b"1,2,3*", None),
        (b"1,2", None),
        (b"1,2,3,4", None),
        (b"1,,3", None),
        (b"nan,2,3", None),
        (b"1e1,2,3", None),
        (b"1,2,33", None),
        (b"1;2;3", None),
        (b"\xff1,2,3", None),
    ],
)
def test_what_a_line_may_be(line, value):
    events = [(k * 10_000, b"0,0,1\n") for k in range(60)]
    events[40] = (400_000, line + b"\n")
    times, accel, _, counters = decode("lines", events)
    assert counters["bad_frames"] == (value is None)
    assert len(accel) == 59 - (value is None)
    if value is None:
        assert times[39] - times[38] == pytest.approx(20_000, abs=10)
    else:
        assert accel[39] == pytest.approx(np.array(value) * G_MPS2)


def test_lines_at_the_end_of_the_range_are_clipped():
    events = [(k * 10_000, b"0,0,1\n" if k % 10 else b"0,-16,1\n") for k in range(60)]
    _, _, clipped, _ = decode("lines", events)
    assert np.flatnonzero(clipped).tolist() == [9, 19, 29, 39, 49]


# --- when samples were taken


def radio(rate_hz, count, seed, latency_us=30_000, burst_max=5):
    """True times of an even sampler, and arrivals in bursts, each with a random latency, in order."""
    rng = np.random.default_rng(seed)
    truth_us = 5_000_000 + np.arange(count) * 1e6 / rate_hz
    arrival_us = np.empty(count)
    start = 0
    while start < count:
        stop = min(count, start + int(rng.integers(1, burst_max + 1)))
        arrival_us[start:stop] = truth_us[stop - 1] + rng.uniform(0, latency_us)
        start = stop
    return truth_us, np.maximum.accumulate(arrival_us).astype(np.int64)


def timed(clock, arrival_us):
    """All times: also of the samples that are held until more come."""
    return np.concatenate((clock.feed(arrival_us), clock.restart()))


@pytest.mark.parametrize("rate_hz", [99.97, 100.05, *slow(99.95, 100.0)])
@pytest.mark.parametrize("seed", [1, *slow(2, 3)])
def test_times_of_a_bursty_device_are_recovered(rate_hz, seed):
    truth_us, arrival_us = radio(rate_hz, 12_000, seed)
    times_us = timed(SampleClock(100, 500e-6), arrival_us)
    assert len(times_us) == len(truth_us)
    assert (np.diff(times_us) > 0).all()
    assert (times_us <= arrival_us).all()
    error_us = (times_us - truth_us)[1000:]
    assert np.std(error_us) < 2000 / 3
    assert np.mean(error_us) < 1500
    assert np.std((arrival_us - truth_us)[1000:]) > 8000


def test_times_of_a_loop_with_a_delay_in_it():
    """A microcontroller 1.5 % slow under the profile lines."""
    truth_us, arrival_us = radio(98.5, 6000, 4)
    clock = SampleClock(100, load_profile("lines").clock_tolerance)
    error_us = (timed(clock, arrival_us) - truth_us)[2000:]
    assert clock.resyncs == 0
    assert np.abs(error_us).max() < 5000


def test_a_jam_in_the_link_moves_no_sample():
    truth_us, arrival_us = radio(99.97, 6000, 5)
    for start_us, length_us in ((20e6, 0.2e6), (30e6, 1e6), (40e6, 4e6)):
        jammed = (arrival_us >= start_us) & (arrival_us < start_us + length_us)
        arrival_us[jammed] = int(start_us + length_us)
    clock = SampleClock(100, 500e-6)
    error_us = (timed(clock, arrival_us) - truth_us)[1000:]
    assert clock.resyncs == 0
    assert np.abs(error_us).max() < 4000


@pytest.mark.parametrize("lost", [40, 300])
def test_lost_samples_leave_a_hole(lost):
    truth_us, arrival_us = radio(99.97, 4000, 6)
    truth_us, arrival_us = (np.delete(series, slice(2000, 2000 + lost)) for series in (truth_us, arrival_us))
    clock = SampleClock(100, 500e-6)
    times_us = timed(clock, arrival_us)
    assert clock.resyncs == 1
    assert np.abs(times_us - truth_us)[1000:].max() < 10_000
    assert np.abs(times_us - truth_us)[2500:].max() < 4000
    assert int(np.argmax(np.diff(times_us))) == 1999


def test_samples_are_not_dated_while_more_are_lost_than_can_be_located():
    """Three in a hundred lost for half a minute: undated from soon after it began until it is over for good."""
    truth_us, arrival_us = radio(100, 12_000, 9, latency_us=15_000)
    kept = np.random.default_rng(9).random(12_000) >= 0.03 * ((np.arange(12_000) // 3000) == 1)
    clock = SampleClock(100, load_profile("lines").clock_tolerance)
    times_us = timed(clock, arrival_us[kept])
    second = (truth_us[kept] - truth_us[0]) / 1e6
    dated = times_us != NO_TIME
    assert dated[second < 30].all()
    assert not dated[(second > 45) & (second < 60)].any()
    assert dated[second > 80].all()
    assert np.abs(times_us - truth_us[kept])[second > 80].max() < 5000


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [98.5, 99.2, 100, 104])
@pytest.mark.parametrize(("every", "count"), [(100, 1), (50, 1), (100, 2), (25, 1)])
def test_samples_lost_at_even_intervals_are_no_slower_sensor(rate_hz, every, count):
    """From 12 s to a second before the end: dated as taken, to within a fifth of the period, or not at all."""
    truth_us, arrival_us = radio(rate_hz, 6000, 11, latency_us=1000, burst_max=1)
    kept = np.arange(6000) % every >= count
    clock = SampleClock(100, load_profile("lines").clock_tolerance)
    error_us = timed(clock, arrival_us[kept]) - truth_us[kept]
    settled = (truth_us[kept] > truth_us[0] + 12e6) & (truth_us[kept] < truth_us[-1] - 1.2e6)
    dated = settled & (error_us > -(2**62))
    assert not dated.any() or np.std(error_us[dated]) < 0.2 * 1e6 / rate_hz
    assert clock.lost > 0


@pytest.mark.slow
@pytest.mark.parametrize("tolerance_ppm", [10, 50, 500])
@pytest.mark.parametrize("off_ppm", [-50, -400, -5000, 30])
def test_a_tight_tolerance_makes_no_losses(tolerance_ppm, off_ppm):
    """A clock that is off by more than its profile grants loses nothing by it: five minutes."""
    truth_us, arrival_us = radio(100 * (1 + off_ppm * 1e-6), 30_000, 12, latency_us=4000, burst_max=1)
    clock = SampleClock(100, tolerance_ppm * 1e-6)
    error_us = timed(clock, arrival_us) - truth_us
    assert clock.resyncs == 0
    assert clock.lost <= 5 * (off_ppm == -5000)  # 0.5 % of the first ten seconds, until its rate is known
    assert np.abs(error_us[2000:]).max() < 5000


def test_a_device_that_was_late_from_the_start_is_caught_up_with():
    """Its first second arrives a second late: the times must come back to the truth and never run backwards. Before it
    is known how fast the samples come they are not dated."""
    truth_us, arrival_us = radio(100, 3000, 7)
    arrival_us = np.maximum.accumulate(arrival_us + np.where(np.arange(3000) < 100, 1_000_000, 0))
    clock = SampleClock(100, 500e-6)
    times_us = timed(clock, arrival_us)
    assert (np.diff(times_us[times_us != NO_TIME]) > 0).all()
    assert (times_us[300:] != NO_TIME).all()
    assert np.abs(times_us - truth_us)[1000:].max() < 4000


def test_the_same_arrivals_in_any_pieces_give_the_same_times():
    _, arrival_us = radio(99.97, 3000, 8)
    arrival_us = np.delete(arrival_us, slice(1000, 1100))
    arrival_us[(arrival_us > 20e6) & (arrival_us < 20.6e6)] = int(20.6e6)
    arrival_us[2000:2100] += 400_000
    arrival_us = np.maximum.accumulate(arrival_us)
    whole = timed(SampleClock(100, 500e-6), arrival_us)
    for size in (1, 3, 50, 127, 128, 129, 777):
        clock = SampleClock(100, 500e-6)
        pieces = [clock.feed(arrival_us[k : k + size]) for k in range(0, len(arrival_us), size)]
        pieces.append(clock.restart())
        assert np.concatenate(pieces).tolist() == whole.tolist()


# --- any bytes, any cuts

ROAD = raw(counts(300))
SPOKEN = b"".join(text_line(value) for value in np.random.default_rng(9).normal(0, 1, (40, 3)))


def cut(data, places):
    """Cut at places; a chunk's bytes all arrive at the time of its tenth of a kilobyte, whatever the cuts."""
    edges = sorted({0, *range(0, len(data), 100), *(place % (len(data) + 1) for place in places), len(data)})
    return [(a // 100 * 160_000, data[a:b]) for a, b in pairwise(edges)]


@pytest.mark.slow
@settings(max_examples=60)
@given(
    st.sampled_from(["ps2119", "lines"]),
    st.lists(st.one_of(st.sampled_from([ROAD, SPOKEN, ROAD[5:200]]), st.binary(max_size=30)), max_size=4).map(b"".join),
    st.lists(st.integers(0, 10_000), max_size=8),
    st.integers(1, 5),
)
def test_any_bytes_in_any_pieces(profile, data, places, take_every):
    one = decode(profile, cut(data, []))
    other = decode(profile, cut(data, places), take_every=take_every)
    for a, b in zip(one[:3], other[:3], strict=True):
        assert np.array_equal(a, b)
    assert one[3] == other[3]
    times, accel, _, _ = one
    assert (np.diff(times) > 0).all()
    assert np.isfinite(accel).all()


def test_nothing_fed_is_nothing_taken():
    block = PascoDecoder(load_profile("ps2119")).take()
    assert (len(block), block.accel_mps2.shape, block.clipped.shape) == (0, (0, 3), (0,))
