"""The lab's whole loop at the terminal: compare, diagnose, add what is missing, compare again.

  ridelog lab --vehicle mycar.yaml run1 run2
  ridelog lab --vehicle mycar.yaml run1 run2 --yes --out lab

Before an effect is added it asks: yes, no, or the name of another one. DIR gets a vehicle file for each step and
story.html, the page that tells all of it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from logger.commands.add_effect import asked_for
from logger.commands.diagnose import diagnosed
from logger.commands.lab_model import add_bench_arguments, bench, check_out, progress
from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text
from logger.report.text_layout import paragraphs

if TYPE_CHECKING:
    from logger.api.bench import Bench
    from logger.lab.compare import Comparison
    from logger.lab.diagnosis import Diagnosis
    from logger.lab.session import Round, Story
    from logger.store.formats.vehicle_file import Model
    from logger.vehicle.effect import Chosen

STORY = "story.html"
_MOST_ROUNDS = 6
_SHOWN = 5

Say = Callable[[Iterable[str]], None]
Ask = Callable[["Bench", str], str | None]
"""Which effect to add where one was found missing: its name or another's, or None for none."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog lab``."""
    add_bench_arguments(parser)
    parser.add_argument("--out", type=Path, default=Path("ridelog-lab"), metavar="DIR",
                        help="folder for the vehicle files and the page (default: ridelog-lab)")
    parser.add_argument("--yes", action="store_true", help="add what is found missing without asking")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog lab``."""
    from logger.report.session_text import as_json

    given = bench(args, searches="ridelog lab")
    asks = not (args.yes or args.json) and sys.stdin.isatty()
    ask = _asked if asks else take if args.yes or args.json else _taking()
    story = walk(given, args.out, ask, silent if args.json else say)
    if args.json:
        print(json.dumps(as_json(story) | {"story": str(args.out / STORY)}, allow_nan=False))
    return EXIT_DONE


def walk(given: Bench, out: Path, ask: Ask, tell: Say, explained: Mapping[str, str] | None = None) -> Story:
    """Go through the loop; write the vehicle files and the page into ``out``.

    explained    what to tell of compare, diagnose, add and again, beside what they find
    """
    from logger.lab.session import Story
    from logger.report.lab_text import addition_lines, diagnosis_lines
    from logger.report.session_text import ending
    from logger.report.story_page import page

    why = explained or {}
    try:
        out.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise BadInput(f"--out {out}: expected a folder") from None
    for file in (out / STORY, *(_vehicle_file(out, number + 1) for number in range(_MOST_ROUNDS))):
        check_out(file, [Path(run.name) for run in given.runs.runs], given.files_read)
    tell(_chapter("Compare", why.get("compare")))
    first = _compared(given)
    tell(_comparison_lines(first))
    diagnoses: list[Diagnosis] = []
    rounds: list[Round] = []
    refused: list[str] = []
    going = True
    while going and len(rounds) < _MOST_ROUNDS:
        going = False
        tell(_chapter("Diagnose", why.get("diagnose")))
        diagnoses.append(diagnosed(given, frozenset(refused)))
        tell(diagnosis_lines(diagnoses[-1], _SHOWN))
        for one in diagnoses[-1].missing:
            if len(rounds) == _MOST_ROUNDS:
                break
            wanted = ask(given, one.effect.name)
            if wanted is None:
                refused.append(one.effect.name)
                continue
            tell(_chapter(f"Add {wanted}", why.get("add")))
            same = wanted == one.effect.name
            made, model = _round(given, one if same else _searched(given, wanted), out, len(rounds) + 1)
            rounds.append(made)
            tell([*addition_lines(rounds[-1].addition), "", f"Vehicle: {rounds[-1].file}"])
            tell(_chapter("Compare again", why.get("again")))
            tell(_comparison_lines(rounds[-1].comparison))
            given = replace(given, model=model)
            if not same:  # what is missing beside another effect is to be found anew
                going = True
                break
    story = Story(first, tuple(diagnoses), tuple(rounds), tuple(refused))
    write_text(out / STORY, page(story))
    tell(_chapter("The end", why.get("end")))
    tell([paragraphs(ending(story)), "", f"The whole story as a page: {out / STORY}"])
    return story


def _round(given: Bench, start: Chosen, out: Path, number: int) -> tuple[Round, Model]:
    """Add an effect, write the vehicle and compare it; the model with it."""
    from logger.lab.session import Round
    from logger.store.formats.vehicle_file import write_model

    with progress() as tell:
        addition = given.added(start, len(start.effect.trials()), tell)
    model = given.model_with(addition)
    file = _vehicle_file(out, number)
    write_model(file, model)
    return Round(addition, _compared(replace(given, model=model)), str(file)), model


def _vehicle_file(out: Path, number: int) -> Path:
    return out / f"vehicle-{number}.yaml"


def _searched(given: Bench, name: str) -> Chosen:
    with progress() as tell:
        return given.searched(given.effects[name], {}, tell)


def _compared(given: Bench) -> Comparison:
    with progress() as tell:
        tell("comparing")
        return given.compared()


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
            print("Nobody is at a terminal to be asked: what is found missing is added (as with --yes).",
                  file=sys.stderr)
        said = True
        return take(given, name)

    return ask


def _asked(given: Bench, name: str) -> str | None:
    """What the user says."""
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
            return asked_for(answer, given)[0].name
        except BadInput as error:
            print(error)


def say(lines: Iterable[str]) -> None:
    """Print lines."""
    print("\n".join(lines))


def silent(_lines: Iterable[str]) -> None:
    """Print nothing."""


def _chapter(title: str, explained: str | None) -> list[str]:
    return ["", f"=== {title} ===", *([paragraphs([explained])] if explained else []), ""]


def _comparison_lines(found: Comparison) -> list[str]:
    from logger.report.comparison_text import conclusion, evidence, headline

    return [paragraphs(headline(found)), "", "After the refit:", paragraphs(evidence(found), "- "), "",
            paragraphs([conclusion(found).partition(" Next: ")[0]])]
