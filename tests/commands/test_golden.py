"""Verbs print the numbers that they printed; what is to change them renews the file (``tests.support.golden``)."""

from __future__ import annotations

import json

import pytest

from ..support.golden import FILE, printed

LINEAR = 1e-9
"""Relative: sums in another order, of another version of a library, differ by less."""


@pytest.mark.slow
def test_what_verbs_print_has_not_changed() -> None:
    kept = json.loads(FILE.read_text("ascii"))
    found = dict(printed())
    assert list(found) == list(kept)
    for line, numbers in found.items():
        assert list(numbers) == list(kept[line]), line
        for place, value in numbers.items():
            assert value == pytest.approx(kept[line][place], rel=LINEAR, abs=1e-12), f"{line}: {place}"
