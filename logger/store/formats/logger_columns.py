"""Which column of a logger's CSV file is what: recognised by a known layout, or named by the user.

Problem: a column that is taken for another one, or a unit for another, gives runs that look like any others. Solution:
only layouts that are known (``logger_layouts``) are recognised, and only if one fits; all else has to be named, and the
complaint shows how.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from logger.errors import BadInput
from logger.store.formats.csv_table import shown
from logger.store.formats.logger_layouts import AXES, GRAVITY, LAYOUTS, PLACE, ROLES, SPELLINGS, LayoutColumn, units_of

Named = Mapping[str, tuple[LayoutColumn, ...]]
"""Columns by role as a user names them: the header of each file has one of them at most."""

_ENTRY = re.compile(rf"\s*({'|'.join(ROLES)})\s*=")
_AT_THE_END = re.compile(r"(?:[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*:?|_([a-z0-9]+))\s*$", re.IGNORECASE)
"""A unit in brackets, or after an underscore as in ``speed_mps``."""
_LIKELY = {
    "t": r"t|time.*|timestamp.*|seconds.*|.*\btime",
    **{axis: rf"(.*[ _.])?acc(el\w*)?[ _.]?{axis}([ _(\[].*)?|a?{axis}" for axis in AXES},
    "lat": r".*lat(itude)?\b.*", "lon": r".*lon(g|gitude)?\b.*",
    "speed": r".*(speed|velocity).*",
}


@dataclass(frozen=True)
class Recognised:
    """The columns of a file by role, and what they are called together."""

    name: str
    columns: Mapping[str, LayoutColumn]
    is_linear: bool = False  # gravity was taken out

    @property
    def is_enough(self) -> bool:
        """Whether something can be made of it."""
        return "t" in self.columns and (self.has_acceleration or self.has_location or self.has_gravity)

    @property
    def has_acceleration(self) -> bool:
        """Three axes, or one that points up."""
        return set(AXES) <= set(self.columns) or "up" in self.columns

    @property
    def has_location(self) -> bool:
        """Speed, or latitude and longitude."""
        return "speed" in self.columns or set(PLACE) <= set(self.columns)

    @property
    def has_gravity(self) -> bool:
        """Three axes of gravity alone."""
        return set(GRAVITY) <= set(self.columns)


def plain(header: str) -> str:
    """A column's name without what differs between versions of a program: case, spaces, the sign for a square."""
    text = header.strip().strip('"').replace("²", "^2").replace("\ufffd", "^2").lower()
    return " ".join(text.split())


def named_columns(text: str) -> Named:
    """The columns of ``--columns "t=time:ms,x=ax:g,..."``. Raises BadInput for a role or a unit that is not known."""
    starts = [found.start() for found in re.finditer(rf"(?:^|(?<=,))(?={_ENTRY.pattern})", text)]
    if not starts or starts[0] != 0:
        raise BadInput(f"--columns: expected {_form()}, found {shown(text)}")
    named: dict[str, tuple[LayoutColumn, ...]] = {}
    for start, end in zip(starts, [*starts[1:], len(text) + 1], strict=True):
        role, _, rest = text[start : end - 1].partition("=")
        column = _column(role.strip(), rest)
        named[role.strip()] = (*named.get(role.strip(), ()), column)
    return named


def _column(role: str, text: str) -> LayoutColumn:
    header, colon, word = text.rpartition(":")
    unit = _unit(word)
    if colon and unit in units_of(role):
        return LayoutColumn(header.strip(), unit)
    if colon and re.fullmatch(r"[\w/^²°µ]{1,12}", word.strip()) and header.strip():
        raise BadInput(f"--columns: expected {role}={header.strip()}:UNIT with one of {', '.join(units_of(role))}, "
                       f"found {shown(word.strip())}")
    if not text.strip():
        raise BadInput(f"--columns: expected the name of a column after {role}=, found nothing")
    return LayoutColumn(text.strip())


def _unit(word: str) -> str:
    word = word.strip().replace("²", "2").replace("\ufffd", "2")
    word = word if word in SPELLINGS else word.lower()
    return SPELLINGS.get(word, word)


def unit_of_cell(text: str) -> str | None:
    """The unit that a cell below a column's name says, in brackets or without; None: it is none."""
    unit = _unit(text.strip().strip("[]()"))
    return unit if unit and any(unit in units_of(role) for role in ROLES) else None


def unit_in(header: str, role: str) -> str | None:
    """The unit at the end of a column's name, if it is one of the role's."""
    found = _AT_THE_END.search(header)
    unit = _unit(found[1] or found[2]) if found else None
    return unit if unit in units_of(role) else None


def recognise(names: Sequence[str], stem: str, named: Named | None) -> Recognised | None:
    """What is in a file with this header and name: the columns that are named and, where these are not enough for
    anything, those of a known layout in the roles that nobody named; None: nothing that is enough. BadInput for a
    column that is there twice or named twice."""
    there = [plain(one) for one in names]
    by_name, by_layout = _by_name(there, named or {}), _by_layout(there, stem)
    if by_name is None or by_name.is_enough or by_layout is None:
        return by_layout if by_name is None else by_name if by_name.is_enough else None
    others = {role: column for role, column in by_layout.columns.items() if role not in (named or {})}
    both = Recognised(f"{by_layout.name} and columns as named", others | dict(by_name.columns),
                      by_layout.is_linear or by_name.is_linear)
    return both if both.is_enough else None


def _by_layout(there: list[str], stem: str) -> Recognised | None:
    fitting = []
    for layout in LAYOUTS:
        wanted = {role: plain(column.header) for role, column in layout.columns.items()}
        if all(there.count(one) == 1 for one in wanted.values()) and (
                layout.stem in ("", stem.lower())):
            fitting.append(layout)
    if not fitting:
        return None
    if len({plain(layout.columns["t"].header) for layout in fitting}) > 1:
        return None
    columns: dict[str, LayoutColumn] = {}
    names_of: list[str] = []
    for layout in fitting:
        new = {role: column for role, column in layout.columns.items()
               if role not in columns and not (role == "up" and "z" in columns)}
        names_of += [layout.name] if new else []
        columns |= new
    return Recognised(" and ".join(names_of), columns, any("linear" in one for one in names_of))


def _by_name(there: list[str], named: Named) -> Recognised | None:
    columns = {}
    for role, choices in named.items():
        found = [one for one in choices if plain(one.header) in there]
        if len(found) > 1 or any(there.count(plain(one.header)) > 1 for one in found):
            raise BadInput(f"--columns: expected one column for {role} in a file, found "
                           f"{' and '.join(one.header for one in found)} once or more")
        if found:
            unit = found[0].unit or unit_in(found[0].header, role)
            columns[role] = LayoutColumn(found[0].header, unit)
    linear = any("linear" in plain(columns[axis].header) for axis in AXES if axis in columns)
    return Recognised("columns as named", columns, linear) if columns else None


def advice(names: Sequence[str]) -> str:
    """What to give for a header that is not known: the option, filled in as well as names allow."""
    chosen = []
    for role, likely in _LIKELY.items():
        fits = [name for name in names if re.fullmatch(likely, plain(name))]
        if fits:
            chosen.append(f"{role}={fits[0].strip()}" + ("" if unit_in(fits[0], role) or role in PLACE else ":UNIT"))
    example = ",".join(chosen) if len(chosen) > 1 else "t=TIME:ms,x=X:g,y=Y:g,z=Z:g,lat=LAT,lon=LON,speed=SPEED:km/h"
    return f'--columns "{example}"'


def _form() -> str:
    return f"ROLE=COLUMN[:UNIT],... with roles {', '.join(ROLES)}"
