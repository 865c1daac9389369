"""The documents: their links lead somewhere, and what a folder has stands in its table."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from logger.exchange.layer import formats
from logger.store.log.row_format import COLUMN_MEANINGS, COLUMNS

from .support import reference
from .support.words import LONGEST_SENTENCE, MOST_OF_A_PAGE, MOST_WORDS, is_made, pages, sentences, words

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(page: Path) -> set[str]:
    """The names that a page's headings can be linked by."""
    titles = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_and_headings_that_exist(page: Path) -> None:
    for link in LINK.findall(page.read_text("utf-8")):
        if link.startswith(("http:", "https:")):
            continue
        name, _, heading = link.partition("#")
        target = (page.parent / name) if name else page
        assert target.exists(), link
        assert not heading or heading in anchors(target), link


def test_every_document_is_linked_from_another() -> None:
    linked = {(page.parent / link.partition("#")[0]).resolve()
              for page in PAGES for link in LINK.findall(page.read_text("utf-8"))}
    assert not {page.resolve() for page in PAGES[1:]} - linked


def test_each_format_of_convert_has_a_row_in_the_page_about_logs() -> None:
    page = (ROOT / "docs" / "reading-a-log.md").read_text("utf-8")
    assert set(re.findall(r"^\| `\.(\w+)` \|", page, re.MULTILINE)) == set(formats())


@pytest.mark.parametrize("name", reference.PAGES)
def test_a_page_of_the_reference_is_what_the_program_declares(name: str) -> None:
    written = (reference.FOLDER / f"{name}.md").read_text("utf-8")
    assert written == reference.PAGES[name](), "run python -m tests.support.reference"


def test_each_column_of_a_log_is_explained() -> None:
    assert list(COLUMN_MEANINGS) == [*(one.name for one in COLUMNS), "crc32"]


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_a_page_and_its_sentences_are_short(page: Path) -> None:
    text = page.read_text("utf-8")
    assert words(text) <= MOST_OF_A_PAGE
    assert [one for one in sentences(text) if words(one) > LONGEST_SENTENCE] == []


def test_all_pages_together_are_short() -> None:
    texts = [page.read_text("utf-8") for page in pages()]
    assert sum(words(text) for text in texts if not is_made(text)) < MOST_WORDS


def test_words_that_the_glossary_replaces_are_in_no_document_help_message_or_page() -> None:
    """The reference holds all helps, effects and advice; messages, pages and JSON keys are strings of the program."""
    glossary = ROOT / "docs" / "glossary.md"
    rows = glossary.read_text("utf-8").partition("## Words that ridelog does not use")[2]
    replaced = re.findall(r"^\| [^|]+ \| ([a-z' ]+) \|$", rows, re.MULTILINE)[1:]
    assert len(replaced) >= 12
    found = re.compile(rf"\b(?:{'|'.join(replaced)})\b")
    # Nearly all modules have none of them in any way, and need not be parsed.
    nearly = re.compile("|".join(r"""[\s"'fr]+""".join(one.split()) for one in replaced))
    said = {page.name: [page.read_text("utf-8")] for page in PAGES if page != glossary}
    for package in ("logger", "drivers"):
        said |= {str(file): strings(ast.parse(file.read_text("utf-8"))) for file in (ROOT / package).rglob("*.py")
                 if nearly.search(file.read_text("utf-8").lower())}
    assert [(name, one) for name, texts in said.items() for text in texts
            for one in found.findall(" ".join(text.lower().split()))] == []
    assert strings(ast.parse("'doc'\nx = f'at {x} first' + 'b'\n")) == ["at  first", "b"]


def strings(tree: ast.AST) -> list[str]:
    """Texts in a module but docstrings, formatted ones in one piece without what is put into them."""
    alone = {id(one.value) for one in ast.walk(tree) if isinstance(one, ast.Expr)}
    joined = [one for one in ast.walk(tree) if isinstance(one, ast.JoinedStr)]
    inside = {id(part) for one in joined for part in one.values}
    said = ["".join(part.value for part in one.values if isinstance(part, ast.Constant)) for one in joined]
    return said + [one.value for one in ast.walk(tree) if isinstance(one, ast.Constant) and isinstance(one.value, str)
                   and id(one) not in inside | alone]
