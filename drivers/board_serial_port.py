"""Which serial port is on the pins of a Raspberry Pi, where somebody named another one.

Problem. /dev/serial0 is on pins 8 and 10 of every Raspberry Pi but the 5 and its like, where it is the three-pin debug
connector: a receiver on the pins is silent there, however right its wires. And /dev/ttyAMA0, which is right on those,
is the Bluetooth chip on a 3, a 4 and a Zero W. Solution. What the names lead to, and the model, are read from the
kernel.

Sources: Raspberry Pi documentation, computers/configuration/uart.adoc (primary and secondary UART by model; pull
request 3294 of raspberrypi/documentation); overlays/README (dtparam uart0).
"""

from __future__ import annotations

from pathlib import Path

MODEL = "sys/firmware/devicetree/base/model"
DEBUG = "ttyAMA10"
SWITCH_ON = "switch the port on (sudo raspi-config, Interface Options, Serial Port: no login shell, but the hardware)"
_SINCE_5 = ("Raspberry Pi 5", "Raspberry Pi Compute Module 5")  # "Raspberry Pi 500" begins so too
_ON_THE_PINS = "pins 8 and 10 of a {model} are /dev/ttyAMA0: write dtparam=uart0=on into /boot/firmware/config.txt, " \
               "restart, and set the port to /dev/ttyAMA0"


def port_advice(port: str, root: Path = Path("/")) -> str:
    """What to do about a port of the board that is not the one on its pins, or is off; empty: nothing is known.
    ``root``: below it lie ``dev`` and ``sys``."""
    try:
        place = root / Path(port).relative_to("/")
        target = place.resolve()
        is_there = place.exists()
        model = (root / MODEL).read_text("ascii", "replace").strip("\0\n ") if (root / MODEL).exists() else ""
        is_second = target == (root / "dev/serial1").resolve() and (root / "dev/serial1").exists()
    except (OSError, ValueError):
        return ""
    if target.name == DEBUG:
        return f"{port} is the three-pin debug connector; {_ON_THE_PINS.format(model='Raspberry Pi 5')}"
    if model.startswith(_SINCE_5):
        is_of_the_board = Path(port).name in ("serial0", "ttyS0") and target.name != "ttyAMA0"
        is_off = Path(port).name == "ttyAMA0" and not is_there
        return _ON_THE_PINS.format(model="Raspberry Pi 5") if is_of_the_board or is_off else ""
    if is_second and Path(port).name != "serial0":
        return (f"{port} is not on pins 8 and 10, but on the Bluetooth chip where the Pi has one: set the port to "
                "/dev/serial0")
    if model.startswith("Raspberry Pi") and Path(port).name in ("serial0", "ttyS0") and not is_there:
        return SWITCH_ON
    return ""
