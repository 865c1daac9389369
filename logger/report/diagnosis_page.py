"""The page of a diagnosis: what is missing, how certain that is, and the shape of what no effect explains."""

from __future__ import annotations

from collections.abc import Sequence

from logger.chart_data import Bars, Curves, Line
from logger.lab.diagnosis import Diagnosis
from logger.lab.residuals.fitted_laws import RATE, TRAVEL, ForceCurve
from logger.lab.residuals.unexplained import Shape
from logger.lab.selection.error_scale import JUDGED_ON
from logger.report.charts import Steps, chart, steps_figure
from logger.report.diagnosis_text import looks_like, summary, table, untested
from logger.report.document import bullets, document, grid, heading, hint, paragraphs, section, tiles
from logger.report.html import EMPTY, Html, concatenated
from logger.report.lab_page import forces_section, spectra_section
from logger.report.removed_text import drift_tile, removed_section
from logger.report.residual_text import error_text

_LEAST_SHARE, _MOST_BARS = 0.01, 12
_MOTION_UNITS = {RATE: "m/s", TRAVEL: "m"}


def page(found: Diagnosis, vehicle: str) -> Html:
    """The diagnosis as one HTML document."""
    title = f"{vehicle}: which effect is missing"
    return document(title, [
        heading(title, ", ".join(found.runs)),
        _tiles(found), paragraphs(summary(found)), removed_section(found.removed, found.band), shape_sections(found),
        section("How the error fell", _steps(found)), car_sections(found),
        section("All candidates", _candidates(found)),
        section("What these runs cannot tell", bullets(untested(found))),
        section("Where this is from", bullets(sources(found))),
    ])


def sources(found: Diagnosis) -> list[str]:
    """What to cite for the effects that are missing."""
    return [f"{one.effect.name}: {one.effect.source}" for one in found.missing]


def shape_sections(found: Diagnosis) -> Html:
    """What no candidate explains: sentences and pictures; nothing where nothing is unexplained."""
    if found.shape is None:
        return EMPTY
    return (section("What no effect explains", bullets(looks_like(found)))
            + section("Where it sits", _where(found.shape)) + spectra_section(found.shape.residuals)
            + _forces(found.shape))


def _forces(shape: Shape) -> Html:
    """The missing force; a sentence where no force in the suspensions would do."""
    forces = shape.tests.forces
    if max(forces.by_rate.share, forces.by_travel.share) < _LEAST_SHARE:
        return section("The missing force", paragraphs([
            "No force in the suspensions that goes with their speed or travel would explain it: it comes from "
            "elsewhere."]))
    return forces_section(forces)


def _tiles(found: Diagnosis) -> Html:
    missing = len(found.verdict)
    count = "nothing" if not missing else f"{missing} effect{'s' * (missing != 1)}"
    unknown = "something unknown" if not missing else f"{count}, and more"
    return tiles([
        ("Error of the model as it stands", f"{found.baseline_error:.3f}", "as recorded"),
        ("With what is missing" if missing else "With its numbers refitted", f"{found.final_error:.3f}", "refitted"),
        *drift_tile(found.removed),
        ("The sensor's noise alone", f"{found.noise_floor_error:.3f}", ""),
        ("Missing", unknown if found.unexplained else count, ""),
    ])


def _steps(found: Diagnosis) -> Html:
    drawn = falling(f"Error on {JUDGED_ON}", [(step.words, step.error) for step in found.steps],
                    found.noise_floor_error)
    rows = [(f"{number}", step.words, f"{step.error:.4f}") for number, step in enumerate(found.steps)]
    return drawn + grid(("Step", "Model", "Error"), rows, words=(0, 1))


def falling(title: str, steps: Sequence[tuple[str, float]], floor: float) -> Html:
    """The error of each step as a falling curve, down to the noise."""
    return steps_figure(Steps(title, "error", tuple(steps), (floor, "noise alone")))


def _candidates(found: Diagnosis) -> Html:
    bars = Bars("The error with each candidate", "error", tuple(
        (one.effect.name, one.error) for one in found.candidates[:_MOST_BARS]),
        (found.baseline_error, "as it stands"))
    return (chart(bars) + grid(("Effect", "Error", "p-value", "Numbers"), table(found), words=(0, 3))
            + hint("One effect at a time on the refitted model, those that are missing first, then by p-value: how "
                   "probable it is that noise looks like any of the candidates. The error is on "
                   f"{JUDGED_ON}."))


def car_sections(found: Diagnosis) -> Html:
    """How far the car's numbers moved, as bars, and the forces of its springs and dampers as fitted, as curves."""
    if found.car is None:
        return EMPTY
    bars = Bars("How far each number was refitted", "% of the file's value", tuple(
        (name, 100 * share) for name, (share, _) in found.car.moved.items()))
    rows = [(name, f"{share:+.1%}", f"± {tolerance:.1%}", "more than it should" if name in found.beyond else "")
            for name, (share, tolerance) in found.car.moved.items()]
    numbers = chart(bars) + grid(("Number", "Refitted by", "Usual", ""), rows, words=(0, 3)) + hint(
        "A number that has to move far may stand in for an effect that is not among the candidates.")
    curves = concatenated(map(_force, found.car.curves))
    said = hint("Over what the model's suspensions reach in these runs, but for 0.1 % of the time. Forces with a "
                "memory are not in it.") if curves else EMPTY
    return (section("The car's own numbers", numbers if rows else EMPTY)
            + section("Its springs and dampers", curves + said))


def _force(one: ForceCurve) -> Html:
    return chart(Curves(
        f"{one.axle.capitalize()} suspension by its {one.motion}",
        f"{one.motion} [{_MOTION_UNITS[one.motion]}], positive in extension", "force [N]",
        (Line("as fitted", one.at, one.after_n), Line("as the file says", one.at, one.before_n))))


def _where(shape: Shape) -> Html:
    """By frequency, and along the way."""
    rows = [(part.name, f"{part.low:.3g} to {part.high:.3g}", f"{part.share:.1%}", error_text(part, 2))
            for part in shape.where.frequency]
    drawn = grid(("Band", "Hz", "Share of the residual", "Error"), rows)
    if shape.line is not None and shape.line.found:
        drawn += chart(Curves(f"What repeats along the way, in {shape.line.run}", "times per metre",
                                "power over its mean", (Line("residual", shape.line.per_m, shape.line.power),)))
    return drawn
