"""Undo 'ridelog install'. Logs, and files that were changed since, stay where they are."""

from __future__ import annotations

import argparse

from logger.commands import install


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Those of ``ridelog install``."""
    install.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog uninstall``."""
    return install.carry_out(install.installation(args).uninstall(), args)
