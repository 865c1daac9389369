"""The page of a study: its tables and pictures, self-contained, in the style of the report.

It opens with no network and runs no script; every text is escaped.
"""

from __future__ import annotations

from html import escape

from logger.report.style import STYLE
from logger.studies.pictures import STYLE as PICTURE_STYLE
from logger.studies.pictures import picture
from logger.studies.study import Cell, Column, Result, Study, Table


def page(study: Study, result: Result) -> str:
    """The study as one HTML document."""
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    title = escape(f"{study.where}: {study.title}")
    parts = [f"<h1>{escape(study.title)}</h1>",
             f'<p class="sub">{escape(study.where)} of N. Blum, dissertation, University of Maryland, 2015</p>',
             f"<p>{escape(result.verdict)}</p>", *map(_table, result.tables),
             '<section><h2>Pictures</h2>' if result.pictures else "", *map(picture, result.pictures),
             "</section>" if result.pictures else "",
             f"<section><h2>How it was made</h2><p>{escape(study.how)}</p>"
             f"<p>ridelog study {escape(study.called)}</p></section>"]
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
            f'<meta name="viewport" content="width=device-width,initial-scale=1">'
            f'<meta name="color-scheme" content="light dark"><title>{title}</title>'
            f"<style>{STYLE}{PICTURE_STYLE}</style></head>\n<body><main>{''.join(parts)}</main></body></html>\n")


def _table(table: Table) -> str:
    """Columns of words stand left, of numbers right."""
    sides = ["" if all(isinstance(row[index], str) for row in table.rows) else " class=n"
             for index in range(len(table.columns))]
    head = "".join(f"<th{side}>{escape(column.name)}</th>" for side, column in zip(sides, table.columns, strict=True))
    rows = "".join(f"<tr>{''.join(map(_cell, sides, table.columns, row))}</tr>" for row in table.rows)
    return (f'<section><h2>{escape(table.title)}</h2><div class="scroll"><table><tr>{head}</tr>{rows}</table></div>'
            "</section>")


def _cell(side: str, column: Column, cell: Cell) -> str:
    return f"<td{side}>{escape(column.text(cell))}</td>"
