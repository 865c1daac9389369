"""Records that show themselves: as aligned lines at a prompt, with charts beside them in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from logger.errors import EXIT_DONE
from logger.files import write_text

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.report.html import Html

Array = npt.NDArray[np.float64]
Row = tuple[str, object, str]
"""What it is called, a number or words, its unit."""


class Shown(ABC):
    """A record with a ``repr`` for people."""

    @abstractmethod
    def __repr__(self) -> str: ...

    def charts(self) -> Sequence[Chart]:
        """What a notebook draws of it; the arrays are in them."""
        return ()

    def figures(self) -> list[Html]:
        """The same as figure elements of HTML."""
        from logger.report.charts import chart

        return list(map(chart, self.charts()))

    def _repr_html_(self) -> str:
        from logger.report.notebook import cell

        return cell(repr(self), self.figures())


@dataclass(frozen=True, eq=False, repr=False)
class CommandResult(Shown):
    """What a command says.

    text    the lines that it prints
    """

    text: str
    _json: dict[str, Any] = field(repr=False)

    def __repr__(self) -> str:
        return self.text

    title: ClassVar[str] = ""
    """Of its page."""

    @property
    def exit_status(self) -> int:
        """That its command leaves with."""
        return EXIT_DONE

    def as_json(self) -> dict[str, Any]:
        """The object that the command prints with ``--json``; a copy."""
        return deepcopy(self._json)

    def as_page(self, of: str) -> Html:
        """It as a page that stands alone; ``of``: what it is a result of, such as a file."""
        from logger.report.result_page import page

        return page(self.title, of, self.text, self.charts())

    def remarks(self, written: Mapping[str, Sequence[Path]]) -> Sequence[str]:
        """What its command says on stderr, a line each; ``written``: the files of the command, by option."""
        return ()

    def write(self, path: Path, option: str = "--out") -> None:
        """Write it as the file that an ``option`` of its command asks for: of its own kind where it has one, else its
        page."""
        write_text(path, self.as_page(""))

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """What its command says last, such as what to do next; ``written``: the files of the command, by option."""
        return ""


def table(title: str, rows: Iterable[Row]) -> str:
    """A title, and under it names, values and units in columns; rows whose value is None are left out."""
    shown = [(name, _words(value), unit) for name, value, unit in rows if value is not None]
    names, values = (max((len(row[column]) for row in shown), default=0) for column in (0, 1))
    return "\n".join([title, *(f"  {name:{names}}  {value:>{values}}  {unit}".rstrip() for name, value, unit in shown)])


def _words(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if isfinite(value) else "not known"
    return str(value)
