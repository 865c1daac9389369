"""YAML as far as settings need it, from anybody, read so that every complaint can name its line.

Problem: a YAML file may hold aliases that unfold without bound, tags that make a loader fail in ways of its own, and
nesting that fills the stack. A plain load forgets where a value stood, lets the later of two equal keys win, and reads
``010`` as eight and ``1:30`` as ninety. Solution: everything that no file of settings needs is refused with its line as
soon as it is met, before anything is composed of it: aliases, tags, deep nesting, characters that no name or path can
have. What is left becomes a tree of nodes that know their line and hold their text as written; what the text means is
decided by who asks for it (``number``, ``text``, ``boolean`` ...).
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self, TypeVar

import yaml

from drivers.errors import SHOWN, SettingsError, shortened

MAX_DEPTH = 12


class NotPlainError(Exception):
    """What is wrong (``expected ...``), and the line where it stands."""

    def __init__(self, line: int, words: str) -> None:
        super().__init__(words)
        self.line = line


def compose_plain(text: str) -> yaml.Node | None:
    """The nodes of the only document in a text; None when it holds nothing. Raises ``NotPlainError``."""
    try:
        reader = _PlainReader(text)
        return reader.get_single_node()
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise NotPlainError(line, "expected text without control characters") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        words = str(error.problem or error.context)[:SHOWN]
        raise NotPlainError(mark.line + 1 if mark else 1, f"expected YAML ({words})") from None
    except (ValueError, OverflowError) as error:  # PyYAML lets these out for impossible escapes and versions
        raise NotPlainError(reader.line + 1, f"expected YAML ({str(error)[:SHOWN]})") from None


class _PlainReader(yaml.SafeLoader):
    """Gives events to what composes them; NotPlainError at the first one that is not plain."""

    _depth = 0

    def get_event(self) -> yaml.Event:
        event: yaml.Event = super().get_event()
        line = event.start_mark.line + 1 if event.start_mark else 1
        if isinstance(event, yaml.AliasEvent):
            raise NotPlainError(line, f"expected values written out, found the alias *{str(event.anchor)[:SHOWN]}")
        self._depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if self._depth > MAX_DEPTH:
            raise NotPlainError(line, f"expected at most {MAX_DEPTH} levels of nesting")
        tag = getattr(event, "tag", None)
        if tag is not None:
            raise NotPlainError(line, f"expected a plain value, found the tag {shortened(tag)}")
        if isinstance(event, yaml.ScalarEvent) and ("\0" in event.value or not _can_be_written(event.value)):
            raise NotPlainError(line, f"expected text that can be written, found {shortened(event.value)}")
        return event


def _can_be_written(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


_NUMBER = re.compile(r"[-+]?(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_INTEGER = re.compile(r"[-+]?(?:0[xX][0-9a-fA-F]{1,16}|0|[1-9][0-9]{0,17})")
_NULLS = ("", "~", "null", "Null", "NULL")


@dataclass(frozen=True)
class Node:
    """One value of a YAML file and the line where it stands (that of its key, inside a mapping).

    content is the text of a scalar as written, a tuple of nodes, or a dict from key to node (in the file's
    order). ``plain`` distinguishes an unquoted scalar (``12``, ``true``) from a quoted one (``"12"``). ``key`` is what
    it stands under in the file; empty: it is the whole, or one of a list. ``otherwise``: a word that may stand here.
    Each asking method raises the reader's own error (``complaint``) when the value is something else.

    Problem: an instrument's settings belong into its own file, but how a wrong value is refused belongs to the program
    that reads it. Solution: an instrument declares for each key what may stand there (``drivers.readings``); only what
    fits none of these kinds brings a function of its own, which asks a node.
    """

    file: str
    line: int
    content: str | tuple[Self, ...] | Mapping[str, Self]
    plain: bool = False
    key: str = ""
    otherwise: str = ""

    def complaint(self, words: str) -> Exception:
        """The error to raise here: ``file:line: <words>``."""
        return SettingsError(f"{self.file}:{self.line}: {words}")

    def hint(self, key: str, known: Iterable[str]) -> str:
        """What a key that is not known may have meant; empty: nothing is said of it."""
        return ""

    def wrong(self, expected: str) -> Exception:
        """The error for this node: ``file:line: expected <expected>, found <what stands there> [for <key>]``."""
        key = f" for {shortened(self.key)}" if self.key else ""
        word = f"{self.otherwise} or " if self.otherwise and isinstance(self.content, str) else ""
        return self.complaint(f"expected {word}{expected}, found {self._shown()}{key}")

    def _shown(self) -> str:
        if isinstance(self.content, str):
            if self.plain and self.content in _NULLS:
                return "nothing"
            return shortened(self.content)
        return "a list" if isinstance(self.content, tuple) else "a mapping"

    def is_null(self) -> bool:
        """Tell whether nothing stands here (``key:`` alone, ``~`` or ``null``)."""
        return isinstance(self.content, str) and self.plain and self.content in _NULLS

    def mapping(self, required: Iterable[str] = (), optional: Iterable[str] = ()) -> Mapping[str, Self]:
        """Key to node, where every required key is there and no key beyond the two lists is.

        With both lists empty any key is accepted.
        """
        if not isinstance(self.content, Mapping):
            raise self.wrong("a mapping (key: value lines)")
        required, known = tuple(required), (*required, *optional)
        for key, node in self.content.items():
            if known and key not in known:
                raise node.complaint(f"expected one of the keys {', '.join(known)}, found {shortened(key)}"
                                     f"{self.hint(key, known)}")
        for key in required:
            if key not in self.content:
                raise self.complaint(f"expected the key {key!r} here, it is missing")
        return self.content

    def path(self, after: str = "") -> Path:
        """The path that stands ``after`` these characters; a relative one is seen from the folder of the file."""
        path = Path(self.file).parent.resolve() / self.text().removeprefix(after)
        try:
            path.exists()
        except OSError as error:
            raise self.wrong(f"a path that can be ({error.strerror})") from None
        return path

    def items(self) -> tuple[Self, ...]:
        if not isinstance(self.content, tuple):
            raise self.wrong("a list")
        return self.content

    def text(self) -> str:
        """A string that is not empty, quoted or not."""
        if not isinstance(self.content, str) or not self.content:
            raise self.wrong("a text")
        return self.content

    def choice(self, *allowed: str) -> str:
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
    return f" of at least {low:g}" if high is None else f" from {low:g} to {high:g}".replace("e+0", "e")


N = TypeVar("N", bound=Node)


def parse_mapping(text: str, file: str, kind: type[N]) -> N:
    """A text whose top is a mapping, as nodes of a kind; ``file`` is the name that complaints carry. Raises the
    ``complaint`` of that kind, which names file and line, for anything else."""
    try:
        top = compose_plain(text)
        if top is None:
            raise NotPlainError(1, "expected a mapping (key: value lines), found nothing")
        node = _convert(top, file, 1, kind)
    except NotPlainError as error:
        raise kind(file, error.line, "").complaint(str(error)) from None
    node.mapping()
    return node


def _convert(node: yaml.Node, file: str, line: int, kind: type[N]) -> N:
    if isinstance(node, yaml.ScalarNode):
        return kind(file, line, node.value, plain=node.style is None)
    if isinstance(node, yaml.SequenceNode):
        return kind(file, line, tuple(_convert(item, file, item.start_mark.line + 1, kind) for item in node.value))
    content: dict[str, N] = {}
    for key, value in node.value:
        key_line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            raise NotPlainError(key_line, "expected a word as key")
        if key.value in content:
            raise NotPlainError(key_line, f"expected each key once, found {shortened(key.value)} again")
        content[key.value] = replace(_convert(value, file, key_line, kind), key=key.value)
    return kind(file, line, content)
