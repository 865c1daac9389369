"""The page of the whole loop: how a model came to what it lacked, from the first comparison to the last effect."""

from __future__ import annotations

import numpy as np

from logger.chart_data import Curves, Line
from logger.lab.residuals.breakdown import ModelResiduals, frequencies, segments
from logger.lab.session import Round, Story
from logger.report.add_effect_text import MOVED_HEADS, MOVED_HINT, errors, judgement, moved_rows
from logger.report.charts import chart
from logger.report.comparison_text import evidence, headline
from logger.report.diagnosis_page import falling, shape_sections
from logger.report.diagnosis_text import summary, untested
from logger.report.document import bullets, document, grid, heading, hint, paragraphs, section, tiles
from logger.report.html import EMPTY, Html, concatenated
from logger.report.law_page import law_sections
from logger.report.law_text import sentences, why_none
from logger.report.session_text import ending, steps
from logger.report.worst_moment import worst_moment

STEPS_HINT = ("From step 1 on the car's numbers and the distances are refitted within their tolerance; as "
              "the files are written, and on the distances as recorded, errors are larger.")
_HIGHEST_OF_RATE = 0.4
_QUIET_DB = -80.0


def page(story: Story) -> Html:
    """The story as one HTML document."""
    title = f"{story.first.vehicle}: from the first comparison to the last effect"
    runs = story.first.plain.residuals.runs
    last = story.diagnoses[-1]
    at_last = [last] if len(story.diagnoses) > 1 and not last.missing else []
    before = story.diagnoses[:len(story.diagnoses) - len(at_last)]
    return document(title, [
        heading(title, ", ".join(run.name for run in runs)),
        _tiles(story), paragraphs(ending(story)), section("How the error fell", _steps(story)),
        section("At first", paragraphs(headline(story.first)) + bullets(evidence(story.first))),
        section("What was missing", concatenated(paragraphs(summary(one)) for one in before)),
        *_law(story), *map(_added, story.rounds),
        section("Before and after", residual_spectra(story) + _place(story)) if story.rounds else "",
        section("What the car's numbers had been taken for", _moved(story)),
        section("At last", paragraphs(headline(story.last)) + bullets(evidence(story.last))
                + concatenated(paragraphs(summary(one)) for one in at_last)) if story.rounds else "",
        shape_sections(last),
        section("What these runs cannot tell, and which drive would", bullets(untested(last))),
        section("Where the effects are from", bullets(
            f"{one.effect.name} ({one.effect.title}): {one.effect.source}" for one in story.last.effects)),
    ])


def _tiles(story: Story) -> Html:
    return tiles([
        ("Error as the file says", f"{steps(story)[0][1]:.3f}", "as recorded"),
        ("Error at last", f"{steps(story)[-1][1]:.3f}", "refitted"),
        ("The sensor's noise alone", f"{story.floor:.3f}", ""),
        ("Effects added", f"{len(story.added)}", ""),
    ])


def _steps(story: Story) -> Html:
    rows = [(f"{number}", words, f"{error:.4f}") for number, (words, error) in enumerate(steps(story))]
    return (falling("Error of each model, on all samples", steps(story), story.floor)
            + grid(("Step", "Model", "Error"), rows, words=(0, 1)) + hint(STEPS_HINT))


def _law(story: Story) -> list[Html]:
    """The law that was looked for; nothing where none was."""
    sought = story.law
    if sought is None:
        return []
    if sought.learning.law is None or sought.addition is None:
        said = why_none(sought.learning)
        return [section("A law out of the data", paragraphs([f"{said[0].upper()}{said[1:]}."]))]
    return [section("A law out of the data", paragraphs(
        [*sentences(sought.learning.law, sought.addition), f"Written to {sought.file}."])),
        *law_sections(sought.learning.law, sought.addition, sought.picture)]


def _added(one: Round) -> Html:
    effects = [f"It leaves: {new.effect.signature}." for new in one.addition.new]
    rows = [(which, f"{error:.4f}", what) for which, error, what in errors(one.addition)]
    said = paragraphs([*judgement(one.addition), *effects, f"Written to {one.file}."])
    return section(f"Added: {' and '.join(one.addition.names)}",
                   said + grid(("Error", "", "of"), rows, words=(0, 2)))


def _moved(story: Story) -> Html:
    if not story.moved:
        return EMPTY
    return grid(MOVED_HEADS, moved_rows(story.moved), words=(0, 5)) + hint(MOVED_HINT)


def residual_spectra(story: Story) -> Html:
    """The residual before and after, by frequency."""
    before, after = story.first.refitted.residuals, story.last.refitted.residuals
    f_hz = frequencies(before)
    kept = (f_hz > 0) & (f_hz <= _HIGHEST_OF_RATE * before.rate_hz)

    def line(name: str, residuals: ModelResiduals, measured: bool) -> Line:
        signals = residuals.measured if measured else residuals.residual
        power = np.mean(np.abs(segments(residuals, signals)) ** 2, axis=0) / f_hz[1]
        return Line(name, f_hz[kept], np.maximum(10 * np.log10(np.maximum(power[kept], 1e-30)), _QUIET_DB))

    lines = (line("measured", before, True), line("residual at first", before, False),
             line("residual at last", after, False))
    return chart(Curves("By frequency", "frequency [Hz]", "power [dB of (m/s2)2/Hz]", lines))


def _place(story: Story) -> Html:
    """The place that was worst at first, then and now."""
    before, after = story.first.refitted, story.last.refitted
    worst, residuals = worst_moment(before), before.residuals
    index, part = worst.run, worst.part
    residual = residuals.residual[index]
    time_s = (residuals.runs[index].first + np.arange(len(residual)))[part] / residuals.rate_hz
    lines = (Line("measured", time_s, residuals.measured[index][part]),
             Line("residual at first", time_s, residual[part]),
             Line("residual at last", time_s, after.residuals.residual[index][part]))
    return chart(Curves(f"Where it was worst at first: {worst.words}", "time in the run [s]",
                          "acceleration [m/s2]", lines))
