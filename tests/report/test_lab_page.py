"""The page of a comparison: self-contained, escaped, with its pictures whole."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from logger.api.lab.compare import comparison_of, evidence, headline
from logger.lab.compare import LabComparison, compare

from ..support.lab.runs_with_residual import CAR, beside_with, recorded_by, runs_of


@pytest.fixture(scope="module")
def found() -> LabComparison:
    residuals = beside_with(recorded_by([("damper_asymmetry", {"rebound_to_bump_ratio": 1.6})], 0.02), lasts_s=14.0)
    return compare(runs_of(residuals), replace(CAR, name="<b>mine</b> & yours"))


class _Seen(HTMLParser):
    """Tags that were opened and closed, attributes, and text."""

    def __init__(self) -> None:
        super().__init__()
        self.opened: list[str] = []
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.opened.append(tag)
        self.attributes += attrs
        if tag not in ("meta", "path", "rect", "circle"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in ("meta", "path", "rect", "circle"):
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_the_page_is_whole_and_alone(found: LabComparison) -> None:
    seen = _Seen()
    seen.feed(comparison_of(found).as_page("drives"))
    assert not seen.open
    assert not {"script", "img", "link", "iframe", "b"} & set(seen.opened)
    assert not [value for name, value in seen.attributes if name in ("src", "href") or "http" in (value or "")]
    assert "<b>mine</b> & yours" in seen.text
    for sentence in (*headline(found), *evidence(found)):
        assert sentence in seen.text


def test_pictures_hold_finite_numbers_and_what_they_promise(found: LabComparison) -> None:
    html = comparison_of(found).as_page("drives")
    assert not re.search(r"\b(nan|inf)\b", html)
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", html)
    assert len(captions) == 10  # three drives, two spectra, the road, force by rate and travel, alignment
    assert any("By velocity: explains" in one for one in captions)
    assert html.count("<svg") == 10
    drawn = re.findall(r'<path class="thick[^"]*" d="M([^"]*)"', html)
    assert drawn and all(len(one.split()) >= 2 for one in drawn)


def test_no_column_of_a_table_is_empty(found: LabComparison) -> None:
    """Bands are given before and after the refit, though it moves their ends."""
    html = comparison_of(found).as_page("drives")
    bands, speeds, amplitudes = (html.split(f"<h2>{title}</h2>")[1].split("</table>")[0] for title in
                                 ("By band", "By speed", "By amplitude of the motion"))
    for table in (bands, speeds):
        assert ">unchanged<" in table and "<td class=n></td>" not in table
    assert ">unchanged<" not in amplitudes or "<td class=n></td>" not in amplitudes
