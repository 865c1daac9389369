"""How full a line is, by the chunks in which its bytes are read."""

from __future__ import annotations

import random

import pytest

from drivers.nmea import LineLoad


def watched(share: float, carries: float = 1.0, lasting_s: float = 30.0) -> LineLoad:
    """A line of 9600 baud, read as ``SerialSource`` reads: a burst each second fills this share of it. ``carries``: its
    true rate over 960 bytes a second."""
    line, rng = LineLoad(9600), random.Random(2)
    line.begin(0)
    read, at_s = 0, 0.0
    while at_s < lasting_s:
        at_s += 0.05 + 0.01 * rng.random() if rng.random() < 0.5 else 0.002
        arrived = int(at_s) * share + min(at_s % 1, share / carries) * carries
        now = int(960 * arrived)
        if now > read:
            line.note(round(at_s * 1e6), now - read)
            read = now
    return line


@pytest.mark.parametrize(("share", "carries", "is_full"), [
    (1.0, 1.0, True), (1.02, 1.02, True), (0.98, 0.98, True), (0.93, 1.0, False), (0.4, 1.0, False), (3.0, 3.0, False)],
    ids=["full", "a fast clock", "a slow clock", "nearly full", "usual", "USB, which has no such limit"])
def test_a_line_is_full_when_it_never_pauses(share: float, carries: float, is_full: bool) -> None:
    line = watched(share, carries)
    assert line.is_full == line.may_wait == is_full


def test_at_the_start_nobody_knows() -> None:
    line = LineLoad(9600)
    line.note(5_000_000, 50)
    assert line.may_wait
    assert not line.is_full
    paused = LineLoad(9600)
    paused.begin(4_000_000)
    paused.note(5_000_000, 50)
    assert not paused.may_wait
