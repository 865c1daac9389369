"""The ``ridelog`` command: one verb per file of this folder (- is _ there), imported only when it is asked for.

A fault that is expected, whatever the verb, becomes one line on stderr and an exit status: 1 the check that was
asked for failed, 2 wrong use or bad input, 130 and 141 as shells name an interrupt and a closed pipe.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
import textwrap
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NoReturn, TextIO, cast

from drivers.errors import DriverError
from logger.errors import EXIT_BAD_INPUT, RidelogError, did_you_mean
from logger.files import written_files
from logger.printable import LONGEST_COMPLAINT, printable, word

VERBS = {
    "demo": "run a recorded drive through the service and show the result; needs no hardware",
    "run": "the service that logs a drive (what systemd starts)",
    "replay": "play a recorded dump through the same service",
    "status": "what the running service is doing",
    "verify": "check logs, dumps and exported sticks for damage and gaps",
    "export": "copy finished logs to a USB stick",
    "install": "set up the service on this machine; --dry-run shows every step",
    "uninstall": "stop the service and remove what install wrote; logs, changed settings and the user stay",
    "report": "make one web page of logs: map, plots, table",
    "sections": "logs in sections of 100 m, 0.1 mi or any length: IRI with its error, condition, comfort",
    "passes": "repeated drives combined: means by place and direction, what changed, places to visit",
    "fleet": "many cars over years: logs into a dataset, figures of its roads and cars, a map",
    "convert": "logs as GeoJSON, GeoPackage, GPX, KML, Parquet or CSV, for other programs",
    "iri": "exact IRI of a measured profile",
    "comfort": "ISO 2631 comfort and health values of an acceleration record",
    "extract": "runs for the lab from recorded dumps or a phone's CSV, placed on a measured line",
    "calibrate": "the roughness that a vehicle's acceleration means, per speed",
    "road": "make a random road, or classify a measured one",
    "simulate": "what a vehicle's accelerometer would record on a road",
    "estimate": "IRI and profile of the road from a drive's acceleration, and the best that is possible",
    "identify": "vehicle parameters from drives over known roads, each with its standard error",
    "compare": "model against measurement: the error, where it is, and what kind of thing is missing",
    "diagnose": "which physical effect a model lacks, how certain that is, and what else it could be",
    "add-effect": "add a physical effect to a vehicle: its numbers, the error before and after, what it changed",
    "learn": "learn a law from the data, where no known effect explains what a model lacks",
    "plan": "before anybody drives: which effects drives could show and distinguish, and which drive adds most",
    "lab": "compare, diagnose, add, compare again, until nothing is missing; writes all of it as a page",
    "study": "a table or figure of the reference dissertation with its printed values",
    "modes": "natural frequencies, damping ratios and mode shapes of a vibration record",
    "fixed-point": "write the filters as C headers for integer arithmetic",
    "capture": "record the raw bytes of a serial port",
    "hil": "play a recorded dump into serial ports for the running service, and check its log",
}
ASKED = {
    "identify": "identify.question:VERB",
    "compare": "lab.question:COMPARE",
    "diagnose": "lab.question:DIAGNOSE",
    "add-effect": "lab.question:ADD_EFFECT",
    "learn": "lab.question:LEARN",
    "plan": "lab.question:PLAN",
    "convert": "log_questions:CONVERT",
    "sections": "log_questions:SECTIONS",
    "passes": "log_questions:PASSES",
    "iri": "drive_questions:EXACT_IRI",
    "estimate": "drive_questions:ESTIMATE",
    "modes": "drive_questions:MODES",
    "comfort": "drive_questions:COMFORT",
    "calibrate": "drive_questions:CALIBRATE",
}
"""Verbs that are declared by a question, and where in ``logger.api``."""
MOST_NAMED = 8
"""Of more files in one folder only their number is said: a screen still holds the result above."""
EXIT_INTERRUPTED = 130
EXIT_PIPE_CLOSED = 141


class _Help(argparse.RawDescriptionHelpFormatter):
    """Help whose long words, such as the columns of a file, stay whole."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_long_words=False, break_on_hyphens=False)

    def _expand_help(self, action: argparse.Action) -> str:
        return action.help or ""  # as it stands: "2 %" is no place for a value


_SAID = (
    (r"argument (\S+): invalid float value: '(.*)'", r"\1 \2: expected a number"),
    (r"argument (\S+): invalid int value: '(.*)'", r"\1 \2: expected a whole number"),
    (r"argument \S+\|\S+: invalid choice: '(.*)' \(choose from (.*)\)", r"expected one of \2, found '\1'"),
    (r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)", r"\1 \2: expected one of \3"),
    (r"the following arguments are required: (.*)", r"expected \1"),
    (r"unrecognized arguments: (.*)", r"expected no \1"),
)
"""Complaints of argparse, and how all others here are worded."""


class _Once(argparse.Action):
    """An option with one value: who gives it twice would lose the first. Options that may repeat are ``append``."""

    _is_given = False

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any,
                 option_string: str | None = None) -> None:
        if self.option_strings and self._is_given:
            parser.error(f"{option_string}: expected it once, found it twice")
        self._is_given = True
        setattr(namespace, self.dest, values)


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line, worded as all others, and that drops no value."""

    def __init__(self, *words: Any, **named: Any) -> None:
        super().__init__(*words, **named)
        for kind in (None, "store"):
            self.register("action", kind, _Once)

    def error(self, message: str) -> NoReturn:
        for theirs, ours in _SAID:
            message = re.sub(theirs, ours, message)
        self.exit(EXIT_BAD_INPUT, f"{self.prog}: {word(message, LONGEST_COMPLAINT)} (try '{self.prog} --help')\n")


# All matrices here are small: more threads in the algebra library would only wait for each other.
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def main(arguments: list[str]) -> int:
    """Carry out one command line; give its exit status. Help and wrong use leave by SystemExit, as argparse does."""
    if not arguments or arguments[0] not in VERBS:
        return _without_verb(arguments)
    verb = arguments[0]
    parser, run = command(verb)
    given = parser.parse_args(arguments[1:])
    with written_files() as written:
        try:
            status = run(given)
        finally:
            _name_written(written)
    return status


def command(verb: str) -> tuple[argparse.ArgumentParser, Callable[[argparse.Namespace], int]]:
    """The parser of a verb, and what carries it out."""
    module: Any = (importlib.import_module("logger.commands.options").QuestionVerb(f"logger.api.{ASKED[verb]}")
                   if verb in ASKED else importlib.import_module(f"logger.commands.{verb.replace('-', '_')}"))
    parser = _Parser(prog=f"ridelog {verb}", description=module.__doc__, formatter_class=_Help, allow_abbrev=False)
    module.add_arguments(parser)
    return parser, module.run


def _name_written(paths: list[Path]) -> None:
    """Say what was written, on stderr: stdout holds the result."""
    by_folder: dict[Path, list[Path]] = {}
    for path in paths:
        by_folder.setdefault(path.parent, []).append(path)
    for folder, files in by_folder.items():
        many = len(files) > MOST_NAMED
        for words in [f"{len(files)} files in {folder}"] if many else files:
            print(printable(f"Wrote {words}"), file=sys.stderr)


def run() -> NoReturn:
    """The console script."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
    sys.stdout, sys.stderr = cast(TextIO, _Screen(sys.stdout, "\n\t")), cast(TextIO, _Screen(sys.stderr, "\n\t\r"))
    try:
        status = main(sys.argv[1:])
        sys.stdout.flush()
    except RidelogError as error:
        status = _complain(str(error), error.exit_status)
    except DriverError as error:
        status = _complain(str(error), EXIT_BAD_INPUT)
    except BrokenPipeError:
        # Nobody reads on. Python would complain once more when it flushes at exit, so stdout goes nowhere now.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = EXIT_PIPE_CLOSED
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        status = _complain(f"{place}{error.strerror or error}", EXIT_BAD_INPUT)
    except MemoryError:
        status = _complain("not enough memory for so much data; cut it into shorter files", EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        status = EXIT_INTERRUPTED
    sys.exit(status)


def _complain(message: str, status: int) -> int:
    print("ridelog: " + word(" ".join(message.split()), LONGEST_COMPLAINT), file=sys.stderr)
    return status


class _Screen:
    """Where commands print: no word, whoever wrote it, moves the cursor, turns the direction of writing or hides.
    ``keep``: control characters of our own."""

    def __init__(self, stream: TextIO, keep: str) -> None:
        self._stream, self._keep = stream, keep

    def write(self, text: str) -> int:
        """Write what can be seen."""
        return self._stream.write(printable(text, self._keep))

    def writelines(self, lines: Iterable[str]) -> None:
        """The same of many."""
        self._stream.writelines(printable(line, self._keep) for line in lines)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _without_verb(arguments: list[str]) -> int:
    width = max(map(len, VERBS)) + 2
    verbs = "\n".join(f"  {verb:{width}}{meaning}" for verb, meaning in VERBS.items())
    parser = _Parser(
        prog="ridelog", usage="ridelog COMMAND [OPTIONS]", formatter_class=argparse.RawDescriptionHelpFormatter,
        description="How rough is the road, and how does it feel to the people inside?", add_help=True,
        epilog=f"commands:\n{verbs}\n\n'ridelog COMMAND --help' explains one of them.", allow_abbrev=False)
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    parser.add_argument("command", nargs="?", help=argparse.SUPPRESS)
    options, rest = parser.parse_known_args(arguments)  # of a command that nobody knows the rest is its own
    if rest and options.command is None:
        return parser.error(f"unrecognized arguments: {' '.join(rest)}")
    if options.version:
        from logger.shipped import version  # reads the installation's records, which takes a while

        print(f"ridelog {version()}")
        return 0
    word = options.command
    found = "" if word is None else f", found {word!r}{did_you_mean(word, VERBS)}"
    return parser.error(f"expected a command out of {', '.join(VERBS)}{found}")
