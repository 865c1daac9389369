"""Tables 2.7 and 2.8: the parameters of the six frequency weightings (2.3.4.1)."""

from math import inf, isfinite

from logger.dsp.weightings.wc import WEIGHTING as WC
from logger.dsp.weightings.wd import WEIGHTING as WD
from logger.dsp.weightings.we import WEIGHTING as WE
from logger.dsp.weightings.weighting import Weighting
from logger.dsp.weightings.wf import WEIGHTING as WF
from logger.dsp.weightings.wj import WEIGHTING as WJ
from logger.dsp.weightings.wk import WEIGHTING as WK
from logger.studies.checks import Value, Word, about
from logger.studies.study import Cell, Column, Effort, Item, Result, Study, Table

NAMES = ("f1", "f2", "f3", "f4", "Q4", "f5", "Q5", "f6", "Q6")
PRINTED: tuple[tuple[Weighting, tuple[float | None, ...]], ...] = (
    (WK, (0.4, 100, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91)),
    (WD, (0.4, 100, 2.0, 2.0, 0.63, inf, None, inf, None)),
    (WF, (0.08, 0.63, inf, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80)),
    (WC, (0.4, 100, 8.0, 8.0, 0.63, inf, None, inf, None)),
    (WE, (0.4, 100, 1.0, 1.0, 0.63, inf, None, inf, None)),
    (WJ, (0.4, 100, inf, inf, None, 3.75, 0.91, 5.32, 0.91)),
)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    rows: list[tuple[Cell, ...]] = []
    values: list[Value] = []
    for weighting, printed in effort.each(PRINTED):
        ours = (weighting.f1_hz, weighting.f2_hz, weighting.f3_hz, weighting.f4_hz, weighting.q4, weighting.f5_hz,
                weighting.q5, weighting.f6_hz, weighting.q6)
        for name, said, mine in zip(NAMES, printed, ours, strict=True):
            unit = "" if name.startswith("Q") else " [Hz]"
            if said is not None and isfinite(said):
                table = "Table 2.7" if weighting in (WK, WD, WF) else "Table 2.8"
                values += about(table, [Value(f"{weighting.name}, {name}{unit}", said, mine, 0.0)])
            else:
                rows.append((weighting.name, name, "infinite" if said else "none",
                             "without effect" if said is None else "infinite" if mine == inf else f"{mine:g}"))
    absent = Table("Parts that a weighting does not have", (
        Column("weighting"), Column("parameter"), Column("printed"), Column("ours")), tuple(rows))
    verdict = (f"All {len(values)} finite parameters agree, and the parts that the tables leave out, by an infinite "
               "frequency, are left out here. What the formula does with them is in fig-2-18.")
    return Result((absent,), verdict, (), tuple(values))


STUDY = Study("table_2_7", "Parameters of the six frequency weightings", "Table 2.7, section 2.3.4.1",
              "Ridelog's weightings, each as its file has it, parameter by parameter.", run,
              items=(Item("Table 2.7", Word.AGREES, "Every parameter of Wk, Wd and Wf agrees."),
                     Item("Table 2.8", Word.AGREES, "Every parameter of Wc, We and Wj agrees.")))
