"""ISO 8041's saw-tooth bursts: the weighted r.m.s. that an instrument has to show."""

from math import inf

import numpy as np

from logger.chart_data import Curves, Line
from logger.dsp.weightings.wd import WEIGHTING as WD
from logger.dsp.weightings.wk import WEIGHTING as WK
from logger.studies.checks import Value, Word
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

TEETH = (1, 2, 4, 8, 16, inf)
PRINTED_MPS2 = {"wk": (0.0299, 0.0411, 0.0577, 0.0814, 0.115, 0.362),
                "wd": (0.00669, 0.00906, 0.0116, 0.0148, 0.0197, 0.0590)}
_SHARE = {"wk": 0.0025, "wd": 0.015}
"""Of the printed value: three figures are printed, and Wd passes little of a burst."""
_LENGTH_S, _EVERY_S, _PERIOD_S = 60, 10.0, 2 * np.pi / 100
_RATE_HZ = 20_000


def saw_teeth(teeth: float) -> np.ndarray:
    """The bursts [m/s2]: so many teeth of 1 m/s2 every 10 s, rising from 0."""
    t_s = np.arange(_RATE_HZ * _LENGTH_S) / _RATE_HZ
    phase = (t_s if teeth == inf else t_s % _EVERY_S) / _PERIOD_S
    return np.where(phase < teeth, 2 * ((phase + 0.5) % 1.0) - 1.0, 0.0)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    rows, values = [], []
    found: dict[str, list[float]] = {"wk": [], "wd": []}
    for number, teeth in enumerate(effort.each(TEETH)):
        wave = saw_teeth(teeth)
        words = "continuous" if teeth == inf else f"{teeth:g} in 10 s"
        for name, weighting in (("wk", WK), ("wd", WD)):
            printed = PRINTED_MPS2[name][number]
            ours = float(np.sqrt(np.mean(weighting.weigh(wave, _RATE_HZ) ** 2)))
            found[name].append(ours)
            rows.append((words, name, printed, ours, ours / printed - 1))
            values.append(Value(f"{name}, {words} [m/s2]", printed, ours, _SHARE[name] * printed))
    table = Table("Bursts, weighted r.m.s.", (
        Column("teeth"), Column("weighting"), Column("printed [m/s2]", ".5f"), Column("ours [m/s2]", ".5f"),
        Column("off by", "+.2%")), tuple(rows))
    worst = {name: max(abs(row[4]) for row in rows if row[1] == name) for name in found}
    verdict = (f"Wk agrees within {worst['wk']:.2%}, Wd within {worst['wd']:.2%}. The weighting is the formula of the "
               "standard itself on the whole record; a plain bilinear transform at 100 Hz is off by more above 8 Hz.")
    at = np.array(TEETH[:-1], dtype=float)
    lines = [Line(f"{name}, {who}", at, np.array(one[:-1]), dots=who == "printed") for name in found
             for who, one in (("ours", found[name]), ("printed", PRINTED_MPS2[name]))]
    picture = Picture(Curves("Weighted r.m.s. of bursts by their teeth", "teeth in 10 s", "weighted r.m.s. [m/s2]",
                             tuple(lines), log_x=True, log_y=True),
                      "a table of responses to bursts of 1 to 16 teeth, and to teeth without end")
    return Result((table,), verdict, (picture,), tuple(values))


STUDY = Study(
    "iso_8041_bursts", "Weighted r.m.s. of saw-tooth bursts", "Response to signal bursts",
    "Saw teeth of 1 m/s2 with a period of 2 pi/100 s, for 60 s, at 20,000 samples a second.", run,
    items=(Item("ISO 8041 bursts", Word.AGREES,
                "Wk agrees within 0.25 % and Wd within 1.5 % of the printed three figures."),),
    source="ISO 8041:2005, Human response to vibration: measuring instrumentation")
