"""What a verb is asked, declared once.

Problem: an option of a verb was declared four times, for the terminal, for Python, in the checks and in the help, and
the four came apart. Solution: a frozen dataclass for each verb, whose annotations carry range, unit and help::

    tries: Annotated[int, Option("further starts, spread around", Range(0, 1000))] = 0
    progress: Annotated[Notify, "called with what is under way: in Python alone"] = silent

The arguments of the command line (``logger.commands.options``), the function in Python (``function``), the checks
(``Question``) and the reference are read from it. What it is answered with is an ``Answer``. Modules with questions
load nothing heavy.

Annotations name classes that are not loaded (``Union["Model", Path, str]``): an object of one is known by the names of
its class and of those that it inherits from. Ranges stand here too.
"""


import inspect
import re
import textwrap
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import MISSING, dataclass, field, fields
from functools import cached_property
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    ForwardRef,
    Literal,
    NamedTuple,
    ParamSpec,
    Protocol,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
)

from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput
from logger.printable import LONGEST_WORD, Notify, silent


class Range(NamedTuple):
    """What a number may be, ends included; ``high`` infinite: no end."""

    low: float
    high: float
    unit: str = ""

    @property
    def is_half_open(self) -> bool:
        """Whether it has no end."""
        return self.high == float("inf")

    @property
    def words(self) -> str:
        """Both ends, with the unit."""
        low, high = (str(one) if isinstance(one, int) else format(one, ".15g") for one in self[:2])
        return f"{low} or more" if self.is_half_open else f"{low} to {high} {self.unit}".rstrip()

    def fault(self, value: Any) -> str:
        """What follows the name of a number that lies outside; empty: it does not."""
        if self.low <= value <= self.high:
            return ""
        return f" {value if isinstance(value, int) else format(value, 'g')}: expected {self.words}"

    def check(self, name: str, value: float) -> None:
        """BadInput for a value outside; ``name``: of what it is."""
        if words := self.fault(value):
            raise BadInput(f"{name}{words}")


class IriLimit(Range):
    """An IRI from which on a road is to be called rough [m/km]; one that no road has is refused."""

    @property
    def words(self) -> str:
        """Said by the complaint alone, as the highest is known by what is not loaded before."""
        return ""

    def fault(self, value: Any) -> str:
        """As of ``Range``."""
        from logger.roads.iri import HIGHEST_LIMIT_M_PER_KM, limit_hint

        found = Range(self.low, HIGHEST_LIMIT_M_PER_KM, self.unit).fault(value)
        hint = limit_hint(value) if found else ""
        return f"{found}{hint}" + f" (at a terminal write {value:g}in/mi)" * bool(hint)


LIMIT = IriLimit(0.01, float("inf"), "m/km")


TOLERANCE = Range(0.001, 0.5)
USUAL_TOLERANCE = 0.2
"""How far off a car's masses, springs and dampers may well be, as a share."""
SPEED, RATE, ADDED = Range(0.1, 100.0, "m/s"), Range(10.0, 10_000.0, "Hz"), Range(0.0, 100.0, "m/s2")
"""Of a simulated drive; what its sensor adds, noise or steps. An estimate's steps likewise."""
READING_NOISE, WINDOW = Range(1e-4, 100.0, "m/s2"), Range(1.0, 1000.0, "m")
"""Of an estimate: noise of a reading, length of a window."""
WHEELBASE, CAR_MASS = Range(1.5, 6.0, "m"), Range(300.0, 10_000.0, "kg")
"""From the smallest car with two axles to a lorry."""
AUTO, UNKNOWN = "auto", "unknown"
"""Of a noise: learned. Of a vehicle's numbers: nothing is known of them."""
LENGTH, SPACING = Range(11.0, 1e6, "m"), Range(0.001, 0.3, "m")
"""Of a random road; a shorter one has no IRI."""
ROUGHNESS, IRI, ROAD_WAVINESS = Range(1e-3, 1e7, "cm3"), Range(0.01, 1000, "m/km"), Range(1.5, 3.0)
MOST_ROAD_SAMPLES = 20_000_000
TRIES, WAVINESS = Range(0, 1000), Range(1.0, 3.5)
"""Of an identification: further starts, waviness of a road that was not measured."""
NOISE_MODELS = ("auto", "white", "ar", "road")
MODAL_METHODS = ("era", "ssi", "n4sid", "decrement")
MODAL_METHODS_GONE = {"ar": "ssi", "ssi-cov": "ssi", "fft": "ssi", "arx": "n4sid", "armax": "n4sid"}
"""Of modes: the methods, and for those that are no longer offered the one to use."""
DAILY_HOURS = Range(0.001, 24.0, "hours")
"""Of riding, for values of health."""


_WORDS = {float: ("a number", "numbers"), int: ("a whole number", "whole numbers"), str: ("text", "texts"),
          Path: ("a path", "paths"), bool: ("True or False", "True or False")}
"""One of a kind, and several."""
_PUBLIC = {"Drive": "Run", "ChannelRecord": "Channels", "AccelerationRecord": "Record"}
"""What ``ridelog`` calls classes that go by another name in annotations."""


def fault(kind: Any, value: Any, expected: str = "", unit: str = "") -> str:
    """What follows the name of a value that is none of its kind; empty: it is one.

    kind        an annotation
    expected    what is asked for, where the kind does not say it
    unit        of numbers
    """
    return "" if allows(kind, value) else f" {_shown(value)}: expected {expected or _named(kind, unit)}"


def allows(kind: Any, value: Any) -> bool:
    """Whether an annotation lets a value be. A number is one of numpy too, and never True or False; text is no list."""
    origin, inside = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return any(allows(one, value) for one in inside)
    if origin is Annotated:
        return allows(inside[0], value)
    if origin is Literal:
        return isinstance(value, str) and value in inside
    if isinstance(kind, ForwardRef):
        return any(one.__name__ == kind.__forward_arg__ for one in type(value).__mro__)
    if origin is not None and origin is not Callable:
        return _holds(origin, inside, value)
    return _is(kind, value)


def _is(kind: Any, value: Any) -> bool:
    """The same of a kind that holds no others."""
    if kind in (float, int):
        return isinstance(value, Real if kind is float else Integral) and not isinstance(value, bool)
    if kind is bool:
        return type(value).__name__ in ("bool", "bool_")    # of numpy too, whichever its version
    if kind is Path:
        return isinstance(value, PathLike)
    if get_origin(kind) is Callable:
        return callable(value)
    return kind is Any or (value is None if kind in (None, NoneType) else isinstance(value, kind))


def _holds(origin: Any, inside: tuple[Any, ...], value: Any) -> bool:
    """The same of several: each of them counts."""
    if isinstance(value, str | bytes) or isinstance(value, Mapping) != issubclass(origin, Mapping):
        return False
    if issubclass(origin, Mapping):
        return all(allows(inside[0], name) and allows(inside[1], one) for name, one in value.items())
    if origin is tuple and inside[-1] is not ...:
        return isinstance(value, tuple | list) and len(value) == len(inside) and all(map(allows, inside, value))
    return isinstance(value, origin) and all(allows(inside[0], one) for one in value)


def _shown(value: Any) -> str:
    """A value as Python writes it, in one line; of an object its class."""
    if type(value).__module__ != "builtins":
        return f"of type {type(value).__name__}"
    words = " ".join(repr(value).split())
    return words if len(words) <= LONGEST_WORD else words[:LONGEST_WORD - 3] + "..."


def _named(kind: Any, unit: str, several: int = 0) -> str:
    """What is expected."""
    ones = list(dict.fromkeys(_alternatives(kind, unit, several)))
    return " or ".join(filter(None, [", ".join(ones[:-1]), *ones[-1:]]))


def _alternatives(kind: Any, unit: str, several: int) -> Iterator[str]:
    origin, inside = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        for one in inside:
            yield from _alternatives(one, unit, several) if one is not NoneType else ()
    elif origin is Annotated:
        yield from _alternatives(inside[0], unit, several)
    elif origin is Literal:
        yield from map(repr, inside)
    elif isinstance(kind, ForwardRef):
        name = _PUBLIC.get(kind.__forward_arg__, kind.__forward_arg__)
        yield (name if name.endswith("s") else f"{name}s") if several else name
    elif origin is Callable:
        yield "a function"
    elif origin is not None and issubclass(origin, Mapping):
        yield f"{'dicts' if several else 'a dict'} of {_named(inside[1], unit, several=1)}"
    elif origin is not None and issubclass(origin, Collection):
        how = "pairs" if several else "a pair" if origin is tuple and inside[-1] is not ... else "a list"
        yield how if inside[0] is Any else f"{how} of {_named(inside[0], unit, several=1)}"
    else:
        words = _WORDS.get(kind, (f"a {getattr(kind, '__name__', kind)}",) * 2)[several]
        yield words + f" in {unit}" * bool(unit and kind in (int, float))


P = ParamSpec("P")
R = TypeVar("R")
Asked = TypeVar("Asked")

_UNIT = re.compile(r"_(hz|s|m|kg|cm3|mps2?|m_per_km)$")
"""Ends of fields' names that are units: an option is called without."""

_IN_PYTHON = "\nIn Python: "
"""Where the part of a question's docstring begins that is of no use at the terminal."""


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


def more_than_0(value: float) -> None:
    """ValueError for a number that is not above 0."""
    if not value > 0:
        raise ValueError("expected more than 0")


def word_or_number(word: str, within: Range) -> Callable[[str], float | str]:
    """A reader of a terminal's text that is this word or a number; ValueError for another text."""
    def read(text: str) -> float | str:
        try:
            return text if text == word else float(text)
        except ValueError:
            raise ValueError(f"expected {word}, or {within.words}") from None

    return read


def check_word_or_number(word: str, within: Range) -> Callable[[float | str], None]:
    """A check that raises ValueError for what is neither this word nor a number within the range."""
    def check(value: float | str) -> None:
        if value != word and (isinstance(value, str) or within.fault(value)):
            raise ValueError(f"expected {word}, or {within.words}")

    return check


@dataclass(frozen=True)
class Argument(Option):
    """A field that is an argument by its place; with ``many`` one or more, or any number where it has a default."""


@dataclass(frozen=True)
class InPython(Option):
    """A field that is asked for in Python alone: the terminal has no option for it."""


@dataclass(frozen=True)
class Hidden(Option):
    """A field that a unit of systemd passes: help does not show its option."""


@dataclass(frozen=True)
class Several(Option):
    """A field whose option takes one value or more at once."""


@dataclass(frozen=True)
class Switches(Option):
    """A field whose values are switches at the terminal: ``by_value`` has the name and help of each but the default."""

    by_value: Mapping[str, tuple[str, str]] | None = None


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
        for each in fields(self):
            value, one = getattr(self, each.name), asked.get(each.name)
            if one is not None:
                _check(one, value)
            elif words := fault(each.type, value):
                raise self.wrong(each.name, words)

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
    warn: Annotated[Notify, "called with what should be known before a long computation"] = silent

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


class Function(Protocol[P, R]):
    """A verb as a function in Python; ``answer``: to its question as a whole."""

    answer: Callable[[Any], R]

    def __call__(self, *values: P.args, **options: P.kwargs) -> R: ...


def function(question: Callable[P, Asked]) -> Callable[[Callable[[Asked], R]], Function[P, R]]:
    """Make of what answers a question the verb's function in Python, of its name: it takes the question's fields, and
    its help is the question's."""
    def of(answer: Callable[[Asked], R]) -> Function[P, R]:
        def ask(*values: P.args, **options: P.kwargs) -> R:
            try:
                bound = signature.bind(*values, **options)
            except TypeError as error:
                raise TypeError(f"{answer.__name__}() {error}") from None
            return answer(question(*bound.args, **bound.kwargs))

        asks = question if isinstance(question, type) else type(question)
        signature = inspect.Signature(_parameters(asks))
        ask.__name__, ask.__qualname__, ask.__module__ = answer.__name__, answer.__name__, answer.__module__
        ask.__doc__ = "\n".join([inspect.getdoc(asks) or "", "", *_described(asks)])
        ask.__dict__["__signature__"] = inspect.Signature([
            one.replace(annotation=_Shown(one.annotation), default=_Shown(one.default) if callable(one.default) and
                        one.default is not one.empty else one.default) for one in _parameters(asks)])
        ask.__dict__["answer"] = answer
        return cast("Function[P, R]", ask)

    return of


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
        yield from textwrap.wrap(words, initial_indent=f"{name:{width}}", subsequent_indent=" " * width)


def help_of(question: type[Any]) -> str:
    """What a question is, for the terminal: without the part on Python."""
    return (inspect.getdoc(question) or "").partition(_IN_PYTHON)[0].rstrip()


# --- a verb of the command line ---


@dataclass(frozen=True, eq=False, repr=False)
class Answer:
    """What a command says.

    content    the lines that it prints, or blocks (``logger.report.blocks.Blocks``); empty: none
    """

    content: object
    _json: dict[str, Any] = field(repr=False)

    @cached_property
    def text(self) -> str:
        """The lines that it prints."""
        return str(self.content)

    def __repr__(self) -> str:
        return self.text

    @property
    def exit_status(self) -> int:
        """That its command leaves with."""
        return EXIT_DONE

    def as_json(self) -> dict[str, Any]:
        """The object that the command prints with ``--json``; a copy."""
        return deepcopy(self._json)

    def remarks(self, written: Mapping[str, Sequence[Path]]) -> Sequence[str]:
        """What its command says on stderr, a line each; ``written``: the files of the command, by option."""
        return ()

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """What its command says last, such as what to do next; ``written``: the files of the command, by option."""
        return ""


@dataclass(frozen=True, eq=False, repr=False)
class Checked(Answer):
    """The answer of a command that checks something; ``ok``: nothing is wrong."""

    ok: bool = True

    @property
    def exit_status(self) -> int:
        return EXIT_DONE if self.ok else EXIT_CHECK_FAILED


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
    answers     module and name of what answers it: ``logger.api.lab.compare:compared``
    outs        what it writes
    refusal     module and name of what makes a program's object of a ``CheckFailed``; empty: it is a complaint
    has_json    whether its answer can be asked for as one object
    """

    question: type[Question]
    answers: str
    outs: Sequence[Out] = ()
    refusal: str = ""
    has_json: bool = True


@dataclass(frozen=True)
class Verbs:
    """A verb with verbs below it, by name, each with what it does; ``words``: its help."""

    words: str
    below: Mapping[str, tuple[Verb, str]]
