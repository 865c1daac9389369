"""A result of a command as a page that stands alone: its words and its charts."""

from __future__ import annotations

from collections.abc import Sequence

from logger.chart_data import Chart
from logger.report.charts import chart
from logger.report.document import document, heading, section
from logger.report.html import Html, concatenated, html

_COLUMN_GAP = "  "


def page(title: str, of: str, text: str, charts: Sequence[Chart]) -> Html:
    """The page.

    of      what it is a result of, such as a file
    text    what the command prints
    """
    return document(f"{title}: {of}", [
        heading(title, of), *map(_part, text.split("\n\n")),
        section("Pictures", concatenated(map(chart, charts)))])


def _part(text: str) -> Html:
    """Lines of a table stay in their columns, and are shifted sideways on a phone; sentences wrap."""
    lines = text.strip("\n").split("\n")
    if any(_COLUMN_GAP in line.strip() for line in lines):
        return html('<pre class="whole">{}</pre>', "\n".join(lines))
    return html('<p class="lines">{}</p>', "\n".join(lines))
