"""The lab's loop: how a model comes to what it lacked, from the first comparison to the last effect.

The steps, the story of them in words and for a program, and its page; beside it the page of ``demo --field``.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.inputs import Model, model_of, read_vehicle
from logger.api.lab import compare as comparing
from logger.api.lab import diagnose as diagnosing
from logger.api.lab import learn as learning
from logger.api.lab.bench import Bench, bench_with, with_candidates
from logger.api.lab.question import LabLoopQuestion
from logger.api.lab.words import MODEL_BY_MODEL, ModelByModel, errors_json, falling, steps_section
from logger.api.shown import check_out
from logger.chart_data import Array, Curves, Line
from logger.errors import BadInput
from logger.estimation.batch import Assessment, figures
from logger.files import make_folder, write_text
from logger.lab import compare, diagnosis
from logger.lab.likelihood.posterior import State
from logger.lab.likelihood.whittle import HIGHEST_OF_RATE
from logger.lab.residuals.breakdown import ModelResiduals, frequencies
from logger.lab.selection.add_effect import AddedEffects, ShiftedNumber, moved_between
from logger.lab.selection.holdout import JUDGED_ON, ErrorStep
from logger.printable import Notify, silent
from logger.question import function
from logger.report import document as doc
from logger.report.blocks import SHOWN_ROWS, Block, Blocks, Bullets, Hint, Section, Table, page, text
from logger.report.quantities import wrapped
from logger.store.formats import vehicle_file as vehicle_format
from logger.vehicle.effect import Chosen

STORY, LAW = "story.html", "law.py"
MOST_ROUNDS = 6

Say = Callable[[Iterable[str]], None]
Ask = Callable[[Bench, str], str | None]
"""Which effect to add where one was found missing: its name or another's, or None for none."""
Learns = Callable[[], bool]
"""Whether a law is to be learned where no effect explains what is missing."""
_Begin = tuple[Chosen, State | None]
Progress = Callable[[], AbstractContextManager[Notify]]
Explain = Callable[[str, str, str], str]
"""What to say under a heading, laid out: of compare, diagnose, learn, add, again or end; with the effect that is
added, and the vehicle file that is read, or written where an effect is added; of learn the law's file."""


@dataclass(frozen=True, eq=False)
class Round:
    """Effects that were added, the result, the comparison with them, and the vehicle file that was written."""

    addition: AddedEffects
    comparison: compare.LabComparison
    file: str


@dataclass(frozen=True, eq=False)
class Story:
    """A session, in order.

    first       comparison of the vehicle as it was given
    diagnoses   at least one
    refused     effects that a diagnosis found missing and the user did not want
    law         what was learned where no effect explained what was missing; None: none was looked for
    law_file    that was written; empty: none
    """

    first: compare.LabComparison
    diagnoses: tuple[diagnosis.LabDiagnosis, ...]
    rounds: tuple[Round, ...]
    refused: tuple[str, ...]
    law: learning.LearnedModel | None = None
    law_file: str = ""

    @property
    def last(self) -> compare.LabComparison:
        """Comparison of the vehicle that the session ends with."""
        return self.rounds[-1].comparison if self.rounds else self.first

    @property
    def added(self) -> list[str]:
        """Names of the effects that were added, in order."""
        return [name for one in self.rounds for name in one.addition.names]

    @property
    def not_added(self) -> list[str]:
        """Names of the effects that were found missing last and neither added nor refused: the rounds were used up."""
        missing = [one.effect.name for one in self.diagnoses[-1].missing]
        return [name for name in missing if name not in self.added and name not in self.refused]

    @property
    def floor(self) -> float:
        """The error that the sensor's noise alone makes."""
        return (self.rounds[-1].addition if self.rounds else self.diagnoses[-1]).noise_floor_error

    @property
    def moved(self) -> list[ShiftedNumber]:
        """The car's numbers without and with the effects; none where nothing was added."""
        return moved_between(self.rounds[0].addition, self.rounds[-1].addition) if self.rounds else []


@dataclass(frozen=True, eq=False, repr=False)
class LabStory(ModelByModel):
    """What the lab's whole loop found.

    story                all of it, as the lab has it
    model                with all that was added, as the last file has it
    first                comparison of the model as it was given
    diagnoses            at least one
    additions            effects that were added, in order, and ``comparisons`` with them
    refused              effects that were found missing and not wanted
    law                  file of the law that was learned; None: none was
    error_before         of the model as it was given; ``error_after`` of the last one, refitted
    page                 the file with all of it
    """

    story: Story
    model: Model
    first: comparing.Comparison
    diagnoses: tuple[diagnosing.Diagnosis, ...]
    additions: tuple[comparing.AddedEffect, ...]
    comparisons: tuple[comparing.Comparison, ...]
    refused: tuple[str, ...]
    law: Path | None
    error_before: float
    error_after: float
    page: Path


@function(LabLoopQuestion)
def lab(question: LabLoopQuestion) -> LabStory:
    place, bench = Path(question.out), bench_with(question, None if question.candidates is not None else "ridelog lab")
    bench = with_candidates(bench, question.candidates)
    make_ready(bench, place)
    return walk(bench, place, _asking(question.ask), silent, lambda: nullcontext(question.progress),
                learns=lambda: question.learns)


def _asking(ask: Callable[[str], str | None]) -> Ask:
    def wanted(given: Bench, name: str) -> str | None:
        answer = ask(name)
        if answer is not None and answer != name:
            if answer not in given.effects:
                raise BadInput(f"{answer}: expected one of {', '.join(given.effects)}")
            given.asked_for(answer, {}, answer)
        return answer

    return wanted


def make_ready(given: Bench, out: Path, option: str = "") -> None:
    """Make the folder for the files. BadInput where there cannot be one, and for files that are read, or cannot be
    written; ``option``: how the folder was asked for."""
    try:
        make_folder(out)
    except FileExistsError:
        raise BadInput(f"{option} {out}: expected a folder".lstrip()) from None
    for file in (out / STORY, out / LAW, *(_vehicle_file(out, number + 1) for number in range(MOST_ROUNDS))):
        check_out(file, [Path(run.name) for run in given.runs.runs], given.files_read, option)


def walk(given: Bench, out: Path, ask: Ask, notify: Say, progress: Progress, explain: Explain = lambda *_: "",
         learns: Learns = lambda: True) -> LabStory:
    """Go through the loop; write the vehicle files and the page into ``out``.

    learns      asked once, where no effect explains what is missing
    notify        called with what was found
    progress    context around what takes long, called with what is under way
    explain     what to say of each step in addition to what it finds
    """
    story, model = go_through(given, out, ask, notify, progress, explain, learns)
    write_text(out / STORY, story_page(story))
    notify(chapter("The end", explain("end", "", "")))
    notify([wrapped(ending(story)), "", f"The whole story as a page: {out / STORY}"])
    models = Table(("Model", "Error"), [(one.words, f"{one.error:.3f}") for one in steps(story)])
    summary = as_json(story) | {"story": str(out / STORY)}
    return LabStory(
        Blocks([models, *ending(story)]), summary, tuple(steps(story)), story.floor, story, model_of(model),
        comparing.comparison_of(story.first),
        tuple(diagnosing.diagnosis_of(one, given) for one in story.diagnoses),
        tuple(comparing.addition_of(one.addition, read_vehicle(one.file)) for one in story.rounds),
        tuple(comparing.comparison_of(one.comparison) for one in story.rounds), story.refused,
        Path(story.law_file) if story.law_file else None, summary["error_before"], summary["error_after"], out / STORY)


def go_through(given: Bench, out: Path, ask: Ask, notify: Say, progress: Progress, explain: Explain,
               learns: Learns = lambda: True) -> tuple[Story, vehicle_format.CarModel]:
    """The same without its end and its page."""
    word = given.word
    notify(chapter("Compare", explain("compare", "", word)))
    first = _compared(given, progress)
    notify([text(comparing.judged(first))])
    diagnoses: list[diagnosis.LabDiagnosis] = []
    rounds: list[Round] = []
    refused: list[str] = []
    law: learning.LearnedModel | None = None
    step = _Step(given, out, notify, progress, explain)
    going = asked = True
    while going and len(rounds) < MOST_ROUNDS:
        going = False
        notify(chapter("Diagnose", explain("diagnose", "", word)))
        with progress() as tell:
            diagnoses.append(step.given.diagnosed(tell, frozenset(refused)))
        notify([text(diagnosing.diagnosis_blocks(diagnoses[-1], SHOWN_ROWS))])
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
            begin = (one, diagnoses[-1].state) if same else None
            step, made_now = step.added(wanted, begin, len(rounds) + 1)
            rounds.append(made_now)
            word = made_now.file
            if not same:  # with another effect, what is missing is searched again
                going = True
                break
    return Story(first, tuple(diagnoses), tuple(rounds), tuple(refused), law,
                 str(out / LAW) if law and law.addition else ""), step.given.model


@dataclass(frozen=True, eq=False)
class _Step:
    """Where the loop stands: the bench, and how what is done is reported."""

    given: Bench
    out: Path
    notify: Say
    progress: Progress
    explain: Explain

    def added(self, name: str, start: _Begin | None, number: int) -> "tuple[_Step, Round]":
        """An effect added: from where a diagnosis found it, or from where a search for it ends (None)."""
        file = _vehicle_file(self.out, number)
        self.notify(chapter(f"Add {name}", self.explain("add", name, str(file))))
        with self.progress() as notify:
            begin, near = start or self.given.search_values(self.given.effects[name], {}, notify)
            addition = self.given.added([begin], len(begin.effect.trials()), notify, near)
        return self._with(addition, name, file)

    def learned(self) -> "tuple[_Step, learning.LearnedModel, list[Round]]":
        """A law learned, written and added, with what is missing beside it; or none."""
        file = self.out / LAW
        self.notify(chapter("Learn a law", self.explain("learn", "", str(file))))
        with self.progress() as notify:
            found = learning.learned(self.given, notify)
        self.notify([text(learning.law_blocks(found))])
        if found.addition is None:
            return self, found, []
        write_text(file, learning.source_of(found.learning, found.addition))
        self.notify(["", f"Law: {file}"])
        knows, addition = learning.with_law(self.given, found.addition, file)
        name = " and ".join(addition.names)
        vehicle = _vehicle_file(self.out, 1)
        self.notify(chapter(f"Add {name}", self.explain("add", name, str(vehicle))))
        step, made = replace(self, given=knows)._with(addition, name, vehicle)
        return step, found, [made]

    def _with(self, addition: AddedEffects, name: str, file: Path) -> "tuple[_Step, Round]":
        """The vehicle with what was added written and compared."""
        model = self.given.model_with(addition)
        vehicle_format.write_model(file, model)
        self.notify([text(comparing.addition_blocks(addition)), "", f"Vehicle: {file}"])
        self.notify(chapter("Compare again", self.explain("again", name, str(file))))
        given = replace(self.given, model=model)
        made = Round(addition, _compared(given, self.progress), str(file))
        self.notify([text(comparing.judged(made.comparison))])
        return replace(self, given=given), made


def _vehicle_file(out: Path, number: int) -> Path:
    return out / f"vehicle-{number}.yaml"


def _compared(given: Bench, progress: Progress) -> compare.LabComparison:
    with progress() as notify:
        notify("comparing")
        return given.compared()


def chapter(title: str, explained: str = "") -> list[str]:
    """The lines of a heading, with what stands under it."""
    return ["", f"=== {title} ===", *([explained] if explained else []), ""]


def steps(story: Story) -> list[ErrorStep]:
    """Models on the way, each with its error on what no fit saw."""
    return [*(story.rounds[0].addition if story.rounds else story.first).steps[:2],
            *(one.addition.steps[-1] for one in story.rounds)]


def ending(story: Story) -> list[str]:
    """What it came to."""
    diagnosis, models = story.diagnoses[-1], steps(story)
    with_what = [comparing.bias(story.added, story.moved)] if story.added else []
    lines = []
    if story.added:
        lines.append(f"{' and '.join(story.added)} reduced the NRMSE from {models[1][1]:.3f} to {models[-1][1]:.3f}, "
                     "both refitted. With the last file and the runs as they are, the NRMSE is "
                     f"{story.last.plain.error:.3f}.")
    lines.append(f"Noise floor: about {story.floor:.3f}.")
    if story.refused:
        lines.append(f"Missing, but you chose not to add: {', '.join(story.refused)}.")
    if story.not_added:
        lines.append(f"Missing, but not added: {', '.join(story.not_added)}. Run ridelog lab again with the last file "
                     "to go on.")
    if story.refused or story.not_added:
        return [*lines, *with_what]
    if diagnosis.beyond and not diagnosis.exceeds_noise:
        lines.append("Parameters of the vehicle's file are beyond their tolerance: check them.")
    elif diagnosis.unexplained and story.law is None:
        lines.append("Something is still missing that no known effect explains. Next: ridelog learn, or an effect of "
                     "your own.")
    elif diagnosis.unexplained:
        lines.append("Something is still missing that no known effect and no learned law explains. Next: an effect of "
                     "your own.")
    else:
        lines.append(f"Nothing {'more ' * bool(story.added)}is missing, as far as these runs can show.")
    return [*lines, *with_what]


def as_json(story: Story) -> dict[str, Any]:
    """The story as one JSON object."""
    models = steps(story)
    return {
        "error_before": models[0][1], "error_after": models[-1][1], "noise_floor_error": story.floor,
        "added": story.added, "refused": list(story.refused), "left": story.not_added,
        "unexplained": story.diagnoses[-1].unexplained,
        **errors_json(models, story.floor),
        "effects": [{"effect": one.effect.name, "parameters": dict(one.values)} for one in story.last.effects],
        "biased": [one.name for one in story.moved if one.biased],
        "vehicles": [one.file for one in story.rounds], "law": story.law_file or None,
        "sentences": ending(story),
    }


STEPS_HINT = ("From step 1 on, the lab refits the model's parameters within their tolerance, and the distances of "
              "drives. With the files and runs as they are, the NRMSE is larger.")


def story_page(story: Story) -> doc.Html:
    """The story as one HTML document."""
    runs = story.first.plain.residuals.runs
    return page(f"{story.first.vehicle}: what the model lacked", ", ".join(run.name for run in runs),
                _story_blocks(story))


def _story_blocks(story: Story) -> Iterator[Block]:
    last = story.diagnoses[-1]
    at_last = [last] if len(story.diagnoses) > 1 and not last.missing else []
    before = story.diagnoses[:len(story.diagnoses) - len(at_last)]
    yield doc.tiles([
        ("NRMSE before any fit", f"{steps(story)[0][1]:.3f}", ""),
        ("NRMSE finally", f"{steps(story)[-1][1]:.3f}", "refitted"),
        ("Noise floor", f"{story.floor:.3f}", "NRMSE"),
        ("Effects added", f"{len(story.added)}", ""),
    ])
    yield from ending(story)
    yield steps_section(steps(story), story.floor, Hint(STEPS_HINT))
    yield Section("Initially", _judged(story.first))
    yield Section("What was missing", [words for one in before for words in diagnosing.diagnosis_summary(one)])
    yield from _law(story)
    for one in story.rounds:
        yield Section(f"Added: {' and '.join(one.addition.names)}", [
            *comparing.judgement(one.addition), *(f"Signature: {new.effect.signature}." for new in one.addition.new),
            f"Written to {one.file}.", comparing.errors(one.addition)])
    if story.rounds:
        yield Section("Before and after", [residual_spectra(story), _place(story)])
    yield Section("What the missing effects had biased", comparing.moved_blocks(story.moved))
    if story.rounds:
        yield Section("Finally", [*_judged(story.last), *(
            words for one in at_last for words in diagnosing.diagnosis_summary(one))])
    yield from diagnosing.shape_sections(last)
    yield Section("What these runs cannot tell, and which drive would", [Bullets(diagnosing.untested(last))])
    yield Section("Sources", [Bullets([
        f"{one.effect.name} ({one.effect.title}): {one.effect.source}" for one in story.last.effects])])


def _judged(found: compare.LabComparison) -> list[Block]:
    return [comparing.conclusion(found), *comparing.headline(found), Bullets(comparing.evidence(found))]


def _law(story: Story) -> list[Section]:
    """The law that was looked for; nothing where none was."""
    sought = story.law
    if sought is None:
        return []
    if sought.learning.law is None or sought.addition is None:
        said = learning.why_none(sought.learning)
        return [Section("A law learned from the runs", [f"{said[0].upper()}{said[1:]}."])]
    return [Section("A law learned from the runs", [
        *learning.sentences(sought.learning.law, sought.addition), f"Written to {story.law_file}."]),
        *learning.law_sections(sought.learning.law, sought.addition, learning.picture_of(sought))]


def residual_spectra(story: Story) -> Curves:
    """The residual before and after, by frequency."""
    before, after = story.first.refitted.residuals, story.last.refitted.residuals
    f_hz = frequencies(before)
    kept = (f_hz > 0) & (f_hz <= HIGHEST_OF_RATE * before.rate_hz)

    def line(name: str, residuals: ModelResiduals, measured: bool) -> Line:
        signals = residuals.measured if measured else residuals.residual
        return Line(name, f_hz[kept], comparing.decibels(residuals, signals)[kept])

    lines = (line("measured", before, True), line("residual initially", before, False),
             line("residual finally", after, False))
    unit = before.unit
    return Curves("By frequency", "frequency [Hz]", f"power spectral density [dB re 1 ({unit})2/Hz]", lines)


def _place(story: Story) -> Curves:
    """The place that was worst at first, then and now."""
    before, after = story.first.refitted, story.last.refitted
    worst, residuals = comparing.worst_moment(before), before.residuals
    return comparing.moment_chart(f"The worst place initially: {worst.words}", residuals, worst, {
        "measured": residuals.measured, "residual initially": residuals.residual,
        "residual finally": after.residuals.residual})


def figures_of(found: Assessment) -> dict[str, Any]:
    """Figures of the windows in which the car moved; its ``comparison`` with the profile must be there."""
    return figures(found, found.windows.speed_mps > 0)


def iri_blocks(before: Assessment, after: Assessment) -> list[Block]:
    """A table of the IRI by the file as it was given, by the last one, and the truth; and what its columns are."""
    known = after.exact_m_per_km[np.isfinite(after.exact_m_per_km)]
    return [Table(("IRI", "Mean [m/km]", "Bias", "R2", "Within 1", "Within 2"), [
        _row("estimated with the first file", figures_of(before)),
        _row("estimated with the last file", figures_of(after)),
        ("measured", f"{known.mean():.2f}", "", "", "", "")]),
        Hint("Within 1, 2: share of windows with the truth within one, two standard errors (ideal: 68 %, 95 %).")]


def _row(name: str, found: dict[str, Any]) -> tuple[str, ...]:
    beside = found["comparison"]
    return (name, f"{found['iri_m_per_km']:.2f}", f"{beside['bias']:+.1%}", f"{beside['r2']:.3f}",
            f"{beside['within_one']:.0%}", f"{beside['within_two']:.0%}")


def field_page(title: str, about: Sequence[str], ways: Curves, story: Story, before: Assessment,
         after: Assessment, answer: Sequence[str]) -> doc.Html:
    """The whole of it as one HTML document.

    about             what the drives are, a paragraph each
    ways              lines that were measured, and the drives on them
    before, after     the road of a drive that the lab did not see, by the file as it was and by the last one
    answer            what is true, where that is known
    """
    first, last = (figures_of(one)["comparison"] for one in (before, after))
    return page(title, ", ".join(one.name for one in ways.lines if one.dots), [
        doc.tiles([
            ("Bias of the IRI, initially", f"{first['bias']:+.1%}", f"R2 {first['r2']:.2f}"),
            ("finally", f"{last['bias']:+.1%}", f"R2 {last['r2']:.2f}"),
            ("NRMSE, initially", f"{steps(story)[0][1]:.3f}", "before any fit"),
            ("finally", f"{steps(story)[-1][1]:.3f}", "refitted"),
        ]),
        *about,
        Section("The drives", [ways, Hint("Lines: measured. Dots: the car's GPS positions, one a second.")]),
        Section(MODEL_BY_MODEL, [falling(f"NRMSE on {JUDGED_ON}", steps(story), story.floor), *ending(story)]),
        Section("What was missing", diagnosing.diagnosis_summary(story.diagnoses[0])),
        Section("Before and after", [residual_spectra(story)] if story.rounds else []),
        Section("The IRI of a drive that the lab did not see", [_iri(before, after), *iri_blocks(before, after)]),
        Section("The answer", [Bullets(answer)]),
    ])


def _iri(before: Assessment, after: Assessment) -> Curves:
    exact = np.isfinite(after.exact_m_per_km)
    lines = (_line("finally", after, True), _line("initially", before, False),
             Line("truth", _middles_m(after)[exact], after.exact_m_per_km[exact]))
    return Curves(f"IRI over {after.window_m:.4g} m, finally with its standard error", "distance along the line [m]",
                  "IRI [m/km]", lines)


def _line(name: str, one: Assessment, band: bool) -> Line:
    windows = one.windows
    known = np.isfinite(windows.iri_m_per_km)
    return Line(name, _middles_m(one)[known], windows.iri_m_per_km[known],
                windows.iri_std_m_per_km[known] if band else None)


def _middles_m(one: Assessment) -> Array:
    return np.asarray((one.windows.edges_m[1:] + one.windows.edges_m[:-1]) / 2)
