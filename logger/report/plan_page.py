"""The page of a plan: which effects drives could show and distinguish, and which drive would add most."""

from __future__ import annotations

import numpy as np

from logger.lab.planning.outlook import ISOLABLE_SIGMA
from logger.lab.planning.plan import Plan
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.report.document import bullets, document, grid, heading, hint, paragraphs, section, tiles
from logger.report.heat_map import heat_map
from logger.report.html import EMPTY, Html
from logger.report.plan_text import GAIN_HINT, HEADS, SENSOR_HINT, do_words, meaning, number, rows, summary

_FULL = 100.0  # deviations that are drawn as dark as any


def page(found: Plan, vehicle: str) -> Html:
    """The plan as one HTML document."""
    title = f"{vehicle}: what these drives could show"
    chances = found.now.chances
    return document(title, [
        heading(title, ", ".join(f"{name}, {seconds:.0f} s" for name, seconds in found.drives)),
        tiles([("Effects that could be named", f"{int((chances > 0.5).sum())}", f"of {len(found.names)}"),
               ("Too faint", f"{int((found.now.detectability < DETECTABLE_SIGMA).sum())}", ""),
               ("Groups that cannot be separated", f"{len(found.groups)}", ""),
               ("Noise", f"{found.noise.variance**0.5:.3g}", "m/s2")]),
        paragraphs(summary(found)),
        section("What remains of one effect when another is fitted", figure(found) + hint(meaning())),
        section("Each effect", grid(HEADS, rows(found), words=(0, 3, 4))),
        section("What a next drive would add", _next(found)),
        section("Where this is from", bullets([
            "G. Cowan, K. Cranmer, E. Gross, O. Vitells, European Physical Journal C 71, 1554 (2011): what is expected "
            "to be found, from one data set without noise."])),
    ])


def figure(found: Plan) -> Html:
    """The matrix: each row an effect that is there; in its own column how far it stands out, in the others what remains
    when that one is fitted in its place. Those that stand out most first."""
    order = np.argsort(-found.now.detectability, kind="stable")
    return heat_map("Standard deviations that remain of the effect of a row when that of a column is fitted in its "
                    "place; framed: by how much it stands out",
                    [found.names[one] for one in order], found.now.pairwise[np.ix_(order, order)],
                    ISOLABLE_SIGMA, _FULL)


def _next(found: Plan) -> Html:
    """Nothing where there is none."""
    if not found.next:
        return EMPTY
    drawn = grid(("Drive", "Effects more", "Better separated, in standard deviations"), [
        (do_words(one.option), f"{one.more_named:.1f}",
         ", ".join(f"{name} {number(each)}" for name, each in list(one.gains.items())[:6])) for one in found.next],
        words=(0, 2))
    return drawn + hint(f"{GAIN_HINT} {SENSOR_HINT}")
