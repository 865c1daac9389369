"""What the lab found, as a person reads it at a terminal."""

from __future__ import annotations

from logger.lab.compare import Comparison
from logger.lab.diagnosis import Diagnosis
from logger.lab.residuals.breakdown import Part
from logger.lab.selection.add_effect import AddedEffects
from logger.lab.selection.error_scale import fit_percent
from logger.left_out import left_out_paragraph
from logger.report.add_effect_text import MOVED_HEADS, MOVED_HINT, bias, errors, judgement, moved_rows
from logger.report.comparison_text import conclusion, evidence, headline
from logger.report.diagnosis_text import looks_like, summary, table, untested
from logger.report.residual_text import error_text, paired
from logger.report.text_layout import columns, paragraphs
from logger.runs import runs_left_out, short_names

_PLACES = 5


def comparison_lines(found: Comparison) -> list[str]:
    """What a person reads of a comparison."""
    residuals = found.plain.residuals
    seconds = sum(map(len, residuals.residual)) / residuals.rate_hz
    return [
        f"{found.vehicle} on {len(residuals.runs)} run{'s' * (len(residuals.runs) != 1)}, {seconds:.0f} s", "",
        paragraphs(headline(found)), "", "After the refit:", paragraphs(evidence(found), "- "), "",
        paragraphs([conclusion(found)]), "",
        *_tables(found), *left_out_paragraph(runs_left_out(residuals.runs)),
    ]


def _tables(found: Comparison) -> list[str]:
    """Where the residual is, before any fit and after the refit."""
    lines = [f"{'Where':46}{'share of residual':>13}{'error':>12}", f"{'':44}{'file':>8}{'refit':>7}{'file':>8}"
                                                                    f"{'refit':>8}"]
    plain, refitted = found.plain.where, found.refitted.where
    for title, unit, one, other in (
        ("Frequency", "Hz", plain.frequency, refitted.frequency), ("Speed", "m/s", plain.speed, refitted.speed),
    ):
        lines += [title, *(_row(a, b, unit) for a, b in paired(one, other))] if other else []
    lines += ["Model's acceleration", *(_row(None, part, "m/s2") for part in refitted.amplitude)]
    names = short_names(found.plain.residuals.runs)
    places = [_place(part, names[part.name]) for part in refitted.worst_places(_PLACES)]
    return [*lines, "Worst places", *places] if places else lines


def _row(plain: Part | None, refitted: Part, unit: str) -> str:
    name = f"  {refitted.low:.3g} to {refitted.high:.3g} {unit}" + (f" {refitted.name}" if refitted.name else "")
    share, error = (f"{plain.share:.1%}", error_text(plain, 3)) if plain else ("", "")
    return f"{name:46}{share:>6}{refitted.share:>7.1%}{error:>8}{error_text(refitted, 3):>8}"


def _place(part: Part, run: str) -> str:
    name = f"  {run}, {part.low:g} to {part.high:g} m"
    return f"{name:46}{'':6}{part.share:>7.1%}{'':8}{error_text(part, 3):>8}"


def diagnosis_lines(found: Diagnosis, most: int | None) -> list[str]:
    """What a person reads of a diagnosis."""
    shown = [paragraphs(summary(found))]
    if described := looks_like(found):
        shown += ["", "What it looks like:", paragraphs(described, "- ")]
    rows = [("Effect", "Error", "p-value", "Numbers"), *table(found, most)]
    more = len(found.candidates) - len(rows) + 1
    shown += ["", "One effect at a time on the refitted model, those of the verdict first; p-values are for all",
              "candidates together:", *columns(rows)]
    if more > 0:
        shown.append(f"and {more} more (ridelog diagnose --all)")
    if found.no_better:
        shown.append(paragraphs([f"No better than the numbers refitted: {', '.join(found.no_better)}."]))
    if hidden := untested(found):
        shown += ["", "What these runs cannot tell:", paragraphs(hidden, "- ")]
    return shown


def addition_lines(found: AddedEffects) -> list[str]:
    """What a person reads of an effect that was added."""
    rows = [("", "Error", "Fit", "")]
    rows += [(f"Error {which}:" if which else "", f"{error:.4f}", f"{fit_percent(error):.1f} %", what)
             for which, error, what in errors(found)]
    return [
        paragraphs(judgement(found)), "", *columns(rows), "",
        paragraphs([bias(found.names, found.moved)]), "",
        *columns([MOVED_HEADS, *moved_rows(found.moved)]), "", paragraphs([MOVED_HINT]),
    ]
