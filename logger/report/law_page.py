"""The page of a learned law: what it is, its picture, what it brings, and what it may be instead."""

from __future__ import annotations

from logger.chart_data import Chart
from logger.lab.laws.learn import Law, Learning
from logger.lab.selection.add_effect import AddedEffects
from logger.report.charts import chart
from logger.report.diagnosis_page import falling, shape_sections
from logger.report.document import document, grid, heading, hint, paragraphs, section, tiles
from logger.report.html import EMPTY, Html
from logger.report.law_text import as_json, law_lines, learned, sentences, steps_of
from logger.report.quantities import measured, unit_of

_BAND = "The band is one standard error either way; the curve ends where the runs' motions do."


def page(found: Learning, addition: AddedEffects | None, drawn: Chart | None, vehicle: str, file: str) -> Html:
    """What was learned as one HTML document; ``file``: of the law."""
    title = f"{vehicle}: a law out of the data"
    runs = ", ".join(run.name for run in found.context.runs)
    summary = as_json(found, addition, file)
    law = found.law
    if law is None or addition is None:
        assert found.diagnosis is not None
        return document(title, [
            heading(title, runs), _tiles(summary), paragraphs(law_lines(found, addition)),
            shape_sections(found.diagnosis)])
    return document(title, [
        heading(title, runs), _tiles(summary), paragraphs(sentences(law, addition)),
        *law_sections(law, addition, drawn),
        section("How the error fell", falling("Error on all samples", steps_of(law, addition),
                                              addition.noise_floor_error)),
        section("Where it is", paragraphs([f"{file}: an effect of your own, which compare, simulate, add-effect and "
                                           "diagnose --effect-file take.", law.draft.source]))])


def law_sections(law: Law, addition: AddedEffects, drawn: Chart | None) -> list[Html]:
    """A law's picture, if it has one, and its numbers."""
    one = learned(law, addition)
    numbers = [(name, measured(value, one.standard_errors.get(name)), unit_of(name), parameter.meaning)
               for (name, value), parameter in zip(one.values.items(), law.draft.parameters, strict=True)]
    table = section("Its numbers", grid(("Number", "Value", "Unit", "What it is"), numbers, words=(0, 2, 3)))
    if drawn is None:
        return [table]
    return [section("The law", chart(drawn) + (hint(_BAND) if law.draft.at != "loop" else EMPTY)), table]


def _tiles(summary: dict[str, object]) -> Html:
    def error(key: str) -> str:
        value = summary[key]
        return f"{value:.3f}" if isinstance(value, float) else "not known"

    return tiles([("Error of the model as it stands", error("error_before"), "as recorded"),
                  ("As it ends", error("error_after"), "refitted"),
                  ("On what no fit saw", error("error_after_unseen"), ""),
                  ("The sensor's noise alone", error("noise_floor_error"), "")])
