"""Ports of the board, named as people name them on each model."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.hardware import MODEL, SWITCH_ON, port_advice

ON_A_5 = "pins 8 and 10 of a Raspberry Pi 5 are /dev/ttyAMA0"


def board(root: Path, model: str, *nodes: str, **links: str) -> Path:
    """The files of a machine: its model, its ports, and links to them."""
    (root / "dev").mkdir()
    (root / MODEL).parent.mkdir(parents=True)
    if model:
        (root / MODEL).write_text(f"{model}\0")
    for name in nodes:
        (root / "dev" / name).touch()
    for name, target in links.items():
        (root / "dev" / name).symlink_to(target)
    return root


PI_5 = ("Raspberry Pi 5 Model B Rev 1.0", "ttyAMA10")


@pytest.mark.parametrize(("machine", "links", "port", "words"), [
    (PI_5, {"serial0": "ttyAMA10"}, "/dev/serial0", "/dev/serial0 is the three-pin debug connector; " + ON_A_5),
    (PI_5, {"serial0": "ttyAMA10"}, "/dev/ttyAMA10", "three-pin debug connector"),
    (("", "ttyAMA10"), {"serial0": "ttyAMA10"}, "/dev/serial0", "three-pin debug connector"),
    (PI_5, {}, "/dev/serial0", ON_A_5),
    (PI_5, {}, "/dev/ttyS0", ON_A_5),
    (PI_5, {}, "/dev/ttyAMA0", "dtparam=uart0=on"),
    ((*PI_5, "ttyAMA0"), {"serial0": "ttyAMA10"}, "/dev/ttyAMA0", ""),
    ((*PI_5, "ttyAMA0"), {"serial0": "ttyAMA0"}, "/dev/serial0", ""),
    (("Raspberry Pi Compute Module 5 Rev 1.0",), {}, "/dev/serial0", ON_A_5),
    (("Raspberry Pi 500 Rev 1.0",), {}, "/dev/serial0", ON_A_5),
    (("Raspberry Pi 4 Model B Rev 1.4", "ttyS0", "ttyAMA0"), {"serial0": "ttyS0", "serial1": "ttyAMA0"},
     "/dev/serial0", ""),
    (("Raspberry Pi 4 Model B Rev 1.4", "ttyS0", "ttyAMA0"), {"serial0": "ttyS0", "serial1": "ttyAMA0"},
     "/dev/ttyAMA0", "/dev/ttyAMA0 is not on pins 8 and 10, but on the Bluetooth chip"),
    (("Raspberry Pi 3 Model B Rev 1.2", "ttyS0", "ttyAMA0"), {"serial0": "ttyS0", "serial1": "ttyAMA0"},
     "/dev/serial1", "set the port to /dev/serial0"),
    (("Raspberry Pi 3 Model B Rev 1.2", "ttyAMA0"), {"serial1": "ttyAMA0"}, "/dev/serial0", SWITCH_ON),
    (("Raspberry Pi 3 Model B Rev 1.2", "ttyAMA0"), {"serial0": "ttyAMA0"}, "/dev/ttyAMA0", ""),
    (("Raspberry Pi Zero W Rev 1.1",), {}, "/dev/serial0", SWITCH_ON),
    (("Raspberry Pi Zero Rev 1.3", "ttyAMA0"), {"serial0": "ttyAMA0"}, "/dev/serial0", ""),
    (("Raspberry Pi Zero 2 W Rev 1.0", "ttyS0"), {"serial0": "ttyS0"}, "/dev/ttyUSB0", ""),
    ((*PI_5,), {"serial0": "ttyAMA10"}, "/dev/ttyACM0", ""),
    (("",), {}, "/dev/serial0", ""),
    (("",), {}, "COM3", ""),
])
def test_the_port_on_the_pins_is_named_where_it_is_another(
        tmp_path: Path, machine: tuple[str, ...], links: dict[str, str], port: str, words: str) -> None:
    said = port_advice(port, board(tmp_path, *machine, **links))
    assert words in said
    assert bool(words) == bool(said)
