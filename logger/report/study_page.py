"""The page of a study: its tables and pictures, self-contained, in the style of the report."""

from __future__ import annotations

from logger.report.charts import chart
from logger.report.document import document, grid, heading, paragraphs, section
from logger.report.html import Html, concatenated
from logger.studies.study import Result, Study, Table


def page(study: Study, result: Result, share: float = 1.0) -> Html:
    """The study as one HTML document; ``share`` of its draws and grid points that was computed."""
    quick = [] if share == 1.0 else [f"Quick: with {share:.0%} of the draws and grid points."]
    return document(f"{study.where}: {study.title}", [
        heading(study.title, f"{study.where} of N. Blum, dissertation, University of Maryland, 2015"),
        paragraphs([*quick, result.verdict]), *map(_table, result.tables),
        section("Pictures", concatenated(map(chart, result.pictures))),
        section("How it was made", paragraphs([study.how, f"ridelog study {study.called}{' --quick' * bool(quick)}"]))])


def _table(table: Table) -> Html:
    """Columns of words stand left, of numbers right."""
    words = [index for index in range(len(table.columns)) if all(isinstance(row[index], str) for row in table.rows)]
    rows = [[column.text(cell) for column, cell in zip(table.columns, row, strict=True)] for row in table.rows]
    return section(table.title, grid([column.name for column in table.columns], rows, words))
