"""``ridelog install`` and ``ridelog uninstall``, step by step."""

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import logger
from drivers.hardware import port_advice
from logger.errors import BadInput, RidelogError
from logger.installation import CONFIG, PROGRAM, Installation, InstallationStep, hidden_from_services, run_command
from logger.question import Answer, Option, Question, Verb
from logger.service.config import Config, load_config
from logger.store.log.disk_quota import memory_notice

_THIS_MACHINE = Path("/")


@dataclass(frozen=True, kw_only=True)
class InstallQuestion(Question):
    """Set up user, groups, units, rules and settings, and start the service. It keeps settings that you changed.

      sudo ridelog install --dry-run
      sudo ridelog install

    'sudo ridelog install --dry-run' prints every step and takes none; 'ridelog uninstall' undoes it and keeps the logs.
    """

    dry_run: Annotated[bool, Option("print each step and take none")] = False
    root: Annotated[Path, Option("folder in place of /, such as the mounted image of a card",
                                 metavar="DIR", read=Path)] = _THIS_MACHINE


class UninstallQuestion(InstallQuestion):
    """Stop the service and remove the files that 'ridelog install' wrote, except those changed since.

      sudo ridelog uninstall --dry-run
      sudo ridelog uninstall

    The logs, the user ridelog who owns them and the program itself stay; --dry-run prints every step and takes none.
    """


VERB = Verb(InstallQuestion, "logger.commands.install:installed", has_json=False)
UNINSTALL = Verb(UninstallQuestion, "logger.commands.install:uninstalled", has_json=False)


def installed(asked: InstallQuestion) -> Answer:
    """Install; what should be known of the machine. A dry run refuses what the real one would, but for the lack of
    rights."""
    if asked.root.resolve() == _THIS_MACHINE:
        _refuse_hidden(_program())
    carry_out(installation(asked).install(), asked)
    return Answer("\n".join(f"note: {notice}" for notice in notices(asked.root)), {})


def uninstalled(asked: UninstallQuestion) -> Answer:
    """Take away what was installed."""
    carry_out(installation(asked).uninstall(), asked)
    return Answer("", {})


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


def installation(asked: InstallQuestion) -> Installation:
    """The installation that is asked for. Raises BadInput where there can be none."""
    if not asked.root.is_dir():
        raise BadInput(f"{asked.root}: expected a folder")
    if asked.root.resolve() != _THIS_MACHINE:
        return Installation(asked.root.resolve(), PROGRAM, run_command)
    if os.geteuid() != 0 and not asked.dry_run:
        raise BadInput("expected to be run as root: sudo ridelog ... (--dry-run needs no rights)")
    return Installation(_THIS_MACHINE, _program(), run_command)


def _program() -> Path:
    return Path(sys.executable).with_name("ridelog")


def _refuse_hidden(program: Path) -> None:
    """Raises BadInput for a program, its Python (of which a venv has but a link) or its code (that of an editable
    installation stays where it was) in a place that the units hide."""
    for place in (program, Path(sys.executable).resolve(), Path(logger.__file__).resolve()):
        if hidden_from_services(place):
            raise BadInput(f"{place}: expected the program, its Python and its code where a service can read them, "
                           f"such as {PROGRAM.parent.parent}")


def carry_out(steps: list[InstallationStep], asked: InstallQuestion) -> None:
    """Print each step and, unless this is a dry run, take it. Raises CheckFailed or ``OSError`` at one that fails."""
    os.umask(0o022)  # the service's user reads its settings
    for step in steps:
        print(step.words, flush=True)
        if step.act is not None and not asked.dry_run:
            step.act()
