"""Fig 2.18 and 2.19: the curves of the six frequency weightings, and what Eq 2.16 does as printed (2.3.4.1).

The factors of ISO 2631-1 are an outside measure of the principal weightings. Of the additional ones the right sides of
Eq 2.13 to 2.15, worked out here from the printed Table 2.8, stand beside ours.
"""

from dataclasses import replace
from math import inf, sqrt

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.checks import Value, Word, about
from logger.studies.dissertation.table_2_7 import PRINTED, WD, WF, WK
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINCIPAL, ADDITIONAL = ("wk", "wd", "wf"), ("wc", "we", "wj")
STANDARD = ((WK, ((1.0, 0.482), (4.0, 0.967), (8.0, 1.036), (31.5, 0.405))),
            (WD, ((1.0, 1.011), (4.0, 0.512), (31.5, 0.0632))),
            (WF, ((0.1, 0.695), (0.16, 1.006), (0.4, 0.384))))
"""Factors of ISO 2631-1 Table 3 at frequencies [Hz]; the dissertation prints the curves only."""
_LAST_DIGIT = 0.001
_AT_HZ = 1.0
_ADDITIONAL_HZ = (0.5, 4.0, 20.0)
_SAME = 1e-6  # of the factor: the formulas are the same but for how they are written


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    principal = about("Fig 2.18", [
        Value(f"{weighting.name} at {f_hz:g} Hz (ISO 2631-1)", factor, float(abs(weighting.response(f_hz))),
              0.75 * _LAST_DIGIT) for weighting, factors in STANDARD for f_hz, factor in factors])
    additional = about("Fig 2.19", [
        Value(f"{weighting.name} at {f_hz:g} Hz (Eq 2.13 to 2.15)", by_eq, ours, _SAME * by_eq)
        for weighting, parameters in PRINTED if weighting.name in ADDITIONAL for f_hz in _ADDITIONAL_HZ
        for by_eq, ours in [(_by_printed_equations(f_hz, parameters), float(abs(weighting.response(f_hz))))]])
    # The right side of Eq 2.16 has f5 and Q5 above and below the line, so it is Q6 / Q5 at all frequencies.
    as_printed = replace(WK, f5_hz=inf, q5=1.0, f6_hz=inf, q6=1.0, gain=WK.q6 / WK.q5)
    misprint = about("Eq 2.16", [Value(f"wk at {_AT_HZ:g} Hz, by Eq 2.16 as printed", float(abs(as_printed.response(
        _AT_HZ))), float(abs(WK.response(_AT_HZ))), 0.1, Word.MISPRINT)])
    f_hz = np.geomspace(0.02, 400.0, effort.count(400, 60))
    levels = {weighting.name: 20 * np.log10(np.abs(weighting.response(f_hz)))
              for weighting, _ in effort.each(PRINTED)}
    rows = tuple((name, float(f_hz[level.argmax()]), float(level.max()),
                  float(f_hz[level > level.max() - 3].min()), float(f_hz[level > level.max() - 3].max()))
                 for name, level in levels.items())
    table = Table("The curves (printed as pictures only)", (
        Column("weighting"), Column("largest at [Hz]", ".3g"), Column("there [dB]", "+.2f"),
        Column("within 3 dB of it from [Hz]", ".3g"), Column("to [Hz]", ".3g")), rows)
    verdict = ("The curves meet the standard's factors to the printed digit. Eq 2.16 does not: its right side has f5 "
               "and Q5 in the denominator, too, and is then 1 at all frequencies, which would make Wk at 1 Hz twice "
               "as large; f6 and Q6 belong there. The text says of the printed figures only that they have amplitude "
               "against frequency; here Wk is level at half its height about 1 Hz and highest at 6 Hz, Wd is highest "
               "at 1 Hz and Wf at 0.17 Hz.")
    pictures = tuple(Picture(Curves(title, "frequency [Hz]", "factor [dB]", tuple(
        Line(name, f_hz[levels[name] > -60], levels[name][levels[name] > -60]) for name in names), log_x=True),
        f"amplitude by frequency of the {printed}") for title, names, printed in (
            ("Principal weightings (Fig 2.18)", PRINCIPAL, "three principal weightings Wk, Wd and Wf"),
            ("Additional weightings (Fig 2.19)", ADDITIONAL, "three additional weightings Wc, We and Wj")))
    return Result((table,), verdict, pictures, (*principal, *additional, *misprint))


def _by_printed_equations(f_hz: float, parameters: tuple[float | None, ...]) -> float:
    """The right sides of Eq 2.13 to 2.15 multiplied, and of an upward step that of Eq 2.16 with f6 and Q6 below the
    line; parameters as in Tables 2.7 and 2.8."""
    f1, f2, f3, f4, q4, f5, q5, f6, q6 = (inf if one is None else one for one in parameters)
    found = sqrt(f_hz**4 / (f_hz**4 + f1**4)) * sqrt(f2**4 / (f_hz**4 + f2**4))
    if f4 < inf:
        found *= (1.0 if f3 == inf else sqrt((f_hz**2 + f3**2) / f3**2)) / _second_order(f_hz, f4, q4)
    if f5 < inf:
        found *= (f5 / f6) ** 2 * _second_order(f_hz, f5, q5) / _second_order(f_hz, f6, q6)
    return float(found)


def _second_order(f_hz: float, corner_hz: float, q: float) -> float:
    ratio = (f_hz / corner_hz) ** 2
    return sqrt(ratio**2 + ratio * (1 / q**2 - 2) + 1)


STUDY = Study("fig_2_18", "Curves of the six frequency weightings", "Fig 2.18, section 2.3.4.1",
              "The magnitude of the formulas of ISO 2631-1 Annex A, as ridelog weighs whole records.", run,
              items=(Item("Fig 2.18", Word.AGREES,
                          "The principal weightings have the standard's factors to the printed digit."),
                     Item("Fig 2.19", Word.AGREES,
                          "The additional weightings are those of Eq 2.13 to 2.15 with the parameters of Table 2.8."),
                     Item("Eq 2.16", Word.MISPRINT,
                          "Its right side has f5 and Q5 where the denominator needs f6 and Q6, and is then the same "
                          "at all frequencies.")))
