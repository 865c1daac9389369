"""Set up user, groups, units, rules and settings, and start the service. Settings that were changed stay.

'sudo ridelog install --dry-run' prints every step and takes none; 'ridelog uninstall' undoes it and keeps the logs.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from logger.errors import EXIT_DONE, BadInput
from logger.store.installation import PROGRAM, Installation, Step, hidden_from_services, run_command

_THIS_MACHINE = Path("/")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog install`` and ``ridelog uninstall``."""
    parser.add_argument("--dry-run", action="store_true", help="print each step and take none")
    parser.add_argument("--root", metavar="DIR", type=Path, default=_THIS_MACHINE,
                        help="a folder that is to become the root of a machine, instead of this machine")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog install``."""
    return carry_out(installation(args).install(), args)


def installation(args: argparse.Namespace) -> Installation:
    """The installation that the arguments mean. Raises BadInput where there can be none."""
    if not args.root.is_dir():
        raise BadInput(f"{args.root}: expected a folder")
    if args.root.resolve() != _THIS_MACHINE:
        return Installation(args.root.resolve(), PROGRAM, run_command)
    program = Path(sys.executable).with_name("ridelog")
    if args.dry_run:
        return Installation(_THIS_MACHINE, program, run_command)
    if hidden_from_services(program):
        raise BadInput(f"{program}: expected the program in a place that a service can see, such as {PROGRAM}")
    if os.geteuid() != 0:
        raise BadInput("expected to be run as root: sudo ridelog ... (--dry-run needs no rights)")
    return Installation(_THIS_MACHINE, program, run_command)


def carry_out(steps: list[Step], args: argparse.Namespace) -> int:
    """Print each step and, unless this is a dry run, take it. Raises CheckFailed or ``OSError`` at one that fails."""
    os.umask(0o022)  # the service's user reads its settings
    for step in steps:
        print(step.words, flush=True)
        if step.act is not None and not args.dry_run:
            step.act()
    return EXIT_DONE
