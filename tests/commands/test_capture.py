"""Recording raw bytes: on a pseudo-terminal as a process, and step by step on ports that misbehave."""

import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.dump import open_dump
from drivers.errors import NotPresent
from logger.commands import capture, main
from logger.errors import BadInput


class Port:
    """A port that gives some chunks, then is silent, or gone."""

    def __init__(self, chunks: list[bytes], gone: bool) -> None:
        self.chunks, self.gone, self.closed = chunks, gone, False

    def read(self, size: int, timeout_s: float) -> bytes:
        if self.chunks:
            return self.chunks.pop(0)
        if self.gone:
            raise OSError(5, "the cable is out")
        return b""

    def write(self, data: bytes) -> int:
        return len(data)

    def close(self) -> None:
        self.closed = True


def run(monkeypatch: pytest.MonkeyPatch, port: Port, out: Path, *arguments: str) -> int:
    """Run the command on a port, with a clock that gains 0.1 s at each look."""
    ticks = iter(range(0, 10**9, 100_000))
    monkeypatch.setattr(capture, "open_serial", lambda path, baud: port)
    monkeypatch.setattr(capture, "now_us", lambda: next(ticks))
    return main.main(["capture", "/dev/any", "--out", str(out), *arguments])


@pytest.mark.parametrize("name", ["a.dump", "a.dump.gz"])
def test_bytes_are_kept_with_their_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str) -> None:
    port = Port([b"\x01\x02", b"\xff", b""], gone=False)
    assert run(monkeypatch, port, tmp_path / name, "--seconds", "2") == 0
    with open_dump(tmp_path / name) as dump:
        events = list(dump)
    assert dump.header.accelerometer["driver"] == "pasco"
    assert [(event.source, event.data) for event in events] == [("pasco", b"\x01\x02"), ("pasco", b"\xff")]
    assert events[0].t_us < events[1].t_us
    assert port.closed
    assert not dump.torn_tail


def test_a_port_that_goes_keeps_what_came(monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    assert run(monkeypatch, Port([b"abc"], gone=True), tmp_path / "a.dump") == 1
    with open_dump(tmp_path / "a.dump") as dump:
        assert [event.data for event in dump] == [b"abc"]
    assert "the cable is out" in capsys.readouterr().err


def test_silence_says_what_to_check(monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    assert run(monkeypatch, Port([], gone=False), tmp_path / "a.dump", "--seconds", "1") == 1
    assert "Nothing arrived" in capsys.readouterr().out


def test_a_recording_is_never_overwritten(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "a.dump").write_text("mine", encoding="utf-8")
    port = Port([b"x"], gone=False)
    with pytest.raises(BadInput, match="never overwritten"):
        run(monkeypatch, port, tmp_path / "a.dump")
    assert port.closed
    assert (tmp_path / "a.dump").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(("out", "arguments", "expected"), [
    ("a.txt", (), "ends in .dump"), ("a.dump", ("--seconds", "0"), "more than 0"), ("no/a.dump", (), "can be written")])
def test_wrong_use_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, out: str, arguments: tuple[str, ...],
                              expected: str) -> None:
    with pytest.raises(BadInput, match=expected):
        run(monkeypatch, Port([], gone=False), tmp_path / out, *arguments)


def test_a_missing_port_is_reported(tmp_path: Path) -> None:
    with pytest.raises(NotPresent, match="no such port"):
        main.main(["capture", str(tmp_path / "tty"), "--out", str(tmp_path / "a.dump")])


def test_frames_of_fixed_length_show() -> None:
    frames = b"".join(bytes([0xAA, 0x55, number * 37 % 256, number * 91 % 251, number * 13 % 256, number % 7, 1, 2, 3])
                      for number in range(200))
    assert [distance for distance, _ in capture.repeat_distances(frames)] == [9, 18, 27]
    text = "\n".join(capture.first_look(frames))
    assert "binary" in text
    assert "every: 9 (" in text


@pytest.mark.parametrize("data", [b"\x07", bytes(500), bytes(range(256)) * 3])
def test_a_stream_without_frames_gives_no_guess(data: bytes) -> None:
    assert capture.repeat_distances(data) == []
    assert capture.first_look(data)


def test_lines_of_text_show() -> None:
    text = "\n".join(capture.first_look(b".1\n" + b"0.01,-0.02,1.00\r\n" * 50 + b"0.0"))
    assert "50 lines; one of them: '0.01,-0.02,1.00'" in text


def test_a_real_terminal_until_sigterm(tmp_path: Path) -> None:
    master, slave = pty.openpty()
    command = [sys.executable, "-c", "from logger.commands.main import run; run()", "capture", os.ttyname(slave),
               "--out", str(tmp_path / "a.dump.gz")]
    data = bytes(range(256)) * 4
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        assert b"Ctrl-C" in process.stderr.readline()
        os.write(master, data)
        reported = b""
        while b"1024 bytes," not in reported:
            reported += os.read(process.stderr.fileno(), 4096)
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=10)
    os.close(master)
    os.close(slave)
    assert process.returncode == 0
    assert out.startswith(b"1024 bytes in ")
    with open_dump(tmp_path / "a.dump.gz") as dump:
        assert b"".join(event.data for event in dump) == data
