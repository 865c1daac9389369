"""Set up user, groups, units, rules and settings, and start the service. Settings that were changed stay.

  sudo ridelog install --dry-run
  sudo ridelog install

'sudo ridelog install --dry-run' prints every step and takes none; 'ridelog uninstall' undoes it and keeps the logs.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import logger
from drivers.hardware import port_advice
from logger.errors import EXIT_DONE, BadInput, RidelogError
from logger.installation import CONFIG, PROGRAM, Installation, InstallationStep, hidden_from_services, run_command
from logger.service.config import Config, load_config
from logger.store.log.disk_quota import memory_notice

_THIS_MACHINE = Path("/")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog install`` and ``ridelog uninstall``."""
    parser.add_argument("--dry-run", action="store_true", help="print each step and take none")
    parser.add_argument("--root", metavar="DIR", type=Path, default=_THIS_MACHINE,
                        help="install into this folder instead, such as the mounted image of a card")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog install``. A dry run refuses what the real one would, but for the lack of rights."""
    if args.root.resolve() == _THIS_MACHINE:
        _refuse_hidden(_program())
    status = carry_out(installation(args).install(), args)
    for notice in notices(args.root):
        print(f"note: {notice}")
    return status


def notices(root: Path) -> list[str]:
    """What somebody should know of the machine with the settings that it has now: logs in memory, a receiver's port
    that is not on the pins. Of a folder that is to become a machine only its port."""
    try:
        config = load_config(root / CONFIG) if (root / CONFIG).exists() else Config()
    except RidelogError as error:
        return [str(error)]
    sensor = config.accelerometer
    ports = [config.gps.port, sensor.kind.place(sensor.settings)]
    in_memory = memory_notice(config.log.directory) if root.resolve() == _THIS_MACHINE else ""
    return list(filter(None, [in_memory, *(port_advice(port, root) for port in ports)]))


def installation(args: argparse.Namespace) -> Installation:
    """The installation that the arguments mean. Raises BadInput where there can be none."""
    if not args.root.is_dir():
        raise BadInput(f"{args.root}: expected a folder")
    if args.root.resolve() != _THIS_MACHINE:
        return Installation(args.root.resolve(), PROGRAM, run_command)
    if os.geteuid() != 0 and not args.dry_run:
        raise BadInput("expected to be run as root: sudo ridelog ... (--dry-run needs no rights)")
    return Installation(_THIS_MACHINE, _program(), run_command)


def _program() -> Path:
    return Path(sys.executable).with_name("ridelog")


def _refuse_hidden(program: Path) -> None:
    """Raises BadInput for a program, its Python (of which a venv has but a link) or its code (that of an editable
    installation stays where it was) in a place that the units hide."""
    for place in (program, Path(sys.executable).resolve(), Path(logger.__file__).resolve()):
        if hidden_from_services(place):
            raise BadInput(f"{place}: expected the program, its Python and its code in a place that a service can see, "
                           f"such as {PROGRAM.parent.parent}")


def carry_out(steps: list[InstallationStep], args: argparse.Namespace) -> int:
    """Print each step and, unless this is a dry run, take it. Raises CheckFailed or ``OSError`` at one that fails."""
    os.umask(0o022)  # the service's user reads its settings
    for step in steps:
        print(step.words, flush=True)
        if step.act is not None and not args.dry_run:
            step.act()
    return EXIT_DONE
