"""The report of an examination: goals beside figures, the confusion matrix, and every case that went wrong.

Problem: a text written by hand beside numbers made by a program says, sooner or later, something else than they do.
Solution: tables are made once from the records, and set as Markdown and as a page; sentences hold numbers only from
there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from logger.report.document import Html, document, grid, html, paragraphs, section

from ..cases.random_case import WRONG_FOR_S, WRONG_MPS
from ..cases.seeds import RELEASE_SEEDS
from ..marking.marks import (
    CLASSES,
    FAILED,
    NOTHING,
    UNEXPLAINED,
    Goal,
    Record,
    Share,
    above,
    all_found,
    all_named,
    by_confusion,
    first_right,
    first_said,
    goals,
    hidden,
    in_class,
    near,
    numbers,
    numbers_right,
    of_kind,
    off_list_seen,
    right,
    said,
    share,
    unexplained,
    unseen,
    verdict,
)
from ..simulator.effects import EFFECTS
from ..simulator.outsiders import OUTSIDERS
from .matrix_figure import matrix_figure

TITLE = "The lab examined"
COMMAND = "python -m tests.validation.examine"
_LONGEST_S, _MOST_MB, _FULL = 60.0, 1000.0, (60.0,) * 4
_WORDS = {"none": "nothing missing", "one": "one effect", "two": "two effects", "three": "three effects",
          "outsider": "an unlisted effect", "two_outsider": "a listed effect and an unlisted one",
          "wandering": "one effect or none where the distance wanders"}


@dataclass(frozen=True)
class Table:
    """Heads, rows of words, and which columns are words (the others are numbers)."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[int] = (0,)


@dataclass(frozen=True)
class Part:
    """A section: sentences, and a table under them; without rows, ``nothing`` is said."""

    title: str
    lines: Sequence[str]
    table: Table | None = None
    nothing: str = "None."


def parts(records: Sequence[Record]) -> list[Part]:
    """All sections but the picture."""
    return [
        Part("Goals", [], _goals(records)),
        Part("By strength", [
            "Strength is how much the effect changes the noise-free record (r.m.s.), relative to the noise (r.m.s.), "
            "with all other parameters true; of several effects, that of the weakest. *Can be seen* excludes the "
            "cases under *What nobody could see*."], _by_strength(records)),
        Part("After adding", _adding(records)),
        Part("Time and memory", _cost(records)),
        Part("Wrong verdicts", ["What these cases hid and what was said. For an effect off the list, the nearest "
                                "listed one is marked akin."], _wrong(records)),
        Part("Wrong parameters", ["Verdicts that name all effects, with an error or a parameter outside the goal."],
             _wrong_numbers(records)),
        Part("What nobody could see", [
            "In these cases the car's own parameters and the distance, within their tolerances, reproduce the weakest "
            "effect: in the examiner's simulator less than 1 % of the error remains. All figures above include them. "
            "Distances that wander may hide more."], _unseen(records)),
    ]


def opening(records: Sequence[Record], asked: int) -> list[str]:
    """What was done."""
    kinds = Counter(record["kind"] for record in records)
    counts = ", ".join(f"{count} with {_WORDS[kind]}" for kind, count in kinds.items())
    seeds = [record["seed"] for record in records]
    release = all(seed in RELEASE_SEEDS for seed in seeds)
    which = "were never used while the lab was developed" if release else "may have shaped the lab"
    lines = [f"{len(records)} random cases: {counts}. Their {'release' if release else 'development'} seeds, "
             f"{min(seeds)} to {max(seeds)}, {which}. A simulator made them that shares nothing with ridelog: other "
             "equations and another integrator, with roads, cars, speeds and noise of its own. The car's file is off "
             "by up to 4 %, distances by two centimetres. Where distances wander, they are integrals of a speed that "
             f"is wrong by {WRONG_MPS[0]:g} to {WRONG_MPS[1]:g} m/s for {WRONG_FOR_S[0]:g} to {WRONG_FOR_S[1]:g} s. "
             "Each was given to `ridelog diagnose`, and the effects that it named to `ridelog add-effect`. "
             f"Made by `{COMMAND}{' --release' if release else ''}`."]
    if len(records) < asked:
        lines.append(f"The examination is not over: {len(records)} of {asked} cases are done.")
    if (programs := len({record["source"] for record in records})) > 1:
        lines.append(f"The program was changed in the meantime: {programs} states of it answered.")
    missed = [goal for goal in goals(records) if goal.found.of and not goal.met]
    lines.append("All goals that are shares of cases are met." if not missed else
                 f"Goals missed: {'; '.join(f'{_uncapital(goal.name)} ({_share(goal.found)})' for goal in missed)}.")
    confused = sum(map(by_confusion, of_kind(records, "one")))
    lines.append(f"In {confused} of the right answers to one effect, another effect was named first and the right one "
                 "listed as not distinguishable from it.")
    return lines


# --- tables ---------------------------------------------------------------------------------------------------------

def _goals(records: Sequence[Record]) -> Table:
    rows = [(goal.name, goal.wanted, _percent(goal.found), f"{goal.found.count} of {goal.found.of}", _interval(goal),
             goal.verdict) for goal in goals(records)]
    return Table(("", "Goal", "Reached", "Cases", "95 % interval", ""), rows, (0, 5))


def _by_strength(records: Sequence[Record]) -> Table:
    one, two, three, out = (of_kind(records, kind) for kind in ("one", "two", "three", "outsider"))
    listed = [record for record in [*one, *two] if all_found(record)]
    rows = []
    for name, asked, holds in (
            ("One effect: right first, or named as confused", one, first_right),
            ("Two effects: both named", two, all_named),
            ("Three effects: all named", three, all_named),
            ("Off the list: unexplained", out, off_list_seen),
            ("Effects found: error within 10 % of the noise floor", listed, near),
            ("Effects found: parameters right", listed, numbers_right)):
        found = [share(in_class(asked, low, high), holds) for _, low, high in CLASSES]
        found.append(share([record for record in asked if not unseen(record)], holds))
        rows.append((name, *map(_share, found)))
    return Table(("", *(name for name, _, _ in CLASSES), "can be seen"), rows)


def _adding(records: Sequence[Record]) -> list[str]:
    found = [record for record in of_kind(records, "one", "two") if all_found(record) and record["added"]]
    if not found:
        return ["No case had all of its effects found."]
    lines = []
    for name, words in (("noise_floor_error", "the noise floor"), ("attainable_error", "the attainable error")):
        ratios = sorted(above(record, name) for record in found)
        lines.append(f"Error over {words}: median {median(ratios):.3f}, nine in ten below "
                     f"{ratios[int(0.9 * (len(ratios) - 1))]:.3f}, largest {ratios[-1]:.3f}; within 10 % in "
                     f"{_share(share(found, lambda record, key=name: near(record, key)))}.")
    lines.append("The noise floor is the NRMSE of the noise alone. The attainable error is that of the true car with "
                 "effects, driven along the recorded distance, which is off by millimetres to centimetres; correcting "
                 "the distance can bring it lower.")
    guesses = sorted(record["said"]["noise_floor_error"] / record["truth"]["noise_floor_error"] for record in found
                     if record["said"]["noise_floor_error"])
    if guesses:
        lines.append(f"The noise floor that the lab estimates over the true one: median {median(guesses):.3f}, from "
                     f"{guesses[0]:.3f} to {guesses[-1]:.3f}.")
    return lines


def _cost(records: Sequence[Record]) -> list[str]:
    costs = [record["diagnosing"] for record in records if record["said"]
             and tuple(run["duration_s"] for run in record["truth"]["runs"]) == _FULL]
    if not costs:
        return ["No case had four runs of 60 s."]
    wall, cpu = ([cost[key] for cost in costs] for key in ("wall_s", "cpu_s"))
    lines = [f"A diagnosis of four runs of 60 s ({len(costs)} cases, on a machine that did other work): "
             f"median {median(wall):.0f} s, longest {max(wall):.0f} s by the clock; median {median(cpu):.0f} s, most "
             f"{max(cpu):.0f} s of processor time. Goal: below {_LONGEST_S:.0f} s on two cores; "
             f"{sum(one < _LONGEST_S for one in wall)} of {len(wall)} were."]
    memory = [cost["peak_mb"] for cost in costs if "peak_mb" in cost]
    if memory:
        lines.append(f"Memory: at most {max(memory):.0f} MB. Goal: below {_MOST_MB:.0f} MB.")
    return lines


def _wrong(records: Sequence[Record]) -> Table:
    rows = []
    for record in records:
        extra = unexplained(record) and not record["truth"]["outsiders"]
        if right(record) and not extra:
            continue
        rows.append((record["kind"], f"{record['seed']}", _hidden(record), said(record), _note(record)))
    return Table(("Kind", "Seed", "Hidden (strength)", "Said", ""), rows, (0, 2, 3, 4))


def _note(record: Record) -> str:
    notes = ["nobody could see it"] if unseen(record) else []
    akin = {name for one in record["truth"]["outsiders"] for name in one["akin"]}
    known = {one["name"] for one in record["truth"]["effects"]}
    if akin and verdict(record) and set(verdict(record)) <= akin | known and not unexplained(record):
        notes.append("akin")
    if right(record):
        notes.append("named rightly, but also unexplained")
    return "; ".join(notes)


def _wrong_numbers(records: Sequence[Record]) -> Table:
    rows = []
    for record in of_kind(records, "one", "two"):
        if not all_found(record) or (near(record) and numbers_right(record)):
            continue
        off = "; ".join(one.words for one in numbers(record) if not one.right)
        ratio = f"{above(record, 'noise_floor_error'):.3f}" if record["added"] else record["failed"] or ""
        rows.append((record["kind"], f"{record['seed']}", _hidden(record), ratio, off))
    return Table(("Kind", "Seed", "Hidden (strength)", "Error over noise floor", "Parameters that are off"), rows,
                 (0, 2, 4))


def _unseen(records: Sequence[Record]) -> Table:
    rows = [(record["kind"], f"{record['seed']}", _hidden(record), f"{min(record['left']):.2f}", said(record),
             "right" if right(record) else "wrong") for record in records if unseen(record)]
    heads = ("Kind", "Seed", "Hidden (strength)", "What remains of the effect, over noise", "Said", "Counted")
    return Table(heads, rows, (0, 2, 4, 5))


# --- the matrix -----------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Matrix:
    """What was hidden, what was said, how often; which column of a row is right; how often the right one was named as
    what cannot be distinguished from the one that was said."""

    rows: Sequence[str]
    columns: Sequence[str]
    counts: Counter[tuple[str, str]]
    good: dict[str, str]
    confused: Counter[str]

    @staticmethod
    def of(records: Sequence[Record]) -> Matrix:
        """Of the cases that hid one thing or nothing."""
        counts: Counter[tuple[str, str]] = Counter()
        confused: Counter[str] = Counter()
        for record in of_kind(records, "none", "one", "outsider"):
            name = _row(record)
            counts[name, first_said(record)] += 1
            confused[name] += record["kind"] == "one" and by_confusion(record)
        good = {name: name for name in EFFECTS} | {NOTHING: NOTHING} | dict.fromkeys(OUTSIDERS, UNEXPLAINED)
        asked = {row for row, _ in counts}
        columns = [*EFFECTS, NOTHING, UNEXPLAINED]
        if any(column == FAILED for _, column in counts):
            columns.append(FAILED)
        return Matrix([name for name in good if name in asked], columns, counts, good, confused)

    @property
    def figure(self) -> str:
        """As an SVG element."""
        return matrix_figure("What was hidden and what was said", self.rows, self.columns, self.counts, self.good)

    @property
    def table(self) -> Table:
        """With columns by their numbers."""
        numbered = [f"{number}" for number, _ in enumerate(EFFECTS, 1)]
        order = {name: number for number, name in enumerate(EFFECTS, 1)}
        rows = [(f"{order[row]} {row}" if row in order else row,
                 *(f"{self.counts[row, column] or ''}" for column in self.columns), f"{self.confused[row] or ''}")
                for row in self.rows]
        return Table(("Hidden", *numbered, *self.columns[len(EFFECTS):], "confused"), rows)


_MATRIX_LINES = (
    "Cases that hid one effect, or nothing, and whose distance is right: what was hidden (rows) and what was said "
    "first (columns). A case off the list counts as unexplained where that was said, whatever else was said. "
    "*Confused*: cases of the row in which another effect was named first and the right one listed as not "
    "distinguishable from it; they count as right.",)


def _row(record: Record) -> str:
    return next((one["name"] for one in hidden(record)), NOTHING)


# --- setting --------------------------------------------------------------------------------------------------------

def markdown(records: Sequence[Record], asked: int, picture: str) -> str:
    """The report as Markdown; ``picture``: the file of the matrix."""
    first, *rest = parts(records)
    matrix = Matrix.of(records)
    blocks = [f"# {TITLE}", *opening(records, asked), *_marked_down(first), "## Confusion matrix", *_MATRIX_LINES,
              f"![What was hidden and what was said]({picture})", _pipes(matrix.table)]
    for part in rest:
        blocks += _marked_down(part)
    return "\n\n".join(blocks) + "\n"


def _marked_down(part: Part) -> list[str]:
    blocks = [f"## {part.title}"]
    if part.table is not None and not part.table.rows:
        return [*blocks, part.nothing]
    return [*blocks, *part.lines, *([_pipes(part.table)] if part.table else [])]


def _pipes(table: Table) -> str:
    lines = [table.heads, [("---" if index in table.words else "---:") for index, _ in enumerate(table.heads)],
             *table.rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def page(records: Sequence[Record], asked: int) -> str:
    """The report as a page that stands alone."""
    first, *rest = parts(records)
    matrix = Matrix.of(records)
    return document(TITLE, [
        html("<h1>{}</h1>", TITLE), paragraphs(map(_plain, opening(records, asked))), _on_page(first),
        section("Confusion matrix",
                paragraphs(map(_plain, _MATRIX_LINES)) + html("<figure>{}</figure>", Html(matrix.figure))),
        *map(_on_page, rest)])


def _on_page(part: Part) -> str:
    if part.table is not None and not part.table.rows:
        return section(part.title, paragraphs([part.nothing]))
    table = grid(map(_plain, part.table.heads), [map(_plain, row) for row in part.table.rows],
                 part.table.words) if part.table else ""
    return section(part.title, paragraphs(map(_plain, part.lines)) + table)


def _plain(text: str) -> str:
    """Without the marks of Markdown."""
    return text.replace("*", "").replace("`", "")


# --- words ----------------------------------------------------------------------------------------------------------

def _hidden(record: Record) -> str:
    return ", ".join(f"{one['name']} ({one['strength']:.2g})" for one in hidden(record)) or NOTHING


def _percent(found: Share) -> str:
    return f"{found.value:.1%}" if found.of else ""


def _share(found: Share) -> str:
    return f"{found.count} of {found.of}" + (f" ({found.value:.0%})" if found.of else "")


def _interval(goal: Goal) -> str:
    low, high = goal.found.interval
    return f"{low:.0%} to {high:.0%}" if goal.found.of else ""


def _uncapital(text: str) -> str:
    return text[0].lower() + text[1:]
