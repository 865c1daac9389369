"""What other programs are given: rows with values and places, in any of the formats."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from logger.exchange.geometry import Geometry, Place
from logger.printable import word

Value = str | int | float | None
"""None: not known."""


class Kind(Enum):
    """What a column holds; of times ISO 8601 with milliseconds and Z."""

    WORDS = "words"
    COUNT = "count"
    NUMBER = "number"
    TIME = "time"


@dataclass(frozen=True)
class Field:
    """A column; its name ends in its unit."""

    name: str
    kind: Kind


@dataclass(frozen=True)
class Feature:
    """A row.

    group       what it belongs to, such as a drive of a log
    title       in a few words
    values      in the order of the layer's fields
    geometry    where it lies
    middle      the place of its middle; None: not known
    time_utc    when that was passed, as times are; None: not known
    joins       the row before it in its group is its neighbour on the road
    iri_class   of its colour; empty: it has none
    """

    group: str
    title: str
    values: tuple[Value, ...]
    geometry: Geometry
    middle: Place | None
    time_utc: str | None
    joins: bool
    iri_class: str


@dataclass(frozen=True)
class Layer:
    """A table of rows with places; rows of a group follow each other, in the order driven. ``points``: each is a place
    to go to, and does not belong to a way."""

    name: str
    fields: tuple[Field, ...]
    features: tuple[Feature, ...]
    points: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        return tuple(field.name for field in self.fields)

    def printable(self) -> Layer:
        """The same with every text a ``word``: whose names they are, and who opens the file, is not known."""
        return replace(self, features=tuple(
            replace(one, group=word(one.group), title=word(one.title),
                    values=tuple(word(value) if isinstance(value, str) else value for value in one.values))
            for one in self.features))

    @property
    def placed(self) -> int:
        """How many rows have a place."""
        return sum(bool(one.geometry) for one in self.features)
