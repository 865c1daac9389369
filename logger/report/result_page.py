"""A result of a command as a page that stands alone: its words and its charts."""

from __future__ import annotations

from collections.abc import Sequence

from logger.chart_data import Chart
from logger.report.charts import chart
from logger.report.document import document, heading, section
from logger.report.html import Html, concatenated, html


def page(title: str, of: str, text: str, charts: Sequence[Chart]) -> Html:
    """The page.

    of      what it is a result of, such as a file
    text    what the command prints
    """
    return document(f"{title}: {of}", [
        heading(title, of), html('<pre class="said">{}</pre>', text),
        section("Pictures", concatenated(map(chart, charts)))])
