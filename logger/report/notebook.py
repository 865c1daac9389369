"""What a notebook shows of a result: its text and its charts, in the style of the pages, within its own cell."""

from __future__ import annotations

from collections.abc import Iterable

from logger.report.html import Html, concatenated, html
from logger.report.style import CELL_STYLE


def cell(text: str, figures: Iterable[Html]) -> Html:
    """An element that stands alone in somebody else's page."""
    return html('<div class="ridelog" style="background:var(--ground);color:var(--ink);padding:8px 12px">'
                '<style>{}</style><pre style="color:inherit;background:none;white-space:pre-wrap">{}</pre>{}</div>',
                Html(CELL_STYLE), text, concatenated(figures))
