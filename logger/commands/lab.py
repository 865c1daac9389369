"""``ridelog lab`` at a terminal: the loop of ``logger.api.lab.loop``, which asks before it adds."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.lab.question import LAB, LabLoopQuestion, LabQuestion
from logger.commands.options import asked, declare, help_of, keep_freed_memory, progress, respelled
from logger.errors import EXIT_DONE, BadInput
from logger.printable import silent

if TYPE_CHECKING:
    from logger.api.lab.bench import Bench
    from logger.api.lab.loop import Ask, Explain, LabStory, Learns, Say

__doc__ = help_of(LabLoopQuestion)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog lab``."""
    declare(parser, LAB)
    parser.add_argument("--yes", action="store_true",
                        help="without asking, add what is found missing, and learn a law where no effect explains it")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog lab``."""
    from logger.api.lab.bench import bench_with

    keep_freed_memory()
    with respelled(LabLoopQuestion):
        question = asked(LAB, args)
        given = bench_with(question, "ridelog lab")
    asks = not (args.yes or args.json) and sys.stdin.isatty()
    ask = _asking(question) if asks else take if args.yes or args.json else _taking()
    story = walk(given, Path(question.out), ask, silent if args.json else say,
                 learns=_wants_a_law if asks else lambda: True)
    if args.json:
        print(json.dumps(story.as_json(), allow_nan=False))
    return EXIT_DONE


def walk(given: Bench, out: Path, ask: Ask, notify: Say, explain: Explain = lambda *_: "",
         learns: Learns = lambda: True) -> LabStory:
    """Go through the loop, as ``loop.walk``, with its progress on the screen. BadInput as ``make_ready``."""
    from logger.api.lab import loop

    loop.make_ready(given, out, "--out")
    return loop.walk(given, out, ask, notify, progress, explain, learns)


# --- at the terminal ---


def take(_given: Bench, name: str) -> str:
    """Whatever is missing."""
    return name


def _taking() -> Ask:
    """As ``take``, and says so the first time: not before, where bad input may still be all that there is to say."""
    said = False

    def ask(given: Bench, name: str) -> str:
        nonlocal said
        if not said:
            print("There is no terminal to ask at: ridelog adds what it finds missing (as with --yes).",
                  file=sys.stderr)
        said = True
        return take(given, name)

    return ask


def _asking(question: LabQuestion) -> Ask:
    return lambda given, name: _asked(given, name, question)


def _asked(given: Bench, name: str, question: LabQuestion) -> str | None:
    """What the user says."""
    from logger.api.lab.compare import asked_for

    while True:
        try:
            answer = input(f"\nAdd {name}? yes, no, or the name of another effect: ").strip()
        except EOFError:
            return None
        if answer.lower() in ("", "y", "yes"):
            return name
        if answer.lower() in ("n", "no"):
            return None
        if answer not in given.effects:
            print(f"Expected yes, no, or one of {', '.join(given.effects)}.")
            continue
        try:
            return asked_for(answer, given, question)[0].name
        except BadInput as error:
            print(error)


def _wants_a_law() -> bool:
    """What the user says."""
    while True:
        try:
            answer = input("\nNo known effect explains it all. Learn a law from the data (it takes minutes)? "
                           "yes or no: ").strip().lower()
        except EOFError:
            return False
        if answer in ("", "y", "yes", "n", "no"):
            return answer not in ("n", "no")
        print("Expected yes or no.")


def say(lines: Iterable[str]) -> None:
    """Print lines."""
    print("\n".join(lines))
