"""Fig 2.18 and 2.19: the curves of the six frequency weightings, and what Eq 2.16 does as printed (2.3.4.1)."""

from dataclasses import replace
from math import inf

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.dissertation.table_2_7 import PRINTED, WD, WF, WK
from logger.studies.study import Column, Effort, Result, Study, Table, Value, Word

PRINCIPAL, ADDITIONAL = ("wk", "wd", "wf"), ("wc", "we", "wj")
STANDARD = ((WK, ((1.0, 0.482), (4.0, 0.967), (8.0, 1.036), (31.5, 0.405))),
            (WD, ((1.0, 1.011), (4.0, 0.512), (31.5, 0.0632))),
            (WF, ((0.1, 0.695), (0.16, 1.006), (0.4, 0.384))))
"""Factors of ISO 2631-1 Table 3 at frequencies [Hz]; the dissertation prints the curves only."""
_LAST_DIGIT = 0.001
_AT_HZ = 1.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    values = [Value(f"{weighting.name} at {f_hz:g} Hz (ISO 2631-1)", factor, float(abs(weighting.response(f_hz))),
                    0.75 * _LAST_DIGIT) for weighting, factors in STANDARD for f_hz, factor in factors]
    # The right side of Eq 2.16 has f5 and Q5 above and below the line, so it is Q6 / Q5 at all frequencies.
    as_printed = replace(WK, f5_hz=inf, q5=1.0, f6_hz=inf, q6=1.0, gain=WK.q6 / WK.q5)
    values.append(Value(f"wk at {_AT_HZ:g} Hz, by Eq 2.16 as printed", float(abs(as_printed.response(_AT_HZ))),
                        float(abs(WK.response(_AT_HZ))), 0.1, Word.MISPRINT))
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
    pictures = tuple(Curves(title, "frequency [Hz]", "factor [dB]", tuple(
        Line(name, f_hz[levels[name] > -60], levels[name][levels[name] > -60]) for name in names), log_x=True)
        for title, names in (("Principal weightings (Fig 2.18)", PRINCIPAL),
                             ("Additional weightings (Fig 2.19)", ADDITIONAL)))
    return Result((table,), verdict, pictures, tuple(values))


STUDY = Study("fig_2_18", "Curves of the six frequency weightings", "Fig 2.18, section 2.3.4.1",
              "The magnitude of the formulas of ISO 2631-1 Annex A, as ridelog weighs whole records.", run,
              covers=("Fig 2.18", "Fig 2.19"), word=Word.MISPRINT,
              because="The curves agree; the right side of Eq 2.16 has f5 and Q5 where its denominator needs f6 and "
                      "Q6.")
