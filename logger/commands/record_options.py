"""Options for records that are not what a command expects, and its doubts about one."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

from logger.printable import printable

UNITS = ("mps2", "g")
OWN_RATE = 0.0


def add_record_options(parser: argparse.ArgumentParser) -> None:
    """Declare ``--resample [HZ]`` and ``--unit``."""
    parser.add_argument("--resample", type=_rate_hz, nargs="?", const=OWN_RATE, metavar="HZ",
                        help="for a record whose times are uneven, come in bursts, or whose samples repeat: drop the "
                             "repeats and lay it on an even grid of HZ through an anti-alias filter; without HZ: of "
                             "the record's own rate, 100 Hz at least. The result says that it was done")
    parser.add_argument("--unit", choices=UNITS,
                        help="unit of the accelerations, whatever they look like (default: m/s2, and a record that is "
                             "plainly in g is refused)")


def _rate_hz(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        words = f"expected a rate in Hz, found {text!r}; a file goes before --resample"
        raise argparse.ArgumentTypeError(words) from None


def tell_doubts(file: Path, doubts: Iterable[str]) -> None:
    """What may be wrong with a record, a line each on stderr."""
    for words in doubts:
        print(printable(f"ridelog: {file}: {words}"), file=sys.stderr)
