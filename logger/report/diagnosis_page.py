"""The page of a diagnosis: what is missing, how certain that is, and the shape of what no effect explains."""

from __future__ import annotations

from collections.abc import Sequence

from logger.chart_data import Curves, Line
from logger.lab.diagnosis import Diagnosis
from logger.lab.unexplained import Shape
from logger.lab.verdict import Verdict, floor_where_judged, looks_like, summary, table, untested
from logger.report.charts import Steps, chart, steps_figure
from logger.report.document import bullets, document, grid, heading, hint, paragraphs, section, tiles
from logger.report.html import EMPTY, Html
from logger.report.lab_page import forces_section, spectra_section

_LEAST_SHARE = 0.01


def page(found: Verdict, vehicle: str) -> Html:
    """The diagnosis as one HTML document."""
    title = f"{vehicle}: which effect is missing"
    runs = found.diagnosis.problem.runs.runs
    return document(title, [
        heading(title, ", ".join(run.name for run in runs)),
        _tiles(found), paragraphs(summary(found)), shape_sections(found),
        section("How the error fell", _steps(found.diagnosis)), section("All candidates", _candidates(found)),
        section("What these runs cannot tell", bullets(untested(found))),
        section("Where this is from", bullets(sources(found))),
    ])


def sources(found: Verdict) -> list[str]:
    """What to cite for the effects that are missing."""
    return [f"{one.effect.name}: {one.effect.source}" for one in found.missing]


def shape_sections(found: Verdict) -> Html:
    """What no candidate explains: sentences and pictures; nothing where nothing is unexplained."""
    if found.shape is None:
        return EMPTY
    return (section("What no effect explains", bullets(looks_like(found)))
            + section("Where it sits", _where(found.shape)) + spectra_section(found.shape.beside)
            + _forces(found.shape))


def _forces(shape: Shape) -> Html:
    """The missing force; a sentence where no force in the suspensions would do."""
    forces = shape.marks.forces
    if max(forces.by_rate.share, forces.by_travel.share) < _LEAST_SHARE:
        return section("The missing force", paragraphs([
            "No force in the suspensions that goes with their speed or travel would explain it: it comes from "
            "elsewhere."]))
    return forces_section(forces)


def _tiles(found: Verdict) -> Html:
    diagnosis = found.diagnosis
    floor, missing = diagnosis.noise_floor_error, len(diagnosis.verdict)
    count = "nothing" if not missing else f"{missing} effect{'s' * (missing != 1)}"
    unknown = "something unknown" if not missing else f"{count}, and more"
    return tiles([
        ("Error of the model as it stands", f"{diagnosis.baseline_error:.3f}", "as recorded"),
        ("With what is missing" if missing else "With its numbers refitted",
         f"{diagnosis.problem.error(diagnosis.after):.3f}", "refitted"),
        ("The sensor's noise alone", "not known" if floor is None else f"{floor:.3f}", ""),
        ("Missing", unknown if diagnosis.unexplained else count, ""),
    ])


def _steps(diagnosis: Diagnosis) -> Html:
    drawn = falling(f"Error on {diagnosis.judged_on}", [(step.words, step.error) for step in diagnosis.steps],
                    floor_where_judged(diagnosis))
    rows = [(f"{number}", step.words, f"{step.error:.4f}") for number, step in enumerate(diagnosis.steps)]
    return drawn + grid(("Step", "Model", "Error"), rows, words=(0, 1))


def falling(title: str, steps: Sequence[tuple[str, float]], floor: float | None) -> Html:
    """The error of each step as a falling curve, down to the noise."""
    return steps_figure(Steps(title, "error", tuple(steps), None if floor is None else (floor, "noise alone")))


def _candidates(found: Verdict) -> Html:
    return (grid(("Effect", "Error", "Chance in noise", "Numbers"), table(found), words=(0, 3))
            + hint("Each tried alone on the model of its round, those of the verdict first, then the least likely to "
                   f"be chance. The error is on {found.diagnosis.judged_on}; the chance holds for all candidates "
                   "together."))


def _where(shape: Shape) -> Html:
    """By frequency, and along the way."""
    rows = [(part.name, f"{part.low:.3g} to {part.high:.3g}", f"{part.share:.1%}", part.error_told(2))
            for part in shape.where.frequency]
    drawn = grid(("Band", "Hz", "Share of what is left", "Error"), rows)
    if shape.turns is not None and shape.turns.found:
        drawn += chart(Curves(f"What repeats along the way, in {shape.turns.run}", "times per metre",
                                "power over its mean", (Line("what is left", shape.turns.per_m, shape.turns.power),)))
    return drawn
