"""What the annotation of a field lets a value be, and the complaint about another one.

Annotations name classes that are not loaded (``Union["Model", Path, str]``): an object of one is known by the names of
its class and of those that it inherits from.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ForwardRef, Literal, Union, get_args, get_origin

_MOST_SHOWN = 80
"""Characters of a value in a complaint; a list of readings is longer."""
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
    return words if len(words) <= _MOST_SHOWN else words[:_MOST_SHOWN - 3] + "..."


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
        yield f"{'dicts' if several else 'a dict'} of {_named(inside[1], unit, 1)}"
    elif origin is not None and issubclass(origin, Collection):
        how = "pairs" if several else "a pair" if origin is tuple and inside[-1] is not ... else "a list"
        yield how if inside[0] is Any else f"{how} of {_named(inside[0], unit, 1)}"
    else:
        words = _WORDS.get(kind, (f"a {getattr(kind, '__name__', kind)}",) * 2)[several]
        yield words + f" in {unit}" * bool(unit and kind in (int, float))
