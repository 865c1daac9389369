"""Damage that knows where the fields are: one field, column or line of a valid file is changed, the rest stays valid.

Bytes that are damaged anywhere (``mutation``) end at a reader's first check. What goes through it and breaks what
computes with the numbers is a good file in which one value is nan, inf, denormal, huge, negative or missing, in which a
column has another unit, columns are swapped, rows stand twice or are cut.
"""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from functools import partial
from typing import Any

Damage = Callable[[random.Random, bytes], bytes]

WILD = (
    "nan", "NaN", "inf", "-inf", "1e-320", "-1e-320", "5e-324", "1e308", "-1e308", "1e400", "1e-160", "1e160", "1e-8",
    "1e-12", "1e8", "1e15", "-1", "-0.0", "0", "", " ", "4294967296", "-9223372036854775809", "0x10", "1,5", "1_0",
    "1e5", "1e6", "1e7", "359.99", "3e-5", "x", "é", "true", "null", "9" * 400,
)
"""Words in place of a number."""
FACTORS = (1e-320, 1e-300, 1e-160, 1e-20, 1e-12, 1e-8, 1e-6, 1e-3, 0.1, 0.0, -1.0, 3.0, 10.0, 1e3, 1e6, 1e8, 1e12,
           1e160, 1e300)
OFFSETS = (1e-12, 1e-3, 1e3, 1e9, 1e12, 1e15, 1e300, -1e9)
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")


def tables(delimiter: str = "", header_lines: int = 1) -> Damage:
    """Damage of a table of text: the same delimiter all along ("": the commonest of its first line)."""
    return partial(_table, delimiter=delimiter, header_lines=header_lines)


def _table(rng: random.Random, data: bytes, delimiter: str, header_lines: int) -> bytes:
    lines = data.decode("utf-8", "surrogateescape").rstrip("\n").split("\n")
    between = delimiter or max(",;\t ", key=lines[0].count)
    head, rows = lines[:header_lines], [line.split(between) for line in lines[header_lines:]]
    if not rows:
        return data
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if rng.random() < 0.08 and head:
            head = _other_header(rng, head, between)
        elif rng.random() < 0.35:
            _one_cell(rng, rows)
        elif rng.random() < 0.6:
            _one_column(rng, rows, rng.randrange(max(map(len, rows), default=1)))
        else:
            rows = _other_rows(rng, rows)
    text = "\n".join([*head, *map(between.join, rows)])
    if rng.random() < 0.04:
        text = text[: rng.randrange(len(text) + 1)]
    return (text + "\n").encode("utf-8", "surrogateescape")


def _one_cell(rng: random.Random, rows: list[list[str]]) -> None:
    row = rng.choice(rows) if rows else []
    if row:
        place = rng.randrange(len(row))
        row[place] = rng.choice(WILD) if rng.random() < 0.8 else _scaled(rng, row[place])


def _one_column(rng: random.Random, rows: list[list[str]], place: int) -> None:
    """All of a column, or a stretch of it."""
    begin = rng.randrange(len(rows)) if rows and rng.random() < 0.3 else 0
    part = [row for row in rows[begin : begin + rng.choice((2, 40, 10**9))] if len(row) > place]
    kind, word, factor, offset = rng.randrange(7), rng.choice(WILD), rng.choice(FACTORS), rng.choice(OFFSETS)
    other = rng.randrange(max(map(len, part), default=1))
    values = [row[place] for row in part]
    for number, row in enumerate(part):
        match kind:
            case 0:
                row[place] = word
            case 1 | 2:
                row[place] = _number(row[place], lambda value: value * factor)
            case 3:
                row[place] = _number(row[place], lambda value: value + offset)
            case 4:
                row[place] = values[-1 - number]
            case 5 if other < len(row):
                row[place], row[other] = row[other], row[place]
            case _:
                row[place] = values[0]


def _scaled(rng: random.Random, text: str) -> str:
    return _number(text, lambda value: value * rng.choice(FACTORS))


def _number(text: str, change: Callable[[float], float]) -> str:
    try:
        return repr(change(float(text)))
    except ValueError:
        return text


def _other_rows(rng: random.Random, rows: list[list[str]]) -> list[list[str]]:
    at, count = rng.randrange(len(rows) + 1), rng.choice((1, 1, 2, 5, 50))
    part = [list(row) for row in rows[at : at + count]]
    match rng.randrange(9):
        case 0 | 1:
            return rows[:at] + part + rows[at:]
        case 2 | 3:
            return rows[:at] + rows[at + count :] or rows
        case 4:
            return rows[:at] + part[::-1] + rows[at + count :]
        case 5:
            return rows[: rng.choice((1, 2, 3, 4, 10, 20))]
        case 6:
            return [*rows[:at], rng.choice(([""], [" "], rows[at - 1][:-1], [*rows[at - 1], "1"])), *rows[at:]]
        case 7:
            return [row for number, row in enumerate(rows) if number % rng.choice((2, 3, 10)) == 0] or rows
        case _:
            return rows[::-1]


def _other_header(rng: random.Random, head: list[str], between: str) -> list[str]:
    cells = head[-1].split(between)
    place, other = rng.randrange(len(cells)), rng.randrange(len(cells))
    match rng.randrange(6):
        case 0:
            cells[place] = rng.choice(("", "x", cells[place].upper(), " " + cells[place], cells[other]))
        case 1:
            cells[place], cells[other] = cells[other], cells[place]
        case 2:
            del cells[place]
        case 3:
            cells.append(rng.choice(("more", cells[place])))
        case 4:
            return head[:-1]
        case _:
            return [*head, head[-1]]
    return [*head[:-1], between.join(cells)]


def numbers(rng: random.Random, data: bytes) -> bytes:
    """Damage of a text whose numbers stand anywhere, as in YAML: numbers, and the lines that hold them."""
    text = data.decode("utf-8", "surrogateescape")
    for _ in range(rng.choice((1, 1, 2))):
        found = list(_NUMBER.finditer(text))
        if found and rng.random() < 0.7:
            one = rng.choice(found)
            new = rng.choice(WILD) if rng.random() < 0.6 else _scaled(rng, one[0])
            text = text[: one.start()] + new + text[one.end() :]
            continue
        lines = text.split("\n")
        at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        match rng.randrange(5):
            case 0:
                del lines[at]
            case 1:
                lines.insert(at, lines[other])
            case 2:
                lines[at], lines[other] = lines[other], lines[at]
            case 3:
                key, colon, _ = lines[at].partition(":")
                lines[at] = key + colon + " " + rng.choice(("", "[]", "{}", "[1, 2]", "{a: 1}", "~", *WILD))
            case _:
                lines[at] = re.sub(r"[\w]+", lambda word: word[0][:-1], lines[at], count=1)
        text = "\n".join(lines)
    return text.encode("utf-8", "surrogateescape")


def objects(rng: random.Random, data: bytes) -> bytes:
    """Damage of a JSON text: a value of another kind or size, a key that is missing or another one, items twice."""
    content = json.loads(data)
    for _ in range(rng.choice((1, 1, 2))):
        holders = list(_holders(content))
        if not holders:
            break
        holder = rng.choice(holders)
        key = rng.choice(list(holder)) if isinstance(holder, dict) else rng.randrange(len(holder))
        match rng.randrange(5):
            case 0:
                del holder[key]
            case 1 if isinstance(holder, list):
                holder.insert(key, holder[key])
            case 1 if isinstance(holder, dict):
                holder[str(key) + "x"] = holder.pop(key)
            case _:
                holder[key] = _other_value(rng, holder[key])
    return json.dumps(content).encode()


def _holders(value: Any) -> list[Any]:
    if not isinstance(value, dict | list) or not value:
        return []
    inside = value.values() if isinstance(value, dict) else value
    return [value, *(holder for one in inside for holder in _holders(one))]


def _other_value(rng: random.Random, value: Any) -> Any:
    if isinstance(value, int | float) and abs(value) < 1e300 and not isinstance(value, bool) and rng.random() < 0.4:
        return value * rng.choice(FACTORS)
    return rng.choice((None, True, False, 0, -1, 1, 1e-320, 1e308, -1e308, float("nan"), float("inf"), float("-inf"),
                       10**30, 10**400, -(2**63), 1e-8, 0.5, "",
                       "x", "nan", "1", "\x00", "\ud800", "A" * 5000, [], {}, [value],
                       {"a": value}, [[]], [None], "../../x", "/dev/zero"))
