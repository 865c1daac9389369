"""The lab's whole loop: compare, diagnose, learn a law where no effect explains it, add what is missing, compare."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.bench import Bench, among
from logger.api.diagnosis import Diagnosis, diagnosis_of
from logger.api.lab import (
    AddedEffect,
    Comparison,
    addition_of,
    bench_with,
    comparison_of,
)
from logger.api.lab_questions import LabLoopQuestion
from logger.api.outputs import check_out
from logger.api.question import Notify, function
from logger.api.shown import CommandResult
from logger.api.vehicles import Model, model_of, read_vehicle
from logger.errors import BadInput
from logger.files import make_folder, write_text
from logger.report.text_layout import columns, paragraphs
from logger.store.formats import vehicle_file as vehicle_format

if TYPE_CHECKING:
    from logger.lab import compare, diagnosis
    from logger.lab.selection.add_effect import AddedEffects
    from logger.lab.session import LawSearch, Round, Story
    from logger.report.html import Html
    from logger.vehicle.effect import Chosen

STORY, LAW = "story.html", "law.py"
MOST_ROUNDS = 6
_SHOWN = 5

Say = Callable[[Iterable[str]], None]
Ask = Callable[[Bench, str], str | None]
"""Which effect to add where one was found missing: its name or another's, or None for none."""
Learns = Callable[[], bool]
"""Whether a law is to be learned where no effect explains what is missing."""
Progress = Callable[[], AbstractContextManager[Notify]]
Explain = Callable[[str, str, str], str]
"""What to say under a heading, laid out: of compare, diagnose, learn, add, again or end; with the effect that is
added, and the vehicle file that is read, or written where an effect is added; of learn the law's file."""


@dataclass(frozen=True, eq=False, repr=False)
class LabStory(CommandResult):
    """What the loop came to.

    story                all of it, as the lab has it
    model                with all that was added, as the last file has it
    first                comparison of the model as it was given
    diagnoses            at least one
    additions            effects that were added, in order, and ``comparisons`` with them
    refused              effects that were found missing and not wanted
    law                  file of the law that was learned; None: none was
    error_before         of the model as it was given; ``error_after`` of the last one, refitted
    noise_floor_error    that the sensor's noise alone makes
    steps                models on the way, each with its error on all samples
    page                 the file with all of it
    """

    story: Story
    model: Model
    first: Comparison
    diagnoses: tuple[Diagnosis, ...]
    additions: tuple[AddedEffect, ...]
    comparisons: tuple[Comparison, ...]
    refused: tuple[str, ...]
    law: Path | None
    error_before: float
    error_after: float
    noise_floor_error: float
    steps: tuple[tuple[str, float], ...]
    page: Path

    def figures(self) -> list[Html]:
        """How the error fell."""
        from logger.report.diagnosis_page import falling

        return [falling("How the error fell", self.steps, self.noise_floor_error)]


def story_of(question: LabLoopQuestion) -> LabStory:
    """The answer to ``LabLoopQuestion``, which says what is raised."""
    place, bench = Path(question.out), bench_with(question, None if question.candidates is not None else "ridelog lab")
    bench = replace(bench, effects=among(bench.effects, question.candidates))
    make_ready(bench, place)
    return walk(bench, place, _asking(question.ask), unsaid_lines, lambda: nullcontext(question.progress),
                learns=lambda: question.learns)


lab = function("lab", LabLoopQuestion, story_of)


def _asking(ask: Callable[[str], str | None]) -> Ask:
    def wanted(given: Bench, name: str) -> str | None:
        answer = ask(name)
        if answer is not None and answer != name:
            if answer not in given.effects:
                raise BadInput(f"{answer}: expected one of {', '.join(given.effects)}")
            given.asked_for(answer, {}, answer)
        return answer

    return wanted


def unsaid_lines(_lines: Iterable[str]) -> None:
    """Drop the lines: a loop that prints nothing."""


def make_ready(given: Bench, out: Path, option: str = "") -> None:
    """Make the folder for the files. BadInput where there cannot be one, and for files that are read, or cannot be
    written; ``option``: how the folder was asked for."""
    try:
        make_folder(out)
    except FileExistsError:
        raise BadInput(f"{option} {out}: expected a folder".lstrip()) from None
    for file in (out / STORY, out / LAW, *(_vehicle_file(out, number + 1) for number in range(MOST_ROUNDS))):
        check_out(file, [Path(run.name) for run in given.runs.runs], given.files_read, option)


def unexplained(_chapter: str, _effect: str, _vehicle: str) -> str:
    """No explanation in addition to what is found."""
    return ""


def always() -> bool:
    """A law is to be learned."""
    return True


def walk(given: Bench, out: Path, ask: Ask, notify: Say, progress: Progress, explain: Explain = unexplained,
         learns: Learns = always) -> LabStory:
    """Go through the loop; write the vehicle files and the page into ``out``.

    learns      asked once, where no effect explains what is missing
    notify        called with what was found
    progress    context around what takes long, called with what is under way
    explain     what to say of each step in addition to what it finds
    """
    from logger.report.session_text import as_json, ending, steps
    from logger.report.story_page import page

    story, model = go_through(given, out, ask, notify, progress, explain, learns)
    write_text(out / STORY, page(story))
    notify(chapter("The end", explain("end", "", "")))
    notify([paragraphs(ending(story)), "", f"The whole story as a page: {out / STORY}"])
    rows = [(words, f"{error:.3f}") for words, error in steps(story)]
    summary = as_json(story) | {"story": str(out / STORY)}
    return LabStory(
        "\n".join([*columns([("Model", "Error"), *rows]), "", paragraphs(ending(story))]), summary, story,
        model_of(model), comparison_of(story.first), tuple(diagnosis_of(one, given) for one in story.diagnoses),
        tuple(addition_of(one.addition, read_vehicle(one.file)) for one in story.rounds),
        tuple(comparison_of(one.comparison) for one in story.rounds), story.refused,
        Path(story.law.file) if story.law and story.law.file else None, summary["error_before"], summary["error_after"],
        story.floor, tuple(steps(story)), out / STORY)


def go_through(given: Bench, out: Path, ask: Ask, notify: Say, progress: Progress, explain: Explain,
               learns: Learns = always) -> tuple[Story, vehicle_format.Model]:
    """The same without its end and its page."""
    from logger.lab.session import Story
    from logger.report.lab_text import diagnosis_lines

    word = given.word
    notify(chapter("Compare", explain("compare", "", word)))
    first = _compared(given, progress)
    notify(_comparison_lines(first))
    diagnoses: list[diagnosis.Diagnosis] = []
    rounds: list[Round] = []
    refused: list[str] = []
    law: LawSearch | None = None
    step = _Step(given, out, notify, progress, explain)
    going = asked = True
    while going and len(rounds) < MOST_ROUNDS:
        going = False
        notify(chapter("Diagnose", explain("diagnose", "", word)))
        diagnoses.append(_diagnosed(step.given, frozenset(refused), progress))
        notify(diagnosis_lines(diagnoses[-1], _SHOWN))
        if diagnoses[-1].exceeds_noise and asked:
            asked = False
            if learns():
                step, law, made = step.learned()
                rounds += made
                if made:
                    word, going = made[-1].file, True
                    continue
        for one in diagnoses[-1].missing:
            if len(rounds) == MOST_ROUNDS:
                break
            wanted = ask(step.given, one.effect.name)
            if wanted is None:
                refused.append(one.effect.name)
                continue
            same = wanted == one.effect.name
            step, made_now = step.added(wanted, one if same else None, len(rounds) + 1)
            rounds.append(made_now)
            word = made_now.file
            if not same:  # with another effect, what is missing is searched again
                going = True
                break
    return Story(first, tuple(diagnoses), tuple(rounds), tuple(refused), law), step.given.model


@dataclass(frozen=True, eq=False)
class _Step:
    """Where the loop stands: the bench, and how what is done is reported."""

    given: Bench
    out: Path
    notify: Say
    progress: Progress
    explain: Explain

    def added(self, name: str, start: Chosen | None, number: int) -> tuple[_Step, Round]:
        """An effect added: from where a diagnosis found it, or from where a search for it ends (None)."""
        file = _vehicle_file(self.out, number)
        self.notify(chapter(f"Add {name}", self.explain("add", name, str(file))))
        begin = start or _searched(self.given, name, self.progress)
        with self.progress() as notify:
            addition = self.given.added(begin, len(begin.effect.trials()), notify)
        return self._with(addition, name, file)

    def learned(self) -> tuple[_Step, LawSearch, list[Round]]:
        """A law learned, written and added, with what is missing beside it; or none."""
        from logger.api.learning import learned, picture_of, with_law
        from logger.lab.session import LawSearch
        from logger.report.law_text import law_lines, source_of

        file = self.out / LAW
        self.notify(chapter("Learn a law", self.explain("learn", "", str(file))))
        with self.progress() as notify:
            found = learned(self.given, notify)
        self.notify(law_lines(found.learning, found.addition))
        if found.addition is None:
            return self, LawSearch(found.learning, None, None, ""), []
        write_text(file, source_of(found.learning, found.addition))
        self.notify(["", f"Law: {file}"])
        knows, addition = with_law(self.given, found.addition, file)
        name = " and ".join(addition.names)
        vehicle = _vehicle_file(self.out, 1)
        self.notify(chapter(f"Add {name}", self.explain("add", name, str(vehicle))))
        step, made = replace(self, given=knows)._with(addition, name, vehicle)
        return step, LawSearch(found.learning, found.addition, picture_of(found), str(file)), [made]

    def _with(self, addition: AddedEffects, name: str, file: Path) -> tuple[_Step, Round]:
        """The vehicle with what was added written and compared."""
        from logger.lab.session import Round
        from logger.report.lab_text import addition_lines

        model = self.given.model_with(addition)
        vehicle_format.write_model(file, model)
        self.notify([*addition_lines(addition), "", f"Vehicle: {file}"])
        self.notify(chapter("Compare again", self.explain("again", name, str(file))))
        given = replace(self.given, model=model)
        made = Round(addition, _compared(given, self.progress), str(file))
        self.notify(_comparison_lines(made.comparison))
        return replace(self, given=given), made


def _vehicle_file(out: Path, number: int) -> Path:
    return out / f"vehicle-{number}.yaml"


def _searched(given: Bench, name: str, progress: Progress) -> Chosen:
    with progress() as notify:
        return given.search_values(given.effects[name], {}, notify)


def _diagnosed(given: Bench, left_out: frozenset[str], progress: Progress) -> diagnosis.Diagnosis:
    with progress() as notify:
        return given.diagnosed(notify, left_out)


def _compared(given: Bench, progress: Progress) -> compare.Comparison:
    with progress() as notify:
        notify("comparing")
        return given.compared()


def chapter(title: str, explained: str = "") -> list[str]:
    """The lines of a heading, with what stands under it."""
    return ["", f"=== {title} ===", *([explained] if explained else []), ""]


def _comparison_lines(found: compare.Comparison) -> list[str]:
    from logger.report.comparison_text import conclusion, evidence, headline

    return [paragraphs(headline(found)), "", "After the refit:", paragraphs(evidence(found), "- "), "",
            paragraphs([conclusion(found).partition(" Next: ")[0]])]
