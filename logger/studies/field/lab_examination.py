"""The lab's examination: what it said of cars with a hidden effect, and how sure those shares are.

The counts are those of the last examination that was published. ``python -m tests.validation.examine`` writes them to
``examination.json`` beside this file, when it writes docs/examination.md.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

from logger.chart_data import Curves, Line
from logger.studies.checks import Word
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

COUNTS = Path(__file__).with_name("examination.json")
_SURE = 0.95


def examined() -> dict[str, Any]:
    """``{"first_seed", "last_seed", "cases", "asked", "release", "goals": [{"name", "goal", "at_least", "count",
    "of"}]}``; a goal is a share."""
    found: dict[str, Any] = json.loads(COUNTS.read_text("utf-8"))
    return found


def interval_percent(hits: int, cases: int) -> tuple[float, float]:
    """Wilson's interval of a share (Journal of the American Statistical Association 22, 1927) [%]."""
    z = float(ndtri(0.5 + _SURE / 2))
    share = hits / cases
    middle, half = share + z**2 / (2 * cases), z * np.sqrt(share * (1 - share) / cases + z**2 / (4 * cases**2))
    low, high = ((middle + sign * half) / (1 + z**2 / cases) for sign in (-1, 1))
    return float(100 * max(0.0, low)), float(100 * min(1.0, high))


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    counts = examined()
    rows, met, surely = [], 0, 0
    for goal in effort.each([one for one in counts["goals"] if one["of"]]):
        hits, cases, wanted, at_least = goal["count"], goal["of"], 100 * goal["goal"], goal["at_least"]
        low, high = interval_percent(hits, cases)
        share = 100 * hits / cases
        met += share >= wanted if at_least else share <= wanted
        surely += low >= wanted if at_least else high <= wanted
        rows.append((goal["name"], f"{'>=' if at_least else '<='} {wanted:.0f} %", f"{hits} of {cases}", share, low,
                     high))
    seeds = f"{'release' if counts['release'] else 'development'} seeds {counts['first_seed']} to {counts['last_seed']}"
    table = Table(f"Counts of the examination (printed in docs/examination.md), {seeds}", (
        Column("asked"), Column("goal"), Column("true of"), Column("share [%]", ".1f"), Column("at least [%]", ".1f"),
        Column("at most [%]", ".1f")), tuple(rows))
    verdict = (f"{counts['cases']} of {counts['asked']} cases were put before the lab, {seeds}, made by a simulator "
               f"that shares nothing with it. By their shares {met} of {len(rows)} goals are met; by the far end of "
               f"the 95 % interval, {surely} are. It is our own examination: nobody else has printed one, and as it "
               "takes hours it was not repeated here, so nothing is compared with a print.")
    at = np.arange(1.0, len(rows) + 1)
    shares, lows, highs = (np.array([row[place] for row in rows], dtype=np.float64) for place in (3, 4, 5))
    picture = Picture(Curves("Shares with their 95 % intervals", "row of the table", "cases [%]", (
        Line("share", at, shares, dots=True), Line("at least", at, lows, dots=True), Line("at most", at, highs,
                                                                                          dots=True))))
    return Result((table,), verdict, (picture,))


STUDY = Study(
    "lab_examination", "The lab's examination", "The table of goals",
    "Counts of cases as the last published examination had them; the intervals are computed from them.", run,
    items=(Item("the lab's examination", Word.NOT_REPRODUCIBLE,
                "It is our own, takes hours and was not repeated here; its counts are shown with their intervals."),),
    source="ridelog's own examination, docs/examination.md")
