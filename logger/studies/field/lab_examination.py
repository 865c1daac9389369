"""The lab's examination: what it said of cars with a hidden effect, and how sure those shares are."""

import numpy as np
from scipy.special import ndtri

from logger.chart_data import Curves, Line
from logger.studies.study import Column, Effort, Result, Study, Table, Value, Word

SEEDS = "7300 to 7358"
PRINTED = (
    ("one effect: right first, or named as what cannot be told from it", 54, 59, 82.0, 96.0, ">= 90 %"),
    ("nothing missing: anything said to be missing", 0, 28, 0.0, 12.0, "<= 5 %"),
    ("two effects: both named", 24, 26, 76.0, 98.0, ">= 75 %"),
    ("off the list: unexplained", 20, 20, 84.0, 100.0, ">= 80 %"),
    ("distances that wander: rightly, nothing unexplained", 21, 21, 85.0, 100.0, ">= 80 %"),
    ("error after adding: within 10 % of the noise floor", 77, 77, 95.0, 100.0, ">= 85 %"),
    ("numbers after adding: within 10 % or three standard errors", 76, 77, 93.0, 100.0, ">= 85 %"),
)
"""What was asked, cases of which it is true, cases, the ends of the 95 % interval [%], the goal."""
_SURE = 0.95
_ROUNDING = 0.5


def interval_percent(hits: int, cases: int) -> tuple[float, float]:
    """Wilson's interval of a share (Journal of the American Statistical Association 22, 1927) [%]."""
    z = float(ndtri(0.5 + _SURE / 2))
    share = hits / cases
    middle, half = share + z**2 / (2 * cases), z * np.sqrt(share * (1 - share) / cases + z**2 / (4 * cases**2))
    low, high = ((middle + sign * half) / (1 + z**2 / cases) for sign in (-1, 1))
    return float(100 * max(0.0, low)), float(100 * min(1.0, high))


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    rows, values = [], []
    for name, hits, cases, low, high, goal in effort.each(PRINTED):
        ends = interval_percent(hits, cases)
        rows.append((name, f"{hits} of {cases}", 100 * hits / cases, goal, *ends))
        values += [Value(f"{name.split(':')[0]}, {words} end [%]", printed, ours, _ROUNDING)
                   for words, printed, ours in zip(("lower", "upper"), (low, high), ends, strict=True)]
    table = Table(f"Printed shares, release seeds {SEEDS}", (
        Column("asked"), Column("printed"), Column("share [%]", ".1f"), Column("goal"), Column("at least [%]", ".1f"),
        Column("at most [%]", ".1f")), tuple(rows))
    verdict = (f"154 of 200 cases were put before the lab, of release seeds {SEEDS} that its development never used, "
               "made by a simulator that shares nothing with it. Every goal is met by the share; by the far end of its "
               "interval only some are, and that nothing is said where nothing is missing is sure to 12 % alone. Shown "
               "are counts of that examination; it takes hours, and was not repeated here.")
    at = np.arange(1.0, len(rows) + 1)
    shares, lows, highs = (np.array([row[place] for row in rows], dtype=np.float64) for place in (2, 4, 5))
    picture = Curves("Shares with their 95 % intervals", "row of the table", "cases [%]", (
        Line("share", at, shares, dots=True), Line("at least", at, lows, dots=True), Line("at most", at, highs,
                                                                                          dots=True)))
    return Result((table,), verdict, (picture,), tuple(values))


STUDY = Study(
    "lab_examination", "The lab's examination", "The table of goals",
    "Counts of cases as the examination's report had them for these seeds; the intervals are computed anew.", run,
    covers=("the lab's examination",), word=Word.AGREES,
    because="The intervals of the printed counts agree; the examination itself was not repeated.",
    source="ridelog's docs/examination.md, release seeds 7300 to 7358")
