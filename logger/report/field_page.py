"""The page of the loop in the field: from drives on a measured line to one that the new vehicle file judges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.chart_data import Array, Curves, Line
from logger.estimation.assessment import Assessment
from logger.lab.session import Story
from logger.report.charts import chart
from logger.report.diagnosis_page import falling
from logger.report.diagnosis_text import summary
from logger.report.document import bullets, document, grid, heading, hint, paragraphs, section, tiles
from logger.report.field_text import HEADS, IN_HINT, figures_of, rows
from logger.report.html import Html, concatenated
from logger.report.maps import Way, ways_map
from logger.report.session_text import ending, steps
from logger.report.story_page import residual_spectra


def page(title: str, about: Sequence[str], measured: Sequence[Way], driven: Sequence[Way], story: Story,
         before: Assessment, after: Assessment, answer: Sequence[str]) -> Html:
    """The whole of it as one HTML document.

    about             what the drives are, a paragraph each
    measured          lines that were measured, and ``driven`` the drives on them
    before, after     the road of a drive that the lab did not see, by the file as it was and by the last one
    answer            what is true, where that is known
    """
    return document(title, [
        heading(title, ", ".join(one.name for one in driven)),
        _tiles(story, before, after), paragraphs(about),
        section("The drives", ways_map(measured, driven) + hint(
            "Wide: what was measured. Dots: where the receiver saw the car, once a second.")),
        section("How the error fell", falling("Error of each model, on all samples", steps(story), story.floor)
                + paragraphs(ending(story))),
        section("What was missing", concatenated(paragraphs(summary(one)) for one in story.diagnoses[:1])),
        section("Before and after", residual_spectra(story)) if story.rounds else "",
        section("The IRI of a drive that the lab did not see", _iri(before, after)
                + grid(HEADS, rows(before, after), words=(0,)) + hint(IN_HINT)),
        section("The answer", bullets(answer)),
    ])


def _tiles(story: Story, before: Assessment, after: Assessment) -> Html:
    first, last = (figures_of(one)["comparison"] for one in (before, after))
    return tiles([
        ("IRI is off by, at first", f"{first['bias']:+.1%}", f"R2 {first['r2']:.2f}"),
        ("At last", f"{last['bias']:+.1%}", f"R2 {last['r2']:.2f}"),
        ("Error of the model, at first", f"{steps(story)[0][1]:.3f}", "as its file says"),
        ("At last", f"{steps(story)[-1][1]:.3f}", "refitted"),
    ])


def _iri(before: Assessment, after: Assessment) -> Html:
    exact = np.isfinite(after.exact_m_per_km)
    lines = (_line("at last", after, True), _line("at first", before, False),
             Line("truth", _middles_m(after)[exact], after.exact_m_per_km[exact]))
    return chart(Curves(f"In windows of {after.window_m:.4g} m, at last with its standard error",
                        "distance along the line [m]", "IRI [m/km]", lines))


def _line(name: str, one: Assessment, band: bool) -> Line:
    windows = one.windows
    known = np.isfinite(windows.iri_m_per_km)
    return Line(name, _middles_m(one)[known], windows.iri_m_per_km[known],
                windows.iri_std_m_per_km[known] if band else None)


def _middles_m(one: Assessment) -> Array:
    return np.asarray((one.windows.edges_m[1:] + one.windows.edges_m[:-1]) / 2)
