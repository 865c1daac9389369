"""The page of a comparison: where a model and measurements differ, in sentences, tables and pictures.

It opens with no network and runs no script.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.chart_data import Curves, Line, line
from logger.lab.compare import Comparison, Standing
from logger.lab.residuals.breakdown import ModelResiduals, Part, frequencies, segments
from logger.lab.residuals.force_state_map import Curve, ForceMap
from logger.report.charts import chart
from logger.report.comparison_text import conclusion, evidence, headline
from logger.report.document import bullets, document, grid, heading, hint, paragraphs, section, tiles
from logger.report.html import EMPTY, Html, concatenated, html
from logger.report.removed_text import drift_tile, removed_section
from logger.report.residual_text import error_text, paired
from logger.report.worst_moment import worst_moment
from logger.runs import short_names

Array = npt.NDArray[np.float64]

_BODY_HZ = 5.0
_QUIET_DB = -80.0
_MOST_RUNS = 8
_WORST = 8


def page(found: Comparison) -> Html:
    """The comparison as one HTML document."""
    residuals = found.refitted.residuals
    title = f"{found.vehicle}: model against measurement"
    return document(title, [
        heading(title, ", ".join(run.name for run in residuals.runs)), _tiles(found), paragraphs(headline(found)),
        section("After the refit", bullets(evidence(found)) + paragraphs([conclusion(found)])),
        removed_section(found.removed, found.band),
        whole_drives(residuals), _worst_place(found.refitted), spectra_section(residuals), _tables(found),
        _places(found.refitted),
        forces_section(found.tests.forces), _alignment(found), _tests(found), _numbers(found),
    ])


def _tiles(found: Comparison) -> Html:
    residuals = found.plain.residuals
    return tiles([("Error as the model stands", f"{found.plain.error:.3f}", ""),
                  ("Error after the refit", f"{found.steps[-1].error:.3f}", ""),
                  *drift_tile(found.removed),
                  ("Tests that find something", f"{len(found.tests_found)}", f"of {len(found.tests.tests)}"),
                  ("Runs", f"{len(residuals.runs)}", f"{sum(map(len, residuals.residual)) / residuals.rate_hz:.0f} s")])


# --- pictures ---


def whole_drives(residuals: ModelResiduals) -> Html:
    """What was measured and what the model leaves of it, over the whole of each run."""
    names, drawn = short_names(residuals.runs), []
    for index, run in enumerate(residuals.runs[:_MOST_RUNS]):
        time_s = (run.first + np.arange(len(residuals.residual[index]))) / residuals.rate_hz
        lines = tuple(line(word, time_s, values[index]) for word, values in (
            ("measured", residuals.measured), ("residual", residuals.residual)))
        drawn.append(chart(Curves(names[run.name], "time in the run [s]", "acceleration [m/s2]", lines)))
    return section("The whole drive", concatenated(drawn))


def _worst_place(standing: Standing) -> Html:
    residuals, worst = standing.residuals, worst_moment(standing)
    index, part = worst.run, worst.part
    time_s = (residuals.runs[index].first + np.arange(len(residuals.residual[index])))[part] / residuals.rate_hz
    lines = tuple(Line(name, time_s, values[index][part]) for name, values in (
        ("measured", residuals.measured), ("residual", residuals.residual), ("model", residuals.model)))
    return section("The worst place", chart(Curves(worst.words, "time in the run [s]", "acceleration [m/s2]", lines)))


def spectra_section(residuals: ModelResiduals) -> Html:
    """Spectra of measurement, model and residual."""
    return section("By frequency", concatenated(map(chart, spectra(residuals))))


def spectra(residuals: ModelResiduals) -> tuple[Curves, Curves]:
    """The charts of it: of the body, and of the wheels and above."""
    f_hz = frequencies(residuals)
    density = [np.mean(np.abs(segments(residuals, one)) ** 2, axis=0) / f_hz[1]
               for one in (residuals.measured, residuals.residual, residuals.model)]

    def drawn(title: str, low_hz: float, high_hz: float) -> Curves:
        inside = (f_hz >= max(low_hz, f_hz[1])) & (f_hz <= high_hz)
        return Curves(title, "frequency [Hz]", "power [dB of (m/s2)2/Hz]", tuple(
            Line(name, f_hz[inside], np.maximum(10 * np.log10(np.maximum(one[inside], 1e-30)), _QUIET_DB))
            for name, one in zip(("measured", "residual", "model"), density, strict=True)))

    return drawn("The body", 0.0, _BODY_HZ), drawn("Wheels and above", _BODY_HZ, f_hz[-1])


def _places(standing: Standing) -> Html:
    if not standing.where.place:
        return EMPTY
    lines, names = [], short_names(standing.residuals.runs)
    for run in standing.residuals.runs[:_MOST_RUNS]:
        parts = [part for part in standing.where.place if part.name == run.name]
        if len(parts) > 1:
            lines.append(Line(names[run.name], np.array([(part.low + part.high) / 2 for part in parts]),
                              np.array([part.residual_mps2 for part in parts])))
    along = Curves("Residual along the road", "distance [m]", "r.m.s. [m/s2]", tuple(lines))
    rows = [(names[part.name], f"{part.low:g} to {part.high:g}", f"{part.share:.1%}", f"{part.residual_mps2:.3g}",
             error_text(part, 2)) for part in standing.where.worst_places(_WORST)]
    return section("By place", (chart(along) if lines else EMPTY) + grid(
        ("Run", "From, to [m]", "Share of the residual", "Residual [m/s2]", "Error"), rows))


def forces_section(forces: ForceMap) -> Html:
    """The force that is missing in the suspensions, by speed and by travel."""
    drawn = concatenated(
        chart(Curves(title, x_name, "force [N]", (Line("missing force", curve.at * factor, curve.force_n,
                                                         errors=curve.error_n),), (0.0, "nothing missing")))
        for title, x_name, curve, factor in (
            (_titled("By speed of the suspensions", forces.by_rate), "extension rate [m/s]", forces.by_rate, 1.0),
            (_titled("By travel of the suspensions", forces.by_travel), "extension [mm]", forces.by_travel, 1000.0)))
    return section("The missing force", drawn + hint(
        "The force in each suspension that would explain the residual, with its standard error, in addition to a "
        "linear spring or damper. Above 0 it pulls body and wheel together; compression is on the left, extension on "
        "the right. Do not believe a curve that explains little of the residual."))


def _alignment(found: Comparison) -> Html:
    windows, runs = found.tests.alignment, found.plain.residuals.runs
    names = short_names(runs)
    lines = [Line(names[run.name], windows.along_m[of], windows.lag_s[of] * 1000, dots=True)
             for index, run in enumerate(runs[:_MOST_RUNS]) if (of := windows.run == index).any()]
    if not lines or all(run.timed for run in runs):
        return EMPTY
    drawn = chart(Curves("How far the model runs ahead of the measurement", "way into the run [m]", "time [ms]",
                           tuple(lines), (0.0, "together")))
    return section("Alignment", drawn + hint(
        "The same everywhere: a clock or a place that is off. Growing along the way: a wrong speed. As the model "
        "stands, before the refit."))


# --- tables ---


def _tables(found: Comparison) -> Html:
    plain, refitted = found.plain.where, found.refitted.where
    return (_table("By band", "Hz", plain.frequency, refitted.frequency)
            + (_table("By speed", "m/s", plain.speed, refitted.speed) if refitted.speed else EMPTY)
            + _table("By how strongly the road moves the car", "m/s2", plain.amplitude, refitted.amplitude))


def _table(title: str, unit: str, plain: Sequence[Part], refitted: Sequence[Part]) -> Html:
    """Shares and errors of both standings; the bounds of the parts are those of the refitted one."""
    pairs = paired(plain, refitted)
    named, stands = bool(refitted[0].name), any(one is not None for one, _ in pairs)

    def cells(one: Part | None, part: Part) -> Html:
        bar = html('<td class="bar"><span class="f0" style="width:{:.1%}"></span></td>', part.share)
        before = html("<td class=n>{}</td>", error_text(one, 3) if one else "") if stands else EMPTY
        return ((html("<td>{}</td>", part.name) if named else EMPTY)
                + html("<td class=n>{:.3g} to {:.3g}</td>", part.low, part.high) + bar
                + html("<td class=n>{:.1%}</td><td class=n>{}</td>", part.share, error_text(part, 3)) + before)

    heads = ((Html("<th>Band</th>") if named else EMPTY) + html("<th class=n>From, to [{}]</th>", unit)
             + Html("<th>Share of the residual</th><th></th><th class=n>Error</th>")
             + (Html("<th class=n>Before the refit</th>") if stands else EMPTY))
    rows = concatenated(html("<tr>{}</tr>", cells(one, part)) for one, part in pairs)
    return section(title, html('<div class="scroll"><table><tr>{}</tr>{}</table></div>', heads, rows))


def _tests(found: Comparison) -> Html:
    rows = [(test.name, _measured(test.value, test.unit), _measured(test.standard_error), _chance(test.p_value),
             "found" if test in found.tests_found else "") for test in found.tests.tests]
    return section("All tests of the residual", grid(("Test", "Value", "Standard error", "p-value", ""), rows,
                                                                words=(0, 4))
                   + hint("A test is found when it is improbable in noise and large enough to matter."))


def _numbers(found: Comparison) -> Html:
    rows = [(name, f"{move:+.1%}", "farther than usual" if name in found.far else "")
            for name, move in found.moves.items()]
    return section("What the refit moved", grid(("Number", "By", ""), rows, words=(0, 2)))


def _titled(title: str, curve: Curve) -> str:
    return f"{title}: would explain {curve.share:.0%} of the residual"


def _measured(value: float | None, unit: str = "1") -> str:
    """A number with its unit; nothing where it is not known."""
    if value is None or not np.isfinite(value):
        return ""
    return f"{value:.3g} {unit}" if unit != "1" else f"{value:.3g}"


def _chance(p_value: float) -> str:
    if not np.isfinite(p_value):
        return "cannot tell"
    return "below 1e-9" if p_value < 1e-9 else f"{p_value:.2g}"
