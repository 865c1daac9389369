"""What a verb is asked, declared once.

Problem: an option of a verb was declared four times, for the terminal, for Python, in the checks and in the help, and
the four came apart. Solution: a frozen dataclass for each verb, whose annotations carry range, unit and help::

    tries: Annotated[int, Option("further starts, spread around", Range(0, 1000))] = 0
    progress: Annotated[Notify, "called with what is under way: in Python alone"] = silent

The arguments of the command line (``logger.commands.options``), the function in Python (``function``), the checks
(``Question``) and the reference are read from it. Modules with questions load nothing heavy.
"""

import inspect
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, ClassVar, ParamSpec, TypeVar, get_args, get_origin

from logger.api.kinds import fault
from logger.api.ranges import Range
from logger.errors import BadInput

P = ParamSpec("P")
R = TypeVar("R")
Asked = TypeVar("Asked")

Notify = Callable[[str], None]
"""Takes a message on the progress of some work."""
_UNIT = re.compile(r"_(hz|s|m|kg|cm3|mps2?|m_per_km)$")
"""Ends of fields' names that are units: an option is called without."""

_WIDTH = 120
_IN_PYTHON = "\nIn Python: "
"""Where the part of a question's docstring begins that is of no use at the terminal."""


def silent(_words: str) -> None:
    """Ignore a message."""


@dataclass(frozen=True)
class Option:
    """How a field of a question is asked for.

    help       what it is; range and default are said after it
    range      of a number, or of each of several
    metavar    what stands for the value in the help
    choices    words that it may be
    read       makes a value of a terminal's text; ValueError ("expected ...") for another text. None: by the type
    many       makes one value of those of an option that may repeat; None: it may not
    flag       at the terminal, where it is not the field's name without its unit
    bare       value of an option that is given without one; None: it may not be
    check      raises ValueError ("expected ...") for a value that it may not have
    """

    help: str
    range: Range | None = None
    metavar: str | None = None
    choices: Sequence[str] = ()
    read: Callable[[str], Any] | None = None
    many: Callable[[list[Any]], Any] | None = None
    flag: str = ""
    bare: Any = None
    check: Callable[[Any], object] | None = None


@dataclass(frozen=True)
class Argument(Option):
    """A field that is an argument by its place; with ``many`` one or more, or any number where it has a default."""


@dataclass(frozen=True)
class Switches(Option):
    """A field whose values are switches at the terminal: ``by_value`` has the name and help of each but the default."""

    by_value: Mapping[str, tuple[str, str]] | None = None


@dataclass(frozen=True)
class Entries(Option):
    """A field of entries by name, each an option of that name at the terminal: metavar and help ``by_name``."""

    by_name: Mapping[str, tuple[str, str]] | None = None


@dataclass(frozen=True)
class Asking:
    """A field of a question: its name, its type, how it is asked for, and its default (``MISSING``: none)."""

    name: str
    kind: Any
    option: Option
    default: Any

    @property
    def flag(self) -> str:
        """What it is called at the terminal."""
        return self.option.flag or flag_of(self.name)

    @property
    def help(self) -> str:
        """What it is, its range and its default."""
        said, known = self.option.help, []
        if self.option.range is not None and self.option.range.words:
            known.append(self.option.range.words)
        if self.default not in (MISSING, None, False, "", 0, ()) and "default" not in said:
            known.append(f"default: {format(self.default, 'g') if isinstance(self.default, Real) else self.default}")
        if not known:
            return said
        return f"{said[:-1]}; {'; '.join(known)})" if said.endswith(")") else f"{said} ({'; '.join(known)})"


def flag_of(name: str) -> str:
    """What an option is called at the terminal: ``--low-pass`` of ``low_pass_hz``."""
    return "--" + _UNIT.sub("", name).replace("_", "-")


class WrongOption(BadInput):
    """An option that is not what was expected. Fields of the question stand between ` in ``words``, for the terminal
    calls them otherwise."""

    def __init__(self, words: str) -> None:
        super().__init__(words.replace("`", ""))
        self._words = words

    def spelled(self, flags: Mapping[str, str]) -> BadInput:
        """The same with options as the terminal calls them: ``flags`` by name; of others ``flag_of``."""
        return BadInput(re.sub(r"`(\w+)`", lambda found: flags.get(found[1]) or flag_of(found[1]), self._words))


@dataclass(frozen=True, kw_only=True)
class Question:
    """What a verb is asked. WrongOption, when it is made, for a value of another kind than its field's, a number out of
    its range or a word out of its choices.
    """

    def __post_init__(self) -> None:
        asked = {one.name: one for one in askings(type(self))}
        for field in fields(self):
            value, one = getattr(self, field.name), asked.get(field.name)
            if one is not None:
                _check(one, value)
            elif words := fault(field.type, value):
                raise self.wrong(field.name, words)

    def wrong(self, name: str, words: str) -> WrongOption:
        """The complaint about an option; as ``complaint``."""
        return WrongOption(f"`{name}`{words}")

    def complaint(self, words: str) -> WrongOption:
        """A complaint that names options of this question between `."""
        return WrongOption(words)

    def named(self) -> str:
        """What it is asked of: the files that are arguments by their place."""
        return ", ".join(str(path) for one in askings(type(self)) if isinstance(one.option, Argument)
                         for path in _paths(getattr(self, one.name)))

    def files_read(self) -> Sequence[Path]:
        """Files and folders that are read, where they are given by their paths."""
        return [path for one in askings(type(self)) if one.option.read is Path
                for path in _paths(getattr(self, one.name))]

    def check_written(self, files: Mapping[str, Sequence[Path]]) -> None:
        """Raise BadInput where files to write, by their options, could be written over by others of the answer."""


@dataclass(frozen=True, kw_only=True)
class LongQuestion(Question):
    """One whose answer takes a while."""

    progress: Annotated[Notify, "called with what is under way, such as print"] = silent
    warn: Annotated[Notify, "called with what should be known before it takes long"] = silent

    stays: ClassVar[bool] = False
    """Whether what is under way stays on the screen."""


def _paths(given: Any) -> list[Path]:
    """The paths in the value of a field: one, several, or none."""
    several = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    return [Path(one) for one in several if isinstance(one, Path | str)]


def _check(one: Asking, value: Any) -> None:
    within, choices = one.option.range, tuple(one.option.choices)
    one_of = f"one of {', '.join(choices)}" * bool(choices)
    if words := fault(one.kind, value, one_of, within.unit if within else ""):
        raise WrongOption(f"`{one.name}`{words}")
    if value is None:
        return
    for number in value if isinstance(value, Sequence) else [value]:
        if within is not None and (words := within.fault(number)):
            raise WrongOption(f"`{one.name}`{words}")
    try:
        if one.option.check is not None:
            one.option.check(value)
    except ValueError as error:
        shown = format(value, "g") if isinstance(value, float) else value
        raise WrongOption(f"`{one.name}` {shown}: {error}") from None
    if choices and value not in choices:
        raise WrongOption(f"`{one.name}` {value}: expected {one_of}")


def askings(question: type[Any]) -> tuple[Asking, ...]:
    """The fields of a question that are asked for at the terminal too, those by their place first,
    then those without a default."""
    found = []
    for one in fields(question):
        if isinstance(one.type, str):
            raise TypeError(f"{question.__module__}: expected annotations that are no text; questions stand in modules "
                            "without 'from __future__ import annotations'")
        kind, option = get_args(one.type)[:2] if get_origin(one.type) is Annotated else (one.type, None)
        if isinstance(option, Option):
            default = one.default if one.default_factory is MISSING else one.default_factory()
            found.append(Asking(one.name, kind, option, default))
    return tuple(sorted(found, key=lambda one: (not isinstance(one.option, Argument), one.default is not MISSING)))


def function(name: str, question: Callable[P, Asked], answer: Callable[[Asked], R]) -> Callable[P, R]:
    """The verb as a function in Python: it takes the question's fields, and gives the answer. It stands in the module
    of ``answer``, by this name."""
    def ask(*values: P.args, **options: P.kwargs) -> R:
        try:
            bound = signature.bind(*values, **options)
        except TypeError as error:
            raise TypeError(f"{name}() {error}") from None
        return answer(question(*bound.args, **bound.kwargs))

    of = question if isinstance(question, type) else type(question)
    signature = inspect.Signature(_parameters(of))
    ask.__name__ = ask.__qualname__ = name
    ask.__module__ = answer.__module__
    ask.__doc__ = "\n".join([inspect.getdoc(of) or "", "", *_described(of)])
    ask.__dict__["__signature__"] = inspect.Signature([
        one.replace(annotation=_Shown(one.annotation), default=_Shown(one.default) if callable(one.default) and
                    one.default is not one.empty else one.default) for one in _parameters(of)])
    return ask


def _parameters(question: type[Any]) -> list[inspect.Parameter]:
    """Of a function that asks it: what is under way is reported last."""
    return sorted(inspect.signature(question).parameters.values(),
                  key=lambda one: (one.kind, one.name in ("progress", "warn")))


class _Shown:
    """What help shows of a type, or of a function that is a default."""

    def __init__(self, one: Any) -> None:
        plain = get_args(one)[0] if get_origin(one) is Annotated else one
        is_named = isinstance(plain, type) or inspect.isfunction(plain)
        words = plain.__name__ if is_named else str(plain)
        without_homes = re.sub(r"\b(typing|pathlib|collections\.abc)\.", "", words)
        self._words = re.sub(r"ForwardRef\('(\w+)'\)", r"\1", without_homes)

    def __repr__(self) -> str:
        return self._words


def _described(question: type[Any]) -> Iterator[str]:
    """The fields of a question in lines: names, and what they are."""
    asked, kinds = {one.name: one.help for one in askings(question)}, {one.name: one.type for one in fields(question)}
    known = {one.name: asked.get(one.name) or get_args(kinds[one.name])[1] for one in _parameters(question)
             if get_origin(kinds[one.name]) is Annotated}
    width = max(map(len, known), default=0) + 2
    for name, words in known.items():
        yield from textwrap.wrap(words, _WIDTH, initial_indent=f"{name:{width}}", subsequent_indent=" " * width)


def help_of(question: type[Any]) -> str:
    """What a question is, for the terminal: without the part on Python."""
    return (inspect.getdoc(question) or "").partition(_IN_PYTHON)[0].rstrip()


# --- a verb of the command line ---


@dataclass(frozen=True)
class Out:
    """Files that a verb writes where its command line asks for them: pages and pictures, and those ``of`` another kind
    by endings (``"*"``: any other), which the result writes.

    many        the option may repeat
    is_drawn    whether pages and pictures can be asked for
    """

    help: str
    flag: str = "--out"
    metavar: str = "FILE.html"
    others: Sequence[str] = ()
    many: bool = True
    is_drawn: bool = True
    required: bool = False


PICTURES = Out("write a page with pictures; .png, .svg or .pdf: the pictures alone; may repeat")
"""Of a verb that writes nothing else with ``--out``."""


@dataclass(frozen=True)
class Verb:
    """A verb of the command line.

    question    that it asks
    answers     module and name of what answers it: ``logger.api.lab:compared``
    outs        what it writes
    refusal     module and name of what makes a program's object of a ``CheckFailed``; empty: it is a complaint
    """

    question: type[Question]
    answers: str
    outs: Sequence[Out] = ()
    refusal: str = ""
