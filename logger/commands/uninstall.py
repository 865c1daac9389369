"""Stop the service and take away the files that 'ridelog install' wrote, but for those that were changed since.

  sudo ridelog uninstall --dry-run
  sudo ridelog uninstall

The logs, the user ridelog who owns them and the program itself stay; --dry-run prints every step and takes none.
"""

from __future__ import annotations

import argparse

from logger.commands import install


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Those of ``ridelog install``."""
    install.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog uninstall``."""
    return install.carry_out(install.installation(args).uninstall(), args)
