"""One list of blocks, as lines of a terminal and as a page."""

from __future__ import annotations

import numpy as np

from logger.chart_data import Curves, Line
from logger.report import document as doc
from logger.report.blocks import Bullets, Detail, Hint, Linked, Section, Table, elements, page, text

BAR = Linked("", doc.Html('<div class="bar"></div>'))
PLACE = "52.0, 13.0"
TABLE = Table(("Road", "IRI", "", "Seen", "Empty"), [
    ("A & B", "1.50", BAR, Linked(PLACE, doc.map_links(52.0, 13.0, PLACE)), ""),
    ("C", "12.25", BAR, "no", ""), ("D", "3.00", BAR, "no", "")], (0, 3), most=2, more=" (--json lists all)")
CURVE = Curves("Picture", "x", "y", (Line("one", np.arange(2.0), np.arange(2.0)),))
BLOCKS = ["One.", "Two < three.", doc.Html("<hr>"), CURVE, Section("Found", [Bullets(["a", "b"]), "So."]), TABLE,
          Detail("Page", ["alone"]), Section("Nothing", [Bullets([]), Hint("but a hint")]), Hint("Small.")]


def test_a_terminal_shows_sentences_lists_and_columns() -> None:
    assert text(BLOCKS).splitlines() == [
        "One.", "Two < three.", "", "Found:", "- a", "- b", "", "So.", "",
        "Road     IRI  Seen", "A & B   1.50  52.0, 13.0", "C      12.25  no", "and 1 more (--json lists all)", "",
        "Small."]


def test_a_page_shows_all_of_it_with_its_pictures() -> None:
    shown = elements(BLOCKS)
    assert shown.startswith("<p>One.</p><p>Two &lt; three.</p><hr><figure>")
    assert "<h2>Found</h2><ul><li>a</li><li>b</li></ul><p>So.</p></section>" in shown
    assert '<td>D</td><td class=n>3.00</td><td class=n><div class="bar"></div></td><td>no</td></tr>' in shown
    assert '">52.0, 13.0</a>' in shown and "Empty" not in shown and "and 1 more" not in shown
    assert "<h2>Page</h2><p>alone</p>" in shown and "Nothing" not in shown
    assert shown.endswith('<p class="hint">Small.</p>')
    assert "<h1>A title</h1><p class=\"sub\">of a file</p><p>One.</p>" in page("A title", "of a file", BLOCKS)


def test_a_table_without_rows_is_not_shown() -> None:
    empty = Table(("Road", "IRI"), [])
    assert text(["One.", empty]) == "One." and elements([empty]) == ""
