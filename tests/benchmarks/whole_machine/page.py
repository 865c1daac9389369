"""The page docs/reference/whole-machine.md: each trial with its count and figures, and what could not be tried."""

from __future__ import annotations

import os
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from .catalogue import CATALOGUE, Check, Report

HEAD = """# ridelog on a whole machine

Written by `python -m tests.benchmarks.whole_machine --out docs/reference/whole-machine.md` on {day}. It
builds a disk with Debian 12 (systemd 252) from packages, installs ridelog by the README, boots it, and tries what is
promised. Only the instruments are models: the kernel, systemd, udev, file
systems and tools are the real ones.

- **UML**: user-mode Linux 6.1. The chip is the kernel's `i2c-stub` on `/dev/i2c-0`, its registers filled 100 times a
  second from a recorded drive; the receiver is a terminal of the host that is the guest's `/dev/ttyS0`; sticks are
  `scsi_debug` disks that udev takes for USB. A power cut kills the guest: its memory and its page cache are gone. In
  the trials of power cuts the logs are on a disk with a write cache of its own, which the cut empties too: what was not
  flushed is lost, but for some blocks that it wrote unasked, in any order.
- **QEMU**: an emulated PC with Debian's stock kernel, xHCI, usb-storage and usb-serial, plugged and pulled by its
  monitor. The service's watchdog waits 10 min there: without KVM it can be slower than real time on a busy host.
- **aarch64**: Debian for arm64, by user emulation and on an emulated board.

The times come from guests on a busy host ({cores} cores); they say nothing about a Pi.

| trial | guest | times | |
| --- | --- | --- | --- |
"""

NOT_TRIED = """
## What could not be tried, and why

- A chip that stops answering on a real bus: `i2c-stub` always answers, and its bus cannot be taken away while it is
  open. Tried instead: a bus that comes late, readings that freeze, settings that are lost. NACKs and a stuck bus are in
  `tests/benchmarks/faults.py`, against a model.
- The green LED: neither guest has one. The notes behind it are tried here, the light's files in `tests/store`.
- The Pi's own UART, I2C controller and kernel; supply dips of a real board; cards that wear out.
- Electrical unplugging of a stick: usb-storage is taken away between two transfers, never within one.
- KVM is not used: where this was written no guest with a stock kernel boots with it.
"""


def write_page(path: Path, reports: Sequence[Report]) -> None:
    """Write the page of these results; trials without one are named as not run."""
    path.write_text(page(reports, datetime.now(UTC).strftime("%d %B %Y")), encoding="utf-8")


def page(reports: Sequence[Report], day: str) -> str:
    """The page's text."""
    known = {report.name: report for report in reports}
    lines = [HEAD.format(day=day, cores=os.cpu_count())]
    for name, trial in CATALOGUE.items():
        report = known.get(name)
        lines.append(f"| [{words(name)}](#{name.replace('_', '-')}) | {trial.guest} | "
                     f"{report.times if report else ''} | {verdict(report)} |\n")
    for name, trial in CATALOGUE.items():
        lines.append(f"\n## {words(name)}\n\nPromised: {trial.promise}.\n")
        report = known.get(name)
        if report is None:
            lines.append("\nNot run.\n")
            continue
        times = f"{report.times} time{'s' * (report.times != 1)}"
        lines.append(f"\nTried {times}, {report.seconds / 60:.0f} min, at commit {report.commit}"
                     f"{': ' + report.cannot if report.cannot else ''}.\n\n| | | |\n| --- | --- | --- |\n")
        lines += [f"| {cell(check.what)} | {outcome(check)} | {cell(check.figure)} |\n" for check in report.checks]
    return "".join([*lines, NOT_TRIED])


def verdict(report: Report | None) -> str:
    """One word for a trial."""
    if report is None:
        return "not run"
    if report.cannot:
        return "could not be tried"
    return "held" if report.held else "**did not hold**"


def outcome(check: Check) -> str:
    """Whether a promise held; "measured" where nothing is promised."""
    if check.held is None:
        return "measured"
    return "held" if check.held else "**did not hold**"


def words(name: str) -> str:
    """A trial's name for people."""
    return name.replace("_", " ")


def cell(text: str) -> str:
    """Text for a table: one line, no bars."""
    return " ".join(text.split()).replace("|", "\\|")
