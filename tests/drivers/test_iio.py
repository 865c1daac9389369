"""The kernel's interface against a tree of files that behaves like sysfs, and a character device that gives scans."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.accelerometers import _iio_device
from drivers.accelerometers._iio_device import read_description, understood
from drivers.accelerometers.iio import IioConfig, IioDecoder, IioSource
from drivers.errors import BadReply, DeviceError, NotPresent, SettingsLost, as_device_error
from drivers.readings import AccelerationBlock, Event

from ..support.accelerometer_fakes.fake import Clock
from ..support.accelerometer_fakes.iio import SCALE, FakeIio

RAMP_MPS2_PER_S = 0.5
STEP_US = SCALE / RAMP_MPS2_PER_S * 1e6


def ramp(fake: FakeIio) -> Callable[[int], np.ndarray]:
    """A little more along Z every second, so that a reading names its time."""
    begin_us = fake.clock.now_us
    return lambda t_us: np.array([0.0, 0.0, RAMP_MPS2_PER_S * (t_us - begin_us) / 1e6])


def fake_in(folder: Path, buffered: bool = True, **tree: str | None) -> FakeIio:
    """A fake with other files; ``__`` in a name stands for a slash."""
    fake = FakeIio(folder, Clock(), buffered=buffered)
    fake.tree |= {name.replace("__", "/"): text for name, text in tree.items()}
    fake.accel = ramp(fake)
    return fake


def looked(fake: FakeIio, seconds: float, config: IioConfig | None = None) -> tuple[list[Event], IioSource]:
    source = IioSource(config or fake.settings, fake.machine())
    source.open()
    events: list[Event] = []
    until_us = fake.clock.now_us + round(seconds * 1e6)
    while fake.clock.now_us < until_us:
        events += source.poll()
        source.rest()
    return events, source


def decoded(events: list[Event], config: IioConfig | None = None) -> tuple[AccelerationBlock, IioDecoder]:
    decoder = IioDecoder(config or IioConfig())
    for event in events:
        decoder.feed(event.t_us, event.data)
    decoder.flush()
    return decoder.take(), decoder


def late_us(fake: FakeIio, block: AccelerationBlock, begin_us: int) -> np.ndarray:
    """How much later than it was taken a sample is dated, where a step of the values says most about that."""
    steps = np.flatnonzero(np.diff(block.accel_mps2[:, 2])) + 1
    taken_us = begin_us + block.accel_mps2[steps, 2] / RAMP_MPS2_PER_S * 1e6 - STEP_US / 2
    return block.t_us[steps] - taken_us


def refused(monkeypatch: pytest.MonkeyPatch, number: int, *names: str) -> None:
    """Writes to files of these names (none: any) fail."""
    write = _iio_device.write

    def refuses(path: Path, text: str) -> None:
        if not names or any(str(path).endswith(name) for name in names):
            raise OSError(number, "refused")
        write(path, text)
    monkeypatch.setattr(_iio_device, "write", refuses)


def test_scans_with_times_are_dated_by_them(tmp_path: Path) -> None:
    fake = fake_in(tmp_path)
    fake.clock_error = 0.004
    begin_us = fake.clock.now_us
    events, source = looked(fake, 20)
    block, decoder = decoded(events)
    assert source.note == ""
    assert fake.text("trigger/current_trigger") == "fakecel-dev1"
    assert fake.text("scan_elements/in_temp_en") == "0"
    assert fake.text("sampling_frequency") == "200"
    assert 0 <= fake.taken - len(block) < 25
    assert decoder.counts == {"samples": len(block), "lost": 0, "resyncs": 0, "undated": 0, "undescribed": 0}
    late = late_us(fake, block, begin_us)
    assert np.abs(late - 2_500).max() < 3_500
    assert np.abs(np.diff(block.t_us) - 4_980).max() < 150
    source.close()
    assert fake.text("buffer/enable") == "0"


@pytest.mark.parametrize("clock", ["cannot be set", "there is none", "no timestamps"])
def test_without_times_that_can_be_used_they_are_recovered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, clock: str
) -> None:
    tree: dict[str, Any] = {
        "cannot be set": {}, "there is none": {"current_timestamp_clock": None},
        "no timestamps": {f"scan_elements__in_timestamp_{what}": None for what in ("en", "index", "type")}}[clock]
    fake = fake_in(tmp_path, **tree)
    if clock == "cannot be set":
        refused(monkeypatch, errno.EACCES, "current_timestamp_clock")
    begin_us = fake.clock.now_us
    block, decoder = decoded(looked(fake, 20)[0])
    assert 0 <= fake.taken - len(block) < 25
    assert decoder.doubt == ""
    assert np.abs(late_us(fake, block, begin_us) - 2_500).max() < 4_500


@pytest.mark.parametrize(("tree", "why"), [
    ({"buffer__enable": None}, "its driver in the kernel has no buffer"),
    ({"../trigger0/name": None, "../trigger1/name": None}, "there is no trigger for its buffer"),
])
def test_without_a_buffer_single_values_are_read_and_that_is_said(
    tmp_path: Path, tree: dict[str, str | None], why: str
) -> None:
    fake = fake_in(tmp_path, **tree)
    begin_us = fake.clock.now_us
    events, source = looked(fake, 20)
    assert f"read value by value, 100 times a second, as {why}" in source.note
    block, decoder = decoded(events)
    assert len(block) == pytest.approx(2000, abs=3)
    assert block.rate_hz == 100
    assert decoder.doubt == ""
    assert np.abs(late_us(fake, block, begin_us) - 5_000).max() < 6_000
    assert sum(event.data[:1] == b"{" for event in events) == 2  # at the beginning, and after ten seconds


def test_what_may_not_be_written_is_used_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the service, which may not write to sysfs: values one by one, unless somebody has switched the buffer on."""
    refused(monkeypatch, errno.EROFS)
    fake = fake_in(tmp_path / "off")
    _, source = looked(fake, 0.1)
    assert "the service is not allowed to switch its buffer on" in source.note
    on = {"buffer/enable": "1", "trigger/current_trigger": "other", "sampling_frequency": "200",
          **{f"scan_elements/in_accel_{axis}_en": "1" for axis in "xyz"}}
    fake = fake_in(tmp_path / "on", **on)
    events, source = looked(fake, 20)
    assert source.note == ""
    block, _ = decoded(events)
    assert 0 <= fake.taken - len(block) < 25
    source.close()
    assert fake.text("buffer/enable") == "1"


def test_a_buffer_that_the_kernel_refuses_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused(monkeypatch, errno.EINVAL, "buffer/length")
    assert "its buffer cannot be switched on (refused)" in looked(fake_in(tmp_path), 0.1)[1].note


def test_a_timer_gives_the_rate_where_the_chip_has_no_trigger_of_its_own(tmp_path: Path) -> None:
    fake = fake_in(tmp_path, **{"../trigger0/name": "ridelog-timer", "../trigger0/sampling_frequency": "10",
                                "sampling_frequency": None, "sampling_frequency_available": None})
    settings = fake.settings
    device = _iio_device.IioDevice(fake.machine().root, settings.device, settings.rate_hz, settings.scale_mps2)
    assert (fake.device / "../trigger0/sampling_frequency").read_text() == "200"
    assert device.describe()["rate_hz"] == "200"


@pytest.mark.parametrize(("asked", "available", "taken"), [
    (200, "12.5 25 50 100 200 400", "200"), (150, "12.5 100 208 416", "208"), (1000, "50 100 400", "400"),
    (250, "", "250"), (300, "[10 1 1600]", "1600")])
def test_the_rate_is_the_least_that_is_not_below_the_one_asked_for(
    tmp_path: Path, asked: int, available: str, taken: str
) -> None:
    fake = fake_in(tmp_path, sampling_frequency_available=available)
    IioSource(IioConfig(rate_hz=asked), fake.machine()).open()
    assert fake.text("sampling_frequency") == taken


def test_scale_offset_and_mounting_are_taken_into_account(tmp_path: Path) -> None:
    fake = fake_in(tmp_path, in_accel_y_scale="0.02", in_accel_x_offset="-10", in_accel_offset="5",
                   in_mount_matrix="0, 1, 0; -1, 0, 0; 0, 0, 1")
    fake.accel = lambda t_us: np.array([100, 200, 300]) * SCALE
    block, _ = decoded(looked(fake, 3)[0])
    # y on X, minus x on Y
    assert block.accel_mps2[50] == pytest.approx([205 * 0.02, -90 * SCALE, 305 * SCALE], abs=1e-9)


def test_a_scale_of_the_settings_is_set_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = fake_in(tmp_path / "a")
    IioSource(IioConfig(scale_mps2=0.0192), fake.machine()).open()
    assert fake.text("in_accel_scale") == "0.01916"
    with pytest.raises(BadReply, match=r"expected the scale 0\.1 m/s2 .*scale_mps2.*0\.00958, 0\.01916, 0\.03832"):
        IioSource(IioConfig(scale_mps2=0.1), fake.machine()).open()
    refused(monkeypatch, errno.EACCES)
    fake = fake_in(tmp_path / "b")
    with pytest.raises(BadReply, match=r"expected the scale 0\.01916 m/s2"):
        IioSource(IioConfig(scale_mps2=0.01916), fake.machine()).open()
    IioSource(IioConfig(scale_mps2=0.00958), fake.machine()).open()


def test_coarse_steps_that_the_settings_do_not_know_are_doubtful(tmp_path: Path) -> None:
    fake = fake_in(tmp_path, in_accel_scale="0.623000", in_accel_scale_available="0.623 1.248 2.491 4.983")
    events, _ = looked(fake, 2)
    assert "one step of fakecel is 0.623 m/s2" in decoded(events)[1].doubt
    assert decoded(events, IioConfig(scale_mps2=0.623))[1].doubt == ""


@pytest.mark.parametrize(("name", "text"), [("in_accel_scale", "0.038320"), ("sampling_frequency", "25"),
                                            ("buffer/enable", "0"), ("name", "other")])
def test_settings_that_change_are_noticed_within_a_second(tmp_path: Path, name: str, text: str) -> None:
    fake = fake_in(tmp_path)
    _, source = looked(fake, 3)
    (fake.device / name).write_text(text)
    changed_us = fake.clock.now_us
    with pytest.raises(SettingsLost, match="no longer has the settings"):
        while True:
            source.poll()
            source.rest()
    assert fake.clock.now_us - changed_us < 1_300_000


@pytest.mark.parametrize("buffered", [True, False])
def test_a_device_that_goes_is_gone(tmp_path: Path, buffered: bool) -> None:
    fake = fake_in(tmp_path, buffered)
    _, source = looked(fake, 2)
    fake.unplug()
    with pytest.raises(NotPresent):
        for _ in range(300):
            source.poll()
            source.rest()
    source.close()
    with pytest.raises(NotPresent, match="the kernel has no IIO accelerometer"):
        source.open()


def test_of_several_the_settings_have_to_name_one(tmp_path: Path) -> None:
    fake = fake_in(tmp_path, **{"../iio:device0/name": "adxl999", "../iio:device0/in_accel_x_raw": "1",
                                "../iio:device2/name": "bmp280"})
    with pytest.raises(NotPresent, match=r"'device'.*adxl999 \(iio:device0\), fakecel \(iio:device1\)"):
        IioSource(IioConfig(), fake.machine()).open()
    for word in ("fakecel", "iio:device1"):
        IioSource(IioConfig(device=word), fake.machine()).open()


def test_a_node_that_may_not_be_opened_is_named(tmp_path: Path) -> None:
    fake = fake_in(tmp_path)
    machine = fake.machine()
    fake.node.unlink()
    with pytest.raises(NotPresent, match=r"iio:device1: No such file"):
        IioSource(fake.settings, machine).open()


@pytest.mark.parametrize(("number", "words"), [
    (errno.EPERM, r"device policy .*DeviceAllow=\S*iio:device1 r on two lines"), (errno.EACCES, "by a udev rule"),
    (errno.EBUSY, "another program reads it"),
])
def test_a_node_that_may_not_be_read_says_who_forbids_it(
        tmp_path: Path, number: int, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = fake_in(tmp_path)
    machine, opens = fake.machine(), os.open

    def refuse(path: Path, *arguments: Any, **named: Any) -> int:
        if path == fake.node:
            raise OSError(number, os.strerror(number))
        return opens(path, *arguments, **named)

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(NotPresent, match=words):
        IioSource(fake.settings, machine).open()


@pytest.mark.parametrize("call", ["open", "read", "close", "wait"])
def test_whatever_its_node_answers_costs_its_own_readings_and_keeps_nothing_open(
        tmp_path: Path, call: str, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = fake_in(tmp_path)
    machine = fake.machine()
    works = {name: getattr(os, name) for name in ("open", "read", "close")}
    nodes: set[int] = set()

    def opens(path: Any, *arguments: Any, **named: Any) -> int:
        if path == fake.node and call == "open":
            raise fault
        descriptor: int = works["open"](path, *arguments, **named)
        nodes.update({descriptor} if path == fake.node else ())
        return descriptor

    def fails(name: str) -> Callable[..., Any]:
        def failing(descriptor: int, *arguments: Any) -> Any:
            is_node = descriptor in nodes
            if name == "close":
                nodes.discard(descriptor)
                works[name](descriptor)
            if is_node and call == name:
                raise fault
            return works[name](descriptor, *arguments) if name != "close" else None
        return failing

    def ready(descriptor: int, timeout_s: float) -> bool:
        if call == "wait":
            raise fault
        return True

    monkeypatch.setattr(os, "open", opens)
    for name in ("read", "close"):
        monkeypatch.setattr(os, name, fails(name))
    machine = replace(machine, wait_readable=ready)
    for number in errno.errorcode:
        fault: Exception = OSError(number, os.strerror(number))
        source = IioSource(fake.settings, machine)
        with suppress(DeviceError), as_device_error():
            source.open()
            source.poll()
        with suppress(DeviceError), as_device_error():
            source.close()
        assert not nodes
        assert (fake.device / "buffer/enable").read_text().strip() == "0"


def test_scans_that_come_in_pieces_are_put_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.sources.READ_BYTES", 13)
    fake = fake_in(tmp_path)
    begin_us = fake.clock.now_us
    block, decoder = decoded(looked(fake, 1)[0])
    assert len(block) > 2
    assert np.abs(late_us(fake, block, begin_us) - 2_500).max() < 4_000
    assert decoder.counts["undescribed"] == 0


def test_a_recording_that_has_lost_its_beginning_is_read_from_the_next_description(tmp_path: Path) -> None:
    events, _ = looked(fake_in(tmp_path), 30)
    whole, _ = decoded(events)
    rest, decoder = decoded(events[100:])
    assert 0 < decoder.counts["undescribed"] < 300
    assert rest.t_us[0] - whole.t_us[0] < 10_500_000
    assert np.isin(np.round(rest.accel_mps2[:, 2], 6), np.round(whole.accel_mps2[:, 2], 6)).all()


def test_another_device_in_the_middle_has_its_own_scale(tmp_path: Path) -> None:
    one, _ = looked(fake_in(tmp_path / "a"), 5)
    two, _ = looked(fake_in(tmp_path / "b", in_accel_scale="0.038320"), 5)
    values, _ = looked(fake_in(tmp_path / "c", buffered=False), 5)
    parts = [decoded(events)[0] for events in (one, two, values)]
    shifted = [Event(event.t_us + 10_000_000 * k, event.source, event.data)
               for k, events in enumerate((one, two, values)) for event in events]
    block, decoder = decoded(shifted)
    assert len(block) == sum(len(part) for part in parts) == decoder.counts["samples"]
    assert np.array_equal(block.accel_mps2, np.concatenate([part.accel_mps2 for part in parts]))


DESCRIPTION = {
    "name": "chip", "polled": False,
    "channels": [*([f"in_accel_{axis}", k, "le:s12/16>>4"] for k, axis in enumerate("xyz")),
                 ["in_timestamp", 3, "le:s64/64>>0"]],
    "scale": dict.fromkeys("xyz", "0.01"), "offset": dict.fromkeys("xyz", "0"), "matrix": "", "clock": "monotonic",
    "rate_hz": "200"}


@pytest.mark.parametrize(("kind", "data", "value"), [
    ("le:s12/16>>4", b"\xf0\xff", -1), ("le:s12/16>>4", b"\x0f\x80", -2048), ("be:s16/16", b"\x80\x00", -32768),
    ("be:u12/16>>4", b"\xff\xf0", 4095), ("le:s24/32>>8", b"\x55\x00\x00\x80", -(1 << 23)),
    ("be:s20/32>>12", b"\xff\xff\xf7\x77", -1), ("le:u8/8", b"\xfe", 254), ("le:s64/64>>0", b"\xff" * 8, -1),
    ("le:s13/16>>0X", b"", None), ("le:s16/16X1>>0", b"\x01\x00", 1)])
def test_numbers_are_read_as_their_type_says(kind: str, data: bytes, value: int | None) -> None:
    description = DESCRIPTION | {"channels": [[f"in_accel_{axis}", k, kind] for k, axis in enumerate("xyz")]}
    if value is None:
        with pytest.raises(BadReply):
            understood(description)
        return
    axis = understood(description).axes[0]
    assert axis.values(np.frombuffer(data, dtype=np.uint8)[None, :]).tolist() == [value]


def test_channels_are_aligned_as_the_kernel_aligns_them() -> None:
    """The example of the kernel's documentation (iio_devbuf.rst), with an axis as each of its channels."""
    channels = [["in_accel_x", 0, "be:u16/16>>0"], ["in_accel_y", 1, "be:u32/32>>0"], ["in_accel_z", 2, "be:u32/32>>0"],
                ["in_other", 3, "be:u64/64>>0"]]
    layout = understood(DESCRIPTION | {"channels": channels})
    assert ([axis.offset for axis in layout.axes], layout.scan_bytes) == ([0, 4, 8], 24)
    layout = understood(DESCRIPTION | {"channels": [
        ["in_big", 0, "le:s32/32>>0"], *([f"in_accel_{a}", k, "le:s8/8>>0"] for k, a in enumerate("xyz", start=1))]})
    assert layout.scan_bytes == 8  # one byte of nothing at the end


@pytest.mark.parametrize("change", [
    {"channels": DESCRIPTION["channels"][:2]}, {"channels": [["in_accel_x", 0, "le:s17/16>>0"]]}, {"channels": 7},
    {"channels": [["in_accel_x", 0, "le:s12/16>>8"]]},
    {"channels": [*DESCRIPTION["channels"], ["in_more", 3, "le:s8/8"]]},
    {"scale": {"x": "1"}}, {"scale": dict.fromkeys("xyz", "0")}, {"scale": dict.fromkeys("xyz", "nan")}, {"scale": []},
    {"offset": dict.fromkeys("xyz", "1e300")}, {"matrix": "1, 0; 0, 1"}, {"matrix": 5}, {"rate_hz": "0"},
    {"rate_hz": "much"}, {"rate_hz": None}])
def test_a_description_that_cannot_be_is_refused_in_one_line(change: dict[str, Any]) -> None:
    with pytest.raises(BadReply, match=r"^an IIO description: expected [^\n]*$"):
        understood(DESCRIPTION | change)


VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=9),
    lambda one: st.lists(one, max_size=4) | st.dictionaries(st.sampled_from("xyz"), one, max_size=3), max_leaves=9)


@pytest.mark.slow
@settings(max_examples=300)
@given(data=st.one_of(
    st.binary(max_size=200),
    st.tuples(st.sampled_from([*DESCRIPTION]), VALUES).map(
        lambda change: json.dumps(DESCRIPTION | {change[0]: change[1]}).encode()),
    st.binary(max_size=60).map(lambda rest: b"s" + rest), st.binary(max_size=60).map(lambda rest: b"p" + rest)))
def test_no_event_does_harm(data: bytes) -> None:
    decoder = IioDecoder(IioConfig())
    decoder.feed(0, json.dumps(DESCRIPTION).encode())
    for t_us in (1_000_000, 2_000_000):
        try:
            decoder.feed(t_us, data)
        except BadReply as error:
            assert "\n" not in str(error)
    decoder.flush()
    block = decoder.take()
    assert np.isfinite(block.accel_mps2).all()


def test_what_is_no_json_is_refused() -> None:
    for data in (b"{", b"[]", b"{" * 50_000, b"\xff"):
        with pytest.raises(BadReply):
            read_description(data)


@pytest.mark.parametrize(("name", "text"), [("in_accel_scale", "soon"), ("scan_elements/in_accel_x_index", "first"),
                                            ("sampling_frequency_available", "fast [faster"), ("in_mount_matrix", "?")])
def test_files_that_say_what_cannot_be_are_no_traceback(tmp_path: Path, name: str, text: str) -> None:
    fake = fake_in(tmp_path, **{name: text})
    try:
        IioSource(IioConfig(scale_mps2=0.00958), fake.machine()).open()
    except BadReply as error:
        assert "\n" not in str(error)
