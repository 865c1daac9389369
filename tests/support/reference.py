"""The pages below ``docs/reference``, out of what the program declares: ``python -m tests.support.reference``."""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import ridelog
from drivers.wire_contents import ADVICE
from logger.commands.main import GROUPS, command
from logger.plugins import catalogue
from logger.report.page import FLAG_MEANINGS
from logger.store.formats.effect_file import shipped_effects
from logger.store.log.row_format import COLUMN_MEANINGS
from logger.vehicle.effect import Effect

from . import study_table

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "reference"
MADE = "Made by `python -m tests.support.reference` from the program itself."


def commands() -> str:
    """Each command: what it does, examples, arguments and options."""
    parts = ["# Commands", MADE, "Every command prints this with `--help`. Exit status 0: done; 1: the check that you "
             "asked for failed; 2: wrong use or bad input, in one line that says what was expected."]
    for title, group in GROUPS.items():
        parts.append(f"## {title}")
        for verb, meaning in group.items():
            parts += [f"### ridelog {verb}", f"{meaning[0].upper()}{meaning[1:]}{'.' * (meaning[-1] != '?')}"]
            for parser in parsers(command(verb)[0]):
                if parser.prog != f"ridelog {verb}":
                    parts.append(f"#### {parser.prog}")
                parts += [_block(parser.description or ""), _table(("argument", "meaning"), _arguments(parser))]
    return _page(parts)


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """A verb's parser, and those of the verbs below it."""
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name in action.choices:
                yield from parsers(action.choices[name])


def _arguments(parser: argparse.ArgumentParser) -> Iterator[tuple[str, str]]:
    for action in parser._actions:
        if action.help == argparse.SUPPRESS or isinstance(action, argparse._HelpAction):
            continue
        kind = "|".join(map(str, action.choices)) if action.choices and not action.metavar else action.metavar
        if action.option_strings:
            name = ", ".join(action.option_strings) + (f" {kind or action.dest.upper()}" if action.nargs != 0 else "")
        else:
            name = str(kind or action.dest)
        yield f"`{name}`", " ".join((action.help or "").split())


def log_rows() -> str:
    """Columns and flags of a log."""
    return _page(["# Columns and flags of a log", MADE,
                  "What a row cannot know is empty, and `flags` says why. [Read a log](../reading-a-log.md) explains "
                  "the numbers.",
                  "## Columns", _table(("column", "meaning"), _named(COLUMN_MEANINGS)),
                  "## Flags", _table(("flag", "meaning"), _named(FLAG_MEANINGS))])


def effects() -> str:
    """The physical effects that come with ridelog."""
    known = shipped_effects()
    return _page(["# Physical effects", MADE,
                  "[Physical effects](../effects.md) says how to use them. Usual values and bounds are those of cars.",
                  effect_table(known.values()), *(part for one in known.values() for part in _effect(one))])


def effect_table(known: Iterable[Effect]) -> str:
    """Each effect with its parameters."""
    return _table(("effect", "what it is", "parameters"), (
        (f"`{one.name}`", one.title, ", ".join(f"`{each.name}`" for each in one.parameters) or "none")
        for one in known))


def _effect(one: Effect) -> list[str]:
    numbers = [(f"`{each.name}`", f"{each.start:g}".replace("e+0", "e"), each.allowed, each.meaning)
               for each in one.parameters]
    return [f"## {one.name}", f"{one.title[0].upper()}{one.title[1:]}.",
            *([_table(("parameter", "usual", "allowed", "meaning"), numbers)] if numbers else []),
            f"- What it leaves in a record: {one.signature}.\n- To see it: {one.shown_by}.\n- Source: {one.source}."]


def families() -> str:
    """The families of laws that ``ridelog learn`` tries."""
    known = catalogue("logger.lab.laws.families", "FAMILY")
    return _page(["# Families of force characteristics", MADE,
                  "[Learn a force characteristic](../learn.md) says when `ridelog learn` tries them.",
                  _table(("family", "what it is", "the drive that shows it"),
                         ((f"`{name}`", one.title, one.shown_by) for name, one in known.items()))])


def wires() -> str:
    """What may arrive on a wire in place of readings, and what to do."""
    by_words: dict[str, list[str]] = {}
    for (port, kind), words in ADVICE.items():
        by_words.setdefault(_without_places(words), []).append(f"{port}: {kind.replace('_', ' ')}")
    rows = [("; ".join(found), words) for words, found in by_words.items()]
    return _page(["# What arrives on a wire", MADE,
                  "`ridelog status` looks at the bytes of a port that gives no readings, recognises what they are, and "
                  "says what to do. It names what it found where three dots stand here.",
                  _table(("port and what arrives", "what it says"), rows)])


def python() -> str:
    """Functions and classes of ``import ridelog``."""
    rows = []
    for name in sorted(ridelog.__all__, key=str.lower):
        one = getattr(ridelog, name)
        said = (inspect.getdoc(one) or "").partition("\n\n")[0]
        shown = f"{name}{_signature(one)}" if callable(one) and not inspect.isclass(one) else name
        rows.append((f"`{shown}`", " ".join(said.split())))
    return _page(["# Python", MADE, "`help(ridelog.NAME)` has all of it. [In Python](../notebook.md) goes through the "
                  "lab.", _table(("name", "what it is"), rows)])


def _signature(one: Callable[..., object]) -> str:
    named = inspect.signature(one).parameters.values()
    return f"({', '.join(each.name if each.default is each.empty else f'{each.name}=...' for each in named)})"


PAGES: dict[str, Callable[[], str]] = {
    "commands": commands, "log": log_rows, "effects": effects, "families": families, "wires": wires, "python": python,
    "studies": study_table.page}


def _page(parts: Iterable[str]) -> str:
    return "\n\n".join(parts) + "\n"


def _named(meanings: dict[str, str]) -> Iterator[tuple[str, str]]:
    return ((f"`{name}`", meaning) for name, meaning in meanings.items())


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _block(text: str) -> str:
    return f"```text\n{text.strip()}\n```"


def _without_places(words: str) -> str:
    return re.sub(r"\{\w+\}", "...", words.replace("{shown}", ""))


def main() -> None:
    """Write the pages."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, made in PAGES.items():
        (FOLDER / f"{name}.md").write_text(made(), "utf-8")


if __name__ == "__main__":
    main()
