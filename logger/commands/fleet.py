"""Many cars over years: logs into a dataset, the figures of its roads and cars, and a map of them.

  ridelog fleet ingest /media/RIDELOG --to county --car "van 7"
  ridelog fleet summarise county --by section --since 2026-01-01 --out sections.parquet
  ridelog fleet report county --out map/

docs/fleet.md describes all of it, from the stick in a depot to the map.
"""

from __future__ import annotations

import argparse

from logger.api.log_questions import INGEST, REPORT, SUMMARISE
from logger.commands import options

VERBS = {"ingest": (INGEST, "add logs to a dataset"), "summarise": (SUMMARISE, "figures of roads and cars"),
         "report": (REPORT, "a map in a folder")}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the verbs."""
    options.add_verbs(parser, "fleet_verb", VERBS)


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog fleet``."""
    return options.run(VERBS[args.fleet_verb][0], args)
