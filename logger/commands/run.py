"""``ridelog run``: the service."""

import logging
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from logger.errors import RidelogError
from logger.question import Checked, Option, Question, Verb
from logger.service.config import find_config, learned_path, learns_car, load_config
from logger.service.systemd_notify import Stop, stopped_by_signals
from logger.store.log.log_name import log_name

PAUSE_S = 30


@dataclass(frozen=True, kw_only=True)
class RunQuestion(Question):
    """Read the sensors, cut the drive into windows and write the logs: the service itself.

      ridelog run
      ridelog run --config ridelog.yaml

    Exit status 0: you stopped it; 1: the system failed; 2: the settings are wrong (correct them first).
    systemd starts it; SIGTERM and Ctrl-C finish the current window and close the files.
    """

    config: Annotated[Path | None, Option("settings (default: the machine's)", metavar="FILE", read=Path)] = None
    learn_car: Annotated[bool, Option("learn the car from the logs, if vehicle is auto, and end: the service uses it "
                                      "from its next start")] = False


VERB = Verb(RunQuestion, "logger.commands.run:served", has_json=False)


def served(asked: RunQuestion) -> Checked:
    """Serve until it is told to stop."""
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    if asked.learn_car:
        return _learned(find_config(asked.config))
    with stopped_by_signals() as stop:
        return Checked("", {}, _is_served(asked, stop))


def _learned(settings: Path) -> Checked:
    """The car of all drives so far, where there are new ones: by a process of its own, as what the service loads is
    little."""
    if not learns_car(settings):
        return Checked("vehicle is not auto: nothing to learn", {}, True)
    config = load_config(settings)
    folder = config.log.directory
    logs = [name.session for path in folder.glob("*.csv") if (name := log_name(path))]
    if config.wheelbase_m is None or not logs or config.vehicle == (path := learned_path(folder, max(logs))):
        return Checked("no new drives", {}, True)
    mass = ("--mass", f"{config.mass_kg:g}") if config.mass_kg else ()
    words = ("learn-car", folder, "--wheelbase", f"{config.wheelbase_m:g}", *mass, "--out", path)
    return Checked("", {}, subprocess.run([Path(sys.executable).with_name("ridelog"), *words]).returncode == 0)


def _is_served(asked: RunQuestion, stop: Stop) -> bool:
    """Whether it was told to stop, and did not stop by itself."""
    try:
        config = load_config(find_config(asked.config))
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
        return False
    return True


def _is_restarted() -> bool:
    """True where systemd starts the service again at once, for ever: what will most likely fail again, and need not
    wear the card and fill the journal meanwhile, first waits. (RestartSteps= is not known to systemd 252.)"""
    return "NOTIFY_SOCKET" in os.environ
