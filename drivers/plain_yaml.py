"""YAML as far as settings need it, from anybody.

Problem: a YAML file may hold aliases that unfold without bound, tags that make a loader fail in ways of its own, and
nesting that fills the stack. Solution: everything that no file of settings needs is refused with its line as soon as it
is met, before anything is composed of it: aliases, tags, deep nesting, characters that no name or path can have.
"""

from __future__ import annotations

from collections.abc import Iterator

import yaml

from drivers.errors import shortened

MAX_DEPTH = 12
_SHOWN = 80


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
        words = str(error.problem or error.context)[:_SHOWN]
        raise NotPlainError(mark.line + 1 if mark else 1, f"expected YAML ({words})") from None
    except (ValueError, OverflowError) as error:  # PyYAML lets these out for impossible escapes and versions
        raise NotPlainError(reader.line + 1, f"expected YAML ({str(error)[:_SHOWN]})") from None


def lines_of(node: yaml.Node, path: str = "") -> Iterator[tuple[str, int]]:
    """The keys of nested mappings as dotted paths, each with its line. NotPlainError for a key that stands twice."""
    if not isinstance(node, yaml.MappingNode):
        return
    seen = set()
    for key, value in node.value:
        line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            raise NotPlainError(line, "expected a word as key")
        if key.value in seen:
            raise NotPlainError(line, f"expected each key once, {shortened(key.value)} stands here again")
        seen.add(key.value)
        yield f"{path}{key.value}", line
        yield from lines_of(value, f"{path}{key.value}.")


class _PlainReader(yaml.SafeLoader):
    """Gives events to what composes them; NotPlainError at the first one that is not plain."""

    _depth = 0

    def get_event(self) -> yaml.Event:
        """The next event."""
        event: yaml.Event = super().get_event()
        line = event.start_mark.line + 1 if event.start_mark else 1
        if isinstance(event, yaml.AliasEvent):
            raise NotPlainError(line, f"expected values written out, found the alias *{str(event.anchor)[:_SHOWN]}")
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
