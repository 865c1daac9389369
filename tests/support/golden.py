"""What verbs print for a program, of a few command lines whose answers are linear in their input, to nine digits.

``python -m tests.support.golden`` writes ``golden.json`` anew: after a change that is meant to change them. The file
holds each number, or of a long list of numbers how many, the first, the last, the mean and the root mean square.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from logger.commands.main import main

FILE = Path(__file__).with_name("golden.json")
MADE = ("road generate --class C --length 200 --seed 3 --out road.csv --json",
        "simulate --vehicle rav4-2009 --profile road.csv --speed 12 --noise 0.05 --out drive.csv --json")
"""What the others read."""
ASKED = ("iri road.csv --window 50 --json", "road classify road.csv --json",
         "comfort drive.csv --json", "comfort drive.csv --weighting wb --daily-hours 2 --json",
         "modes --vehicle rav4-2009 --json")
_FEW = 4


def printed() -> Iterator[tuple[str, dict[str, Any]]]:
    """Each command line with the numbers that it prints, by their places in its object."""
    with TemporaryDirectory() as folder, chdir(folder):
        for line in (*MADE, *ASKED):
            with redirect_stdout(StringIO()) as out:
                assert main(line.split()) == 0, line
            yield line, dict(numbers(json.loads(out.getvalue())))


def numbers(value: Any, place: str = "") -> Iterator[tuple[str, float | list[float]]]:
    """The numbers of an object, by their places."""
    if isinstance(value, dict):
        for name, one in value.items():
            yield from numbers(one, f"{place}.{name}")
    elif isinstance(value, list) and len(value) > _FEW and all(isinstance(one, int | float) for one in value):
        yield place, [len(value), value[0], value[-1], float(np.mean(value)), float(np.sqrt(np.mean(np.square(value))))]
    elif isinstance(value, list):
        for index, one in enumerate(value):
            yield from numbers(one, f"{place}[{index}]")
    elif isinstance(value, int | float):
        yield place, float(value)


if __name__ == "__main__":
    FILE.write_text(json.dumps(dict(printed()), indent=0) + "\n", "ascii")
