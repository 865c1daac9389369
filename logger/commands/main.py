"""The ``ridelog`` command: one verb per file of this folder (- is _ there), imported only when it is asked for.

A fault that is expected, whatever the verb, becomes one line on stderr and an exit status: 1 the check that was
asked for failed, 2 wrong use or bad input, 130 and 141 as shells name an interrupt and a closed pipe.
"""

import argparse
import importlib
import os
import re
import sys
import textwrap
from codecs import register_error
from collections.abc import Callable, Iterable, Iterator
from io import TextIOWrapper
from itertools import takewhile
from pathlib import Path
from typing import Any, NoReturn, TextIO, cast

from drivers.errors import DriverError
from logger.errors import EXIT_BAD_INPUT, RidelogError, did_you_mean
from logger.files import written_files
from logger.printable import LONGEST_COMPLAINT, in_plain_signs, printable, word

GROUPS = {
    "Try it": {
        "demo": "play a simulated drive through the service and show its map; needs no hardware",
    },
    "In the car": {
        "install": "set up the logging service on this machine; --dry-run shows every step",
        "run": "log drives in this terminal: the service itself, as systemd starts it",
        "status": "say what the service is doing, and what to do if something is wrong",
        "export": "copy finished logs to a USB stick",
        "verify": "check logs, recordings and sticks: is anything damaged or missing?",
        "replay": "play a recorded drive through the service again: what do other settings give?",
        "uninstall": "remove the service; logs, changed settings and the user stay",
        "learn-car": "find a car's springs and dampers from ordinary drives: what car is this?",
        "capture": "record the raw bytes of a serial port: what does an unknown sensor send?",
    },
    "Roads, from logs": {
        "report": "draw logs as one web page: where is the road rough?",
        "sections": "give IRI and condition by section of 0.1 mi or any length, as agencies report them",
        "passes": "combine repeated drives: how rough is each place, and what changed?",
        "fleet": "combine many cars over years: which roads became worse, which cars read too high?",
        "convert": "write logs as GeoJSON, GeoPackage, GPX, KML, Parquet or CSV for other programs",
    },
    "Profiles, rides and vibrations": {
        "iri": "compute the exact IRI of a measured profile",
        "road": "make a random road of ISO 8608, or classify a measured one",
        "comfort": "rate the ride of an acceleration record by ISO 2631-1",
        "estimate": "estimate IRI and profile of the road from one drive's acceleration",
        "calibrate": "compute how strongly a vehicle shakes on roads of known IRI, per speed",
        "modes": "find natural frequencies, damping ratios and mode shapes",
    },
    "Your vehicle's model": {
        "extract": "make runs for the lab from recordings of the box or a phone",
        "simulate": "compute what a vehicle's accelerometer records on a road",
        "identify": "fit masses, springs and dampers to runs: how large are they, how certain?",
        "compare": "measure how far a model is off, where, and what kind of physics it lacks",
        "diagnose": "find which physical effect a model lacks: how certain, and what else could it be?",
        "add-effect": "fit a physical effect, add it to a vehicle and show how much the error falls",
        "learn": "fit a force characteristic from runs that no known effect explains",
        "plan": "predict before you drive: which effects would drives show and distinguish?",
        "lab": "compare, diagnose and add effects until nothing is missing; write a page of it",
    },
    "Proof and hardware": {
        "study": "recompute a published table or figure: does it agree?",
        "hil": "play a recorded drive into serial ports and check the log of the running service",
        "fixed-point": "write the filters as C headers for integer arithmetic",
    },
}
"""Verbs by what a person is about to do; each line begins with a verb and says which question it answers."""
VERBS = {verb: meaning for group in GROUPS.values() for verb, meaning in group.items()}
ASKED = {
    "learn-car": "api.drive_questions:LEARN_CAR",
    "identify": "api.identify.question:VERB",
    "compare": "api.lab.question:COMPARE",
    "diagnose": "api.lab.question:DIAGNOSE",
    "add-effect": "api.lab.question:ADD_EFFECT",
    "learn": "api.lab.question:LEARN",
    "plan": "api.lab.question:PLAN",
    "convert": "api.log_questions:CONVERT",
    "fleet": "api.log_questions:FLEET",
    "sections": "api.log_questions:SECTIONS",
    "passes": "api.log_questions:PASSES",
    "iri": "api.drive_questions:EXACT_IRI",
    "estimate": "api.drive_questions:ESTIMATE",
    "modes": "api.drive_questions:MODES",
    "comfort": "api.drive_questions:COMFORT",
    "calibrate": "api.drive_questions:CALIBRATE",
    "simulate": "api.drive_questions:SIMULATE",
    "uninstall": "commands.install:UNINSTALL",
    "fixed-point": "api.fixed_point:FIXED_POINT",
}
"""Verbs whose questions stand elsewhere than in a module of this folder, and where."""
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
    (r"unrecognized arguments: (.*)", r"expected no \1"),
    (r"argument (\S+): invalid float value: '(.*)'", r"\1 \2: expected a number"),
    (r"argument (\S+): invalid int value: '(.*)'", r"\1 \2: expected a whole number"),
    (r"argument \S+\|\S+: invalid choice: '(.*)' \(choose from (.*)\)", r"expected one of \2, found '\1'"),
    (r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)", r"\1 \2: expected one of \3"),
    (r"the following arguments are required: (.*)", r"expected \1"),
    (r"one of the arguments (\S+) is required", r"expected \1"),
    (r"argument (\S+): not allowed with argument (\S+)", r"\1: expected no \2 with it"),
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

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse; an option that there is not is named before anything else, as the value behind it would be taken
        for a file."""
        known = [*self._options()]
        names = (one.partition("=")[0] for one in takewhile("--".__ne__, args or ()) if one.startswith("--"))
        if wrong := next((one for one in names if one not in known), None):
            self.error(f"there is no option {wrong}{did_you_mean(wrong, known)}")
        return super().parse_args(args, namespace)

    def _options(self) -> Iterator[str]:
        yield from self._option_string_actions
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                for parser in action.choices.values():
                    yield from parser._option_string_actions

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
    place, _, name = ASKED.get(verb, f"commands.{verb}:VERB").partition(":")
    module: Any = importlib.import_module(f"logger.{place}")
    if hasattr(module, name):
        module = importlib.import_module("logger.commands.options").QuestionVerb(getattr(module, name))
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


_LOOP = "Symlink loop from "
_NOT_THAT: dict[type[OSError], str] = {FileExistsError: "expected a folder, found a file",
                                       IsADirectoryError: "expected a file, found a folder"}


def run() -> NoReturn:
    """The console script."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
    register_error("plain signs", in_plain_signs)
    for stream in (sys.stdout, sys.stderr):
        cast(TextIOWrapper, stream).reconfigure(errors="plain signs")
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
        status = _complain(f"{place}{_NOT_THAT.get(type(error), error.strerror or error)}", EXIT_BAD_INPUT)
    except RuntimeError as error:  # pathlib before Python 3.13
        if not (place := str(error)).startswith(_LOOP):
            raise
        status = _complain(f"{place.removeprefix(_LOOP)}: expected a file or a folder, found a loop of symbolic links",
                           EXIT_BAD_INPUT)
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
    verbs = "\n\n".join("\n".join([f"{title}:", *(f"  {verb:{width}}{meaning}" for verb, meaning in group.items())])
                        for title, group in GROUPS.items())
    parser = _Parser(
        prog="ridelog", usage="ridelog COMMAND [OPTIONS]", formatter_class=argparse.RawDescriptionHelpFormatter,
        description="How rough is the road, and how does it feel to the people inside?", add_help=True,
        epilog=f"{verbs}\n\n'ridelog COMMAND --help' explains one command, with examples.", allow_abbrev=False)
    parser.add_argument("--version", action="store_true", help="print the version and exit")
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
    return parser.error(f"expected a command{found}")
