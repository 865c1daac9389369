"""No code but an accelerometer's own file knows its name: everything else asks the registry.

Names in prose (docstrings, comments, sentences for people) may stand anywhere; what may not is code that tells one
accelerometer from another by its name.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import drivers
import logger
from drivers.accelerometers import accelerometers

NAMES = tuple(accelerometers())
ROOTS = [Path(str(package.__file__)).parent for package in (drivers, logger)]
FILES = [path for root in ROOTS for path in sorted(root.rglob("*.py"))
         if "accelerometers" not in path.relative_to(root).parts]


def words(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every identifier, keyword, imported module and whole string of a file, with its line."""
    for node in ast.walk(tree):
        line = getattr(node, "lineno", 0)
        if isinstance(node, ast.Name):
            yield line, node.id
        elif isinstance(node, ast.Attribute):
            yield line, node.attr
        elif isinstance(node, ast.arg | ast.keyword):
            yield line, str(node.arg)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield line, node.name
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield line, f"{getattr(node, 'module', '')} {' '.join(alias.name for alias in node.names)}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
            yield line, node.value.decode("latin-1") if isinstance(node.value, bytes) else node.value


def knows(word: str, name: str) -> bool:
    """A string that is the name, or an identifier or import that has it in it; prose has blanks in it and may."""
    is_prose = " " in word.strip() and not word.startswith("drivers")
    return not is_prose and name in word.lower()


def test_there_are_names_to_look_for() -> None:
    assert {"bma220", "pasco"} <= set(NAMES)


def test_nothing_but_its_own_file_knows_an_accelerometer_by_name() -> None:
    texts = {path: path.read_text("utf-8") for path in FILES}
    assert not [f"{path}:{line}: {word}" for path, text in texts.items() if any(name in text.lower() for name in NAMES)
                for line, word in words(ast.parse(text)) for name in NAMES if knows(word, name)]
