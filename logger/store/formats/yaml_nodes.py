"""YAML files that people write, read so that every complaint can name its line.

A plain YAML load forgets where a value stood, lets the later of two equal keys win, reads ``010`` as eight
and ``1:30`` as ninety, and can be made to grow without bound by aliases. Here a file becomes a tree of nodes
that know their line and hold their text as written; what the text means is decided by who asks for it
(``number``, ``text``, ``boolean`` ...), and whatever is not as asked becomes ``BadInput("file:line: expected ...")``.
Aliases, own tags and deep nesting are refused: no file of ours needs them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from drivers.errors import shortened
from drivers.plain_yaml import NotPlainError, compose_plain
from logger.errors import BadInput, did_you_mean
from logger.files import read_bounded

MAX_BYTES = 256 * 1024

_NUMBER = re.compile(r"[-+]?(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_INTEGER = re.compile(r"[-+]?(?:0[xX][0-9a-fA-F]{1,16}|0|[1-9][0-9]{0,17})")
_NULLS = ("", "~", "null", "Null", "NULL")


@dataclass(frozen=True)
class Node:
    """One value of a YAML file and the line where it stands (that of its key, inside a mapping).

    content is the text of a scalar as written, a tuple of nodes, or a dict from key to node (in the file's
    order). ``plain`` distinguishes an unquoted scalar (``12``, ``true``) from a quoted one (``"12"``). ``key`` is what
    it stands under in the file; empty: it is the whole, or one of a list.
    Each asking method raises BadInput when the value is something else.
    """

    file: str
    line: int
    content: str | tuple[Node, ...] | Mapping[str, Node]
    plain: bool = False
    key: str = ""

    def wrong(self, expected: str) -> BadInput:
        """The error to raise for this node: ``file:line: expected <expected>, found <what stands there>
        [for <key>]``."""
        key = f" for {shortened(self.key)}" if self.key else ""
        return BadInput(f"{self.file}:{self.line}: expected {expected}, found {self._shown()}{key}")

    def _shown(self) -> str:
        if isinstance(self.content, str):
            if self.plain and self.content in _NULLS:
                return "nothing"
            return shortened(self.content, longest=40)
        return "a list" if isinstance(self.content, tuple) else "a mapping"

    def is_null(self) -> bool:
        """Tell whether nothing stands here (``key:`` alone, ``~`` or ``null``)."""
        return isinstance(self.content, str) and self.plain and self.content in _NULLS

    def mapping(self, required: Iterable[str] = (), optional: Iterable[str] = ()) -> Mapping[str, Node]:
        """Key to node, where every required key is there and no key beyond the two lists is.

        With both lists empty any key is accepted.
        """
        if not isinstance(self.content, Mapping):
            raise self.wrong("a mapping (key: value lines)")
        required, known = tuple(required), (*required, *optional)
        for key, node in self.content.items():
            if known and key not in known:
                raise BadInput(f"{self.file}:{node.line}: expected one of the keys {', '.join(known)}, "
                               f"found {shortened(key)}{did_you_mean(key, known)}")
        for key in required:
            if key not in self.content:
                raise BadInput(f"{self.file}:{self.line}: expected the key {key!r} here, it is missing")
        return self.content

    def path(self, after: str = "") -> Path:
        """The path that stands ``after`` these characters; one that does not begin with / is seen from the folder of
        the file."""
        path = Path(self.file).parent.resolve() / self.text().removeprefix(after)
        try:
            path.exists()
        except OSError as error:
            raise self.wrong(f"a path that can be ({error.strerror})") from None
        return path

    def items(self) -> tuple[Node, ...]:
        """The nodes of a list."""
        if not isinstance(self.content, tuple):
            raise self.wrong("a list")
        return self.content

    def text(self) -> str:
        """A string that is not empty, quoted or not."""
        if not isinstance(self.content, str) or not self.content:
            raise self.wrong("a text")
        return self.content

    def choice(self, *allowed: str) -> str:
        """One of the given words."""
        if not isinstance(self.content, str) or self.content not in allowed:
            raise self.wrong("one of " + ", ".join(allowed))
        return self.content

    def boolean(self) -> bool:
        """``true`` or ``false``, unquoted."""
        if not self.plain or self.content not in ("true", "false"):
            raise self.wrong("true or false")
        return self.content == "true"

    def integer(self, low: int | None = None, high: int | None = None) -> int:
        """A whole number, decimal or 0x hexadecimal, within [low, high]."""
        expected = "a whole number" + _limits(low, high)
        if not self.plain or not isinstance(self.content, str) or not _INTEGER.fullmatch(self.content):
            raise self.wrong(expected)
        value = int(self.content, 0)
        if (low is not None and value < low) or (high is not None and value > high):
            raise self.wrong(expected)
        return value

    def number(self, low: float | None = None, high: float | None = None, *, above: float | None = None) -> float:
        """A finite decimal number within [low, high], and greater than ``above`` where that is given."""
        limits = _limits(low, high) if above is None else f" greater than {above:g}{_limits(None, high)}"
        expected = "a number" + limits
        if not self.plain or not isinstance(self.content, str) or not _NUMBER.fullmatch(self.content):
            raise self.wrong(expected)
        value = float(self.content)
        too_low = (low is not None and value < low) or (above is not None and value <= above)
        if too_low or abs(value) == float("inf") or (high is not None and value > high):
            raise self.wrong(expected)
        return value


def _limits(low: float | None, high: float | None) -> str:
    if low is None:
        return "" if high is None else f" of at most {high:g}"
    return f" of at least {low:g}" if high is None else f" from {low:g} to {high:g}"


def load_mapping(path: Path | str) -> Node:
    """Read a YAML file whose top is a mapping. Raises BadInput, which names file and line, for anything else."""
    data = read_bounded(path, MAX_BYTES)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}:{data.count(10, 0, error.start) + 1}: expected UTF-8 text") from None
    return parse_mapping(text, str(path))


def parse_mapping(text: str, file: str) -> Node:
    """The same for text at hand; ``file`` is the name that complaints carry."""
    try:
        top = compose_plain(text)
    except NotPlainError as error:
        raise BadInput(f"{file}:{error.line}: {error}") from None
    if top is None:
        raise BadInput(f"{file}:1: expected a mapping (key: value lines), found nothing")
    node = _convert(top, file, 1)
    node.mapping()
    return node


def _convert(node: yaml.Node, file: str, line: int) -> Node:
    if isinstance(node, yaml.ScalarNode):
        return Node(file, line, node.value, plain=node.style is None)
    if isinstance(node, yaml.SequenceNode):
        return Node(file, line, tuple(_convert(item, file, item.start_mark.line + 1) for item in node.value))
    content: dict[str, Node] = {}
    for key, value in node.value:
        key_line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            raise BadInput(f"{file}:{key_line}: expected a word as key")
        if key.value in content:
            raise BadInput(f"{file}:{key_line}: expected each key once, {shortened(key.value)} stands here again")
        content[key.value] = replace(_convert(value, file, key_line), key=key.value)
    return Node(file, line, content)
