"""HTML that escapes by default: a text is shown, never obeyed, whichever way it gets into a page."""

from __future__ import annotations

import ast
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import logger.report
from logger.printable import printable
from logger.report.document import (
    Html,
    bullets,
    concatenated,
    document,
    escaped,
    grid,
    heading,
    hint,
    html,
    paragraphs,
    section,
    tiles,
)

EVIL = "<script>\"'&"
SAFE = "&lt;script&gt;&quot;&#x27;&amp;"
MODULES = sorted(Path(logger.report.__path__[0]).glob("*.py"))


def test_text_is_escaped_and_html_is_not() -> None:
    assert html("<p>{}</p>", EVIL) == f"<p>{SAFE}</p>"
    assert html("<p>{}</p>", html("<b>{}</b>", EVIL)) == f"<p><b>{SAFE}</b></p>"
    assert Html("<b>") + EVIL == f"<b>{SAFE}"
    assert EVIL + Html("<b>") == f"{SAFE}<b>"
    assert concatenated([EVIL, Html("<b>")]) == f"{SAFE}<b>"
    assert html("{0:.1f} {1:.0%} {name}", 0.25, 0.5, name=EVIL) == f"0.2 50% {SAFE}"
    assert isinstance(EVIL + Html("<b>") + EVIL, Html) and isinstance(escaped(EVIL), Html)


@pytest.mark.parametrize("made", [
    paragraphs([EVIL]), bullets([EVIL]), hint(EVIL), heading(EVIL, EVIL), section(EVIL, EVIL), grid([EVIL], [[EVIL]]),
    tiles([(EVIL, EVIL, EVIL)]), document(EVIL, [EVIL])])
def test_no_part_of_a_page_obeys_a_text(made: Html) -> None:
    assert "<script" not in made
    assert SAFE in made


@settings(max_examples=30)
@given(st.text(max_size=40))
def test_what_is_shown_is_the_text_and_what_cannot_be_seen_its_number(text: str) -> None:
    seen = printable(text, keep="\n\t\u00a0")
    assert (ElementTree.fromstring(html('<p a="x">{0}</p>', text)).text or "") == seen


def test_templates_are_literals_and_only_one_module_escapes() -> None:
    for module in MODULES:
        tree = ast.parse(module.read_text("utf-8"))
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
        made = [call for call in calls if call.func.id == "html"]  # type: ignore
        by_hand = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module == "html"]
        assert all(isinstance(call.args[0], ast.Constant) for call in made), module
        assert not by_hand or module.stem == "document", module
