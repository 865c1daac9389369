"""The service: reads the sensors, cuts the drive into windows, writes the logs.

systemd starts it; SIGTERM and Ctrl-C finish the current window and close the files.
"""

from __future__ import annotations

import argparse
import logging
import signal
import threading
from pathlib import Path

from logger.service.config import find_config, load_config


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog run``."""
    parser.add_argument("--config", metavar="FILE", type=Path, help="settings (default: the machine's)")
    parser.add_argument("--verbose", action="store_true", help="log more to stderr")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog run``."""
    logging.basicConfig(
        level=logging.DEBUG if args.verbose else logging.INFO, format="%(levelname)s %(name)s: %(message)s"
    )
    config = load_config(find_config(args.config))
    from logger.service.start import serve

    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    serve(config, stop)
    return 0
