"""Read the sensors, cut the drive into windows and write the logs: the service itself.

  ridelog run
  ridelog run --config ridelog.yaml

Exit status 0: you stopped it; 1: the system failed; 2: the settings are wrong (correct them first).
systemd starts it; SIGTERM and Ctrl-C finish the current window and close the files.
"""

from __future__ import annotations

import argparse
import logging
import os
from pathlib import Path

from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, RidelogError
from logger.service.config import find_config, load_config
from logger.service.systemd_notify import Stop, stopped_by_signals

PAUSE_S = 30


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog run``."""
    parser.add_argument("--config", metavar="FILE", type=Path, help="settings (default: the machine's)")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog run``."""
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    with stopped_by_signals() as stop:
        return _served(args, stop)


def _served(args: argparse.Namespace, stop: Stop) -> int:
    try:
        config = load_config(find_config(args.config))
        from logger.service.serve import serve

        serve(config, stop)
    except RidelogError as error:
        if _is_restarted():
            logging.getLogger(__name__).error("%s; tried again in %d s", error, PAUSE_S)
            stop.wait(PAUSE_S)
        raise
    except OSError as error:
        # Not status 2: a full card or a lost mount may be well again at the next start, which systemd makes.
        logging.getLogger(__name__).error("stopped by the system: %s", error)
        if _is_restarted():
            stop.wait(PAUSE_S)
        return EXIT_CHECK_FAILED
    return EXIT_DONE


def _is_restarted() -> bool:
    """True where systemd starts the service again at once, for ever: what will most likely fail again, and need not
    wear the card and fill the journal meanwhile, first waits. (RestartSteps= is not known to systemd 252.)"""
    return "NOTIFY_SOCKET" in os.environ
