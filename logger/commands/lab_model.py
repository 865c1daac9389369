"""What the lab's commands share: their arguments, and progress on the screen."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.ranges import TOLERANCE, USUAL_TOLERANCE
from logger.commands.numbers import add_number
from logger.printable import word
from logger.report.text_layout import WIDTH

if TYPE_CHECKING:
    from logger.api.bench import Bench
    from logger.vehicle.effect import Effect


def add_bench_arguments(parser: argparse.ArgumentParser) -> None:
    """RUN... and ``add_lab_options``."""
    _add_runs(parser)
    add_lab_options(parser)


def add_lab_options(parser: argparse.ArgumentParser) -> None:
    """Those of ``add_model_and_runs``, but for RUN..., and --effect-file."""
    _add_options(parser)
    parser.add_argument("--effect-file", action="append", default=[], metavar="FILE.py",
                        help="a Python file with an effect of your own, to be tried as well; may repeat. The names "
                             "hysteresis and frame_friction are taken too: ridelog has these effects, and tries them "
                             "only where they are asked for")


def add_model_and_runs(parser: argparse.ArgumentParser) -> None:
    """RUN..., --vehicle, --tolerance, --low-pass, --anyway and --json."""
    _add_runs(parser)
    _add_options(parser)


def _add_runs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN",
                        help="folder with drive.csv and profile.csv, or of a rig excitation.csv")


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)")
    _add_tolerance(parser)
    _add_low_pass(parser)
    add_anyway(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def add_anyway(parser: argparse.ArgumentParser) -> None:
    """--anyway."""
    parser.add_argument("--anyway", action="store_true",
                        help="go on where a run does not seem to be of this road or this car, or in these units")


def _add_tolerance(parser: argparse.ArgumentParser) -> None:
    """--tolerance, for ``tolerance_of``."""
    add_number(parser, "--tolerance", *TOLERANCE, metavar="SHARE",
               help="how far off the vehicle's masses, springs and dampers may well be (default: "
                    f"{USUAL_TOLERANCE:g}, 4 %%, and 10 %% where a search or the fit of an effect finds that the file "
                    "is a rough one; what you say holds)")


def _add_low_pass(parser: argparse.ArgumentParser) -> None:
    """--low-pass, for ``bench_of``."""
    parser.add_argument("--low-pass", type=float, metavar="HZ",
                        help="leave out frequencies above it, for example 20, in the record and in the model; errors "
                             "are of the rest (default: all that the record holds; a record that somebody has "
                             "low-passed is recognised, and said)")


def bench(args: argparse.Namespace, searches: str | None = None) -> Bench:
    """The model, runs and effects of a command line, as ``bench_of``."""
    return bench_from(args.vehicle, args.runs, args.effect_file, args.tolerance, searches, args.low_pass, args.anyway)


def bench_from(vehicle: str, folders: Sequence[Path], effect_files: Sequence[str] = (),
               tolerance: float | None = None, searches: str | None = None, low_pass_hz: float | None = None,
               anyway: bool = False) -> Bench:
    """The same, where they are not of a command line."""
    from logger.api.bench import bench_of, tolerance_of
    from logger.api.run_checks import lab_runs
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    off, model = tolerance_of(tolerance), read_model(vehicle_path(vehicle))
    return bench_of(vehicle, model, lab_runs(folders, vehicle=model.vehicle), effect_files, off, searches, warned,
                    low_pass_hz, anyway)


def warned(words: str) -> None:
    """Say on stderr that it will take long."""
    print(words, file=sys.stderr, flush=True)


def warn_of_slow_effects(effects: Iterable[Effect]) -> None:
    """Say so where simulations with these effects take long."""
    from logger.api.bench import slow_words

    if words := slow_words(effects):
        warned(words)


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """What is under way, on one line of the terminal that is wiped at the end; said to nobody where that is none."""
    try:
        yield on_screen()
    finally:
        wipe()


def on_screen() -> Callable[[str], None]:
    """Progress on one line of the terminal, on stderr; said to nobody where that is no terminal."""
    return _show if sys.stderr.isatty() else _show_nothing


def wipe() -> None:
    """End the line of progress."""
    if sys.stderr.isatty():
        print("\r" + " " * (WIDTH - 1) + "\r", end="", file=sys.stderr, flush=True)


def _show(words: str) -> None:
    print(f"\r{word(words, WIDTH - 1):{WIDTH - 1}}", end="", file=sys.stderr, flush=True)


def _show_nothing(_words: str) -> None:
    pass
