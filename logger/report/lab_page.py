"""The page of a comparison: where a model and measurements differ, in sentences, tables and pictures.

It opens with no network and runs no script; every text is escaped.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import numpy.typing as npt

from logger.lab.beside import Beside, Part, frequencies, paired, segments, short_names
from logger.lab.compare import Comparison, Standing, conclusion, evidence, headline
from logger.lab.force_map import Curve, ForceMap
from logger.lab.marks import worst_places
from logger.report.document import document, tiles
from logger.studies.pictures import picture
from logger.studies.study import Curves, Line

Array = npt.NDArray[np.float64]

_AROUND_S = 1.5
_BODY_HZ = 5.0
_QUIET_DB = -80.0
_MOST_RUNS = 8
_WORST = 8


def page(found: Comparison) -> str:
    """The comparison as one HTML document."""
    beside = found.refitted.beside
    title = f"{found.vehicle}: model against measurement"
    return document(title, [
        f"<h1>{escape(title)}</h1>", f'<p class="sub">{escape(", ".join(run.name for run in beside.runs))}</p>',
        _tiles(found), *(f"<p>{escape(line)}</p>" for line in headline(found)),
        f"<section><h2>After the refit</h2><ul>{''.join(f'<li>{escape(one)}</li>' for one in evidence(found))}</ul>"
        f"<p>{escape(conclusion(found))}</p></section>",
        _worst_place(found.refitted), spectra_section(beside), _tables(found), _places(found.refitted),
        forces_section(found.marks.forces), _alignment(found), _marks(found), _numbers(found),
    ])


def _tiles(found: Comparison) -> str:
    beside = found.plain.beside
    return tiles([("Error as the model stands", f"{found.plain.error:.3f}", ""),
                  ("Error after the refit", f"{found.refitted.error:.3f}", ""),
                  ("Marks found", f"{len(found.marks_found)}", f"of {len(found.marks.marks)}"),
                  ("Runs", f"{len(beside.runs)}", f"{sum(map(len, beside.left)) / beside.rate_hz:.0f} s")])


# --- pictures ---


def _worst_place(standing: Standing) -> str:
    beside, worst = standing.beside, worst_places(standing.where, 1)[0]
    index = next(i for i, run in enumerate(beside.runs) if run.name == worst.name)
    run, left = beside.runs[index], beside.left[index]
    at_m = run.distance_m[run.first:]
    inside = np.flatnonzero((at_m >= worst.low) & (at_m < worst.high))
    middle = int(inside[np.abs(left[inside]).argmax()])
    reach = round(_AROUND_S * beside.rate_hz)
    part = slice(max(0, middle - reach), middle + reach)
    time_s = (run.first + np.arange(len(left)))[part] / beside.rate_hz
    lines = tuple(Line(name, time_s, values[index][part]) for name, values in (
        ("measured", beside.measured), ("what is left", beside.left), ("model", beside.model)))
    title = f"{short_names(beside.runs)[run.name]}, around {at_m[middle]:.0f} m"
    drawn = picture(Curves(title, "time in the run [s]", "acceleration [m/s2]", lines))
    return f"<section><h2>The worst place</h2>{drawn}</section>"


def spectra_section(beside: Beside) -> str:
    """What was measured, what the model says and what is left, by frequency."""
    f_hz = frequencies(beside)
    density = [np.mean(np.abs(segments(beside, one)) ** 2, axis=0) / f_hz[1]
               for one in (beside.measured, beside.left, beside.model)]

    def drawn(title: str, low_hz: float, high_hz: float) -> str:
        inside = (f_hz >= max(low_hz, f_hz[1])) & (f_hz <= high_hz)
        return picture(Curves(title, "frequency [Hz]", "power [dB of (m/s2)2/Hz]", tuple(
            Line(name, f_hz[inside], np.maximum(10 * np.log10(np.maximum(one[inside], 1e-30)), _QUIET_DB))
            for name, one in zip(("measured", "what is left", "model"), density, strict=True))))

    return (f"<section><h2>By frequency</h2>{drawn('The body', 0.0, _BODY_HZ)}"
            f"{drawn('Wheels and above', _BODY_HZ, f_hz[-1])}</section>")


def _places(standing: Standing) -> str:
    lines, names = [], short_names(standing.beside.runs)
    for run in standing.beside.runs[:_MOST_RUNS]:
        parts = [part for part in standing.where.place if part.name == run.name]
        if len(parts) > 1:
            lines.append(Line(names[run.name], np.array([(part.low + part.high) / 2 for part in parts]),
                              np.array([part.left_mps2 for part in parts])))
    along = Curves("What is left along the road", "distance [m]", "r.m.s. [m/s2]", tuple(lines))
    drawn = picture(along) if lines else ""
    rows = "".join(f"<tr><td>{escape(names[part.name])}</td><td class=n>{part.low:g} to {part.high:g}</td>"
                   f"<td class=n>{part.share:.1%}</td><td class=n>{part.left_mps2:.3g}</td>"
                   f"<td class=n>{part.error_told(2)}</td></tr>" for part in worst_places(standing.where, _WORST))
    return (f'<section><h2>By place</h2>{drawn}<div class="scroll"><table><tr><th>Run</th><th class=n>From, to [m]</th>'
            "<th class=n>Share of what is left</th><th class=n>Left [m/s2]</th><th class=n>Error</th></tr>"
            f"{rows}</table></div></section>")


def forces_section(forces: ForceMap) -> str:
    """The force that is missing in the suspensions, by speed and by travel."""
    drawn = "".join(
        picture(Curves(title, x_name, "force [N]", (Line("missing force", curve.at * factor, curve.force_n,
                                                         errors=curve.error_n),), (0.0, "nothing missing")))
        for title, x_name, curve, factor in (
            (_titled("By speed of the suspensions", forces.by_rate), "extension rate [m/s]", forces.by_rate, 1.0),
            (_titled("By travel of the suspensions", forces.by_travel), "extension [mm]", forces.by_travel, 1000.0)))
    return (f'<section><h2>The missing force</h2>{drawn}<p class="hint">The force in each suspension that would leave '
            "what is left, with its standard error, beside what a straight spring or damper does. Above 0 it pulls "
            "body and wheel together; compression is left, extension right. A shape that explains little is not one to "
            "believe.</p></section>")


def _alignment(found: Comparison) -> str:
    windows, runs = found.marks.alignment, found.plain.beside.runs
    names = short_names(runs)
    lines = [Line(names[run.name], windows.along_m[of], windows.lag_s[of] * 1000, dots=True)
             for index, run in enumerate(runs[:_MOST_RUNS]) if (of := windows.run == index).any()]
    if not lines:
        return ""
    drawn = picture(Curves("How far the model runs ahead of the measurement", "way into the run [m]", "time [ms]",
                           tuple(lines), (0.0, "together")))
    return (f'<section><h2>Alignment</h2>{drawn}<p class="hint">The same everywhere: a clock or a place that is off. '
            "Growing along the way: a wrong speed. As the model stands, before the refit.</p></section>")


# --- tables ---


def _tables(found: Comparison) -> str:
    plain, refitted = found.plain.where, found.refitted.where
    return (_table("By band", "Hz", plain.frequency, refitted.frequency)
            + _table("By speed", "m/s", plain.speed, refitted.speed)
            + _table("By how strongly the road moves the car", "m/s2", plain.amplitude, refitted.amplitude))


def _table(title: str, unit: str, plain: Sequence[Part], refitted: Sequence[Part]) -> str:
    """Shares and errors of both standings; the bounds of the parts are those of the refitted one."""
    pairs = paired(plain, refitted)
    stands = any(one is not None for one, _ in pairs)

    def before(one: Part | None) -> str:
        return f"<td class=n>{one.error_told(3) if one else ''}</td>" if stands else ""

    rows = "".join(
        f"<tr>{f'<td>{escape(part.name)}</td>' if part.name else ''}<td class=n>{part.low:.3g} to {part.high:.3g}</td>"
        f'<td class="bar"><span class="f0" style="width:{part.share:.1%}"></span></td><td class=n>{part.share:.1%}</td>'
        f"<td class=n>{part.error_told(3)}</td>{before(one)}</tr>" for one, part in pairs)
    first = "<th>Band</th>" if refitted[0].name else ""
    return (f'<section><h2>{title}</h2><div class="scroll"><table><tr>{first}<th class=n>From, to [{unit}]</th>'
            "<th>Share of what is left</th><th></th><th class=n>Error</th>"
            f"{'<th class=n>Before the refit</th>' if stands else ''}</tr>{rows}</table></div></section>")


def _marks(found: Comparison) -> str:
    rows = "".join(
        f"<tr><td>{escape(mark.name)}</td><td class=n>{_measured(mark.value, mark.unit)}"
        f"</td><td class=n>{_measured(mark.standard_error)}</td>"
        f"<td class=n>{_chance(mark.p_value)}</td><td>{'found' if mark in found.marks_found else ''}</td></tr>"
        for mark in found.marks.marks)
    return ('<section><h2>All marks</h2><div class="scroll"><table><tr><th>Mark</th><th class=n>Value</th>'
            "<th class=n>Standard error</th><th class=n>Chance in noise</th><th></th></tr>"
            f'{rows}</table></div><p class="hint">A mark is found when it is improbable in noise and large enough to '
            "matter.</p></section>")


def _numbers(found: Comparison) -> str:
    rows = "".join(f"<tr><td>{escape(name)}</td><td class=n>{move:+.1%}</td>"
                   f"<td>{'farther than usual' if name in found.far else ''}</td></tr>"
                   for name, move in found.moves.items())
    return ('<section><h2>What the refit moved</h2><div class="scroll"><table><tr><th>Number</th><th class=n>By</th>'
            f"<th></th></tr>{rows}</table></div></section>")


def _titled(title: str, curve: Curve) -> str:
    return f"{title}: would explain {curve.share:.0%} of what is left"


def _measured(value: float | None, unit: str = "1") -> str:
    """A number with its unit; nothing where it is not known."""
    if value is None or not np.isfinite(value):
        return ""
    return escape(f"{value:.3g} {unit}" if unit != "1" else f"{value:.3g}")


def _chance(p_value: float) -> str:
    if not np.isfinite(p_value):
        return "cannot tell"
    return "below 1e-9" if p_value < 1e-9 else f"{p_value:.2g}"
