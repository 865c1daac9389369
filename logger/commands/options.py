"""Verbs that are declared by their questions (``logger.question``): arguments, files to write, what is printed.

Beside them: pages and pictures of results with charts, and progress on the screen.
"""

from __future__ import annotations

import argparse
import importlib
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, get_args

from logger.errors import BadInput, CheckFailed
from logger.files import together, write_file
from logger.printable import printable, word
from logger.question import (
    Argument,
    Asking,
    Hidden,
    InPython,
    LongQuestion,
    Option,
    Out,
    Question,
    Several,
    Switches,
    Verb,
    Verbs,
    WrongOption,
    askings,
    help_of,
)
from logger.report.quantities import WIDTH
from logger.units import LENGTH_UNITS_M

if TYPE_CHECKING:
    from logger.api.shown import CommandResult
    from logger.chart_data import Chart

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # of mallopt(3), in glibc's malloc.h


class QuestionVerb:
    """A verb that is declared by its question, or verbs below it by theirs, as the modules of this folder declare
    one."""

    def __init__(self, verb: Verb | Verbs) -> None:
        self._verb = verb
        self.__doc__ = self._verb.words if isinstance(self._verb, Verbs) else help_of(self._verb.question)

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare its arguments."""
        if isinstance(self._verb, Verbs):
            add_verbs(parser, "below", self._verb.below)
        else:
            declare(parser, self._verb)

    def run(self, args: argparse.Namespace) -> int:
        """Carry it out."""
        return run(self._verb.below[args.below][0] if isinstance(self._verb, Verbs) else self._verb, args)


def declare(parser: argparse.ArgumentParser, verb: Verb) -> None:
    """The arguments of a verb: its question's, its files', and ``--json``."""
    for one in _options_of(verb.question):
        _add(parser, one)
    for out in verb.outs:
        parser.add_argument(out.flag, type=Path, metavar=out.metavar, required=out.required, help=out.help,
                            **_many(out.many))
    if verb.has_json:
        parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def add_verbs(parser: argparse.ArgumentParser, dest: str, verbs: Mapping[str, tuple[Verb, str]]
              ) -> dict[str, argparse.ArgumentParser]:
    """Verbs below a verb, by name, each with what it does; their parsers."""
    below, found = parser.add_subparsers(dest=dest, required=True, metavar="|".join(verbs)), {}
    for name, (verb, words) in verbs.items():
        found[name] = below.add_parser(name, help=words, allow_abbrev=False, description=help_of(verb.question),
                                       formatter_class=parser.formatter_class)
        declare(found[name], verb)
    return found


def _options_of(question: type[Any]) -> list[Asking]:
    """The fields that the terminal asks for."""
    return [one for one in askings(question) if not isinstance(one.option, InPython)]


_IN_PYTHON = re.compile(r"; in Python a model as well|\. In Python: .*$| \(in Python [^)]*\)|at a terminal (?=as )")


def _help(one: Asking) -> str:
    """What an option is, without what is of no use at the terminal."""
    return argparse.SUPPRESS if isinstance(one.option, Hidden) else _IN_PYTHON.sub("", one.help)


def _many(repeats: bool) -> dict[str, Any]:
    return {"action": "append"} if repeats else {}


def _add(parser: argparse.ArgumentParser, one: Asking) -> None:
    option = one.option
    if isinstance(option, Switches):
        for value, (name, words) in (option.by_value or {}).items():
            parser.add_argument(f"--{name}", dest=f"{one.name}.{value}", action="store_true", help=words)
    elif isinstance(option, Argument):
        is_optional = one.default is not MISSING
        nargs = ("*" if is_optional else "+") if option.many else "?" if is_optional else None
        parser.add_argument(one.name, nargs=nargs, metavar=option.metavar, help=_help(one),
                            type=_reader(str(option.metavar), option, one.kind))
    elif one.default is False:
        parser.add_argument(one.flag, dest=one.name, action="store_true", help=_help(one))
    else:
        parser.add_argument(one.flag, dest=one.name, required=one.default is MISSING, help=_help(one),
                            metavar=option.metavar or "|".join(option.choices),
                            **_many(option.many is not None and not isinstance(option, Several)),
                            **({"nargs": "+"} if isinstance(option, Several) else
                               {} if option.bare is None else {"nargs": "?", "const": option.bare}),
                            type=_reader(one.flag, option, one.kind))


def _reader(flag: str, option: Option, kind: Any) -> Callable[[str], Any]:
    """What makes a value of a text; a complaint names the option and the text."""
    kinds = [one for one in get_args(kind) if one is not NoneType] or [kind]
    make: Callable[[str], Any] = _number(option.read or kinds[0], option) or option.read or str
    if make in (Path, str):
        return make

    def read(text: str) -> Any:
        try:
            return make(text)
        except ValueError as error:
            raise BadInput(f"{flag} {text}: {error}") from None

    return read


def _number(kind: Any, option: Option) -> Callable[[str], float] | None:
    if kind not in (int, float):
        return None
    unit = option.range.unit if option.range else ""
    in_metres = kind is float and option.metavar == "M"

    def number(text: str) -> float:
        found = re.fullmatch(r"([0-9.]+)(m|km|mi|ft)", text) if in_metres else None
        try:
            if found:
                return float(found[1]) * LENGTH_UNITS_M[found[2]]
            return float(text) if kind is float else int(text)
        except ValueError:
            if in_metres:
                raise ValueError("expected a length in m, or with m, km, mi or ft after it") from None
            without = ", without its unit" if text[:1].isdigit() and text[-1:].isalpha() else ""
            what = ("a number" if kind is float else "a whole number") + f" in {unit}" * bool(unit)
            raise ValueError(f"expected {what}{without}") from None

    return number


def asked(verb: Verb, args: argparse.Namespace) -> Any:
    """The question of a command line."""
    values: dict[str, Any] = {}
    for one in _options_of(verb.question):
        if isinstance(one.option, Switches):
            given: Any = _switched(one, args)
        else:
            given = getattr(args, one.name)
            given = one.option.many(given) if one.option.many and given is not None else given
        if given is not None:
            values[one.name] = given
    if issubclass(verb.question, LongQuestion):
        values |= {"progress": warned if verb.question.stays else on_screen(), "warn": warned}
    return verb.question(**values)


def _switched(one: Asking, args: argparse.Namespace) -> str | None:
    """The value whose switch was given. BadInput for two."""
    switches = one.option.by_value if isinstance(one.option, Switches) else None
    on = [(value, name) for value, (name, _) in (switches or {}).items() if getattr(args, f"{one.name}.{value}")]
    if len(on) > 1:
        raise BadInput(f"--{on[0][1]}: expected no --{on[1][1]} with it")
    return on[0][0] if on else None


@contextmanager
def respelled(question: type[Question]) -> Iterator[None]:
    """A complaint about an option has its name at the terminal."""
    flags = {one.name: one.flag for one in askings(question)}
    try:
        yield
    except WrongOption as error:
        raise error.spelled(flags) from None


def keep_freed_memory() -> None:
    """Let the C library keep memory that was freed, for the next arrays: half a gigabyte, and arrays up to 32 MB, which
    is glibc's largest. By itself it returns arrays of a megabyte to the system, which then clears the pages of the next
    ones: a sixth to a fifth of a fit's processor time (measured on 120 s of two drives). All threads keep it in one
    place: with one for each, a diagnosis of four minutes held 530 MB where 380 are enough."""
    import ctypes

    if mallopt := getattr(ctypes.CDLL(None), "mallopt", None):
        mallopt(_TRIM_THRESHOLD, 2**29)
        mallopt(_MMAP_THRESHOLD, 2**25)
        mallopt(_ARENA_MAX, 1)


def run(verb: Verb, args: argparse.Namespace) -> int:
    """Ask what a command line asks, write the files and print the answer; the exit status."""
    keep_freed_memory()
    paths: Mapping[Out, list[Path]] = {one: _paths(args, one) for one in verb.outs}
    try:
        with respelled(verb.question):
            question = asked(verb, args)
            _check_outs(paths, question)
            answers = named(verb.answers)
            found = getattr(answers, "answer", answers)(question)
    except CheckFailed as refusal:
        if not (verb.refusal and args.json):
            raise
        print(json.dumps(named(verb.refusal)(refusal), allow_nan=False))
        print(f"ridelog: {refusal}", file=sys.stderr)
        return refusal.exit_status
    finally:
        wipe()
    with together():
        for out, those in paths.items():
            pictures, others = parted(those) if out.is_drawn else ([], those)
            for path in others:
                found.write(path, out.flag)
            write_result(pictures, found, question.named())
    written = {out.flag: those for out, those in paths.items()}
    if verb.has_json and args.json:
        print(json.dumps(found.as_json(), allow_nan=False))
    elif found.text:
        words = found.next_words(question, written)
        print(found.text, *([f"\n{words}"] if words else []), sep="\n")
    for words in found.remarks(written):
        print(printable(f"ridelog: {question.named()}: {words}"), file=sys.stderr)
    return int(found.exit_status)


def named(place: str) -> Any:
    """What a module and a name in it are: ``logger.api.lab.compare:compared``."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def _paths(args: argparse.Namespace, out: Out) -> list[Path]:
    given = getattr(args, out.flag.lstrip("-").replace("-", "_"))
    return list(given) if out.many and given else [given] if given is not None and not out.many else []


def _check_outs(asked_for: Mapping[Out, list[Path]], question: Question) -> None:
    """BadInput for a file that cannot be written, is read, or has an ending that is not offered."""
    if not any(asked_for.values()):
        return
    from logger.api.shown import check_outs

    read = question.files_read()
    check_outs([(out.flag, path) for out, paths in asked_for.items() for path in paths], read, read)
    # Whatever it ends in, a file that is read is named as such first.
    for out, paths in asked_for.items():
        offered = [*(PICTURES if out.is_drawn else ()), *out.others]
        if wrong := [path for path in paths if path.suffix.lower() not in offered and "*" not in offered]:
            one_of = "one of " * (len(offered) > 1)
            raise BadInput(f"{out.flag} {wrong[0]}: expected a file that ends in {one_of}{', '.join(offered)}")
    question.check_written({out.flag: paths for out, paths in asked_for.items()})


PAGE = ".html"
PICTURES = (PAGE, ".png", ".svg", ".pdf")


def is_picture(path: Path) -> bool:
    """Whether a file that was asked for is one."""
    return path.suffix.lower() in PICTURES


def parted(asked: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Of files that ``--out`` was given: the pictures, and the others."""
    return [path for path in asked if is_picture(path)], [path for path in asked if not is_picture(path)]


def write_result(paths: Sequence[Path], found: CommandResult, of: str) -> None:
    """Write the page and pictures of a result that were asked for, all of them or none; ``of``: what it is a result of,
    such as a file."""
    charts = found.charts() if paths else ()
    made = [found.as_page(of).encode() if path.suffix.lower() == PAGE else _drawn(path, charts) for path in paths]
    with together():
        for path, content in zip(paths, made, strict=True):
            write_file(path, [content])


def _drawn(path: Path, charts: Sequence[Chart]) -> bytes:
    if not charts:
        raise BadInput(f"--out {path}: this result has no pictures; {PAGE} holds its text")
    from logger.report.charts import drawn

    return drawn(charts, path)


def warned(words: str) -> None:
    """Say on stderr that it will take long."""
    print(words, file=sys.stderr, flush=True)


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
