"""Records that show themselves: as aligned lines at a prompt, with charts beside them in a notebook.

Files to write, looked at before anything is computed.

What was found and done about a record before it was used, for a person and for a program.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from logger.errors import BadInput
from logger.files import why_not_written, write_text
from logger.left_out import left_out_json, left_out_lines
from logger.question import Answer

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.report.blocks import Block
    from logger.report.document import Html
    from logger.store.formats.record_checks import EvenRecord


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
        from logger.report.document import cell

        return cell(repr(self), self.figures())


@dataclass(frozen=True, eq=False, repr=False)
class CommandResult(Answer, Shown):
    """An answer with charts and a page."""

    title: ClassVar[str] = ""
    """Of its page."""

    def as_page(self, of: str) -> Html:
        """It as a page that stands alone; ``of``: what it is a result of, such as a file."""
        from logger.report.blocks import Section, page

        return page(self.title, of, [*self.blocks(), Section("Pictures", self.charts())])

    def blocks(self) -> Iterable[Block]:
        """Its content as blocks."""
        from logger.report.blocks import Blocks, Lines

        return self.content if isinstance(self.content, Blocks) else [Lines([one]) for one in self.text.split("\n\n")]

    def write(self, path: Path, option: str = "--out") -> None:
        """Write it as the file that an ``option`` of its command asks for: of its own kind where it has one, else its
        page."""
        write_text(path, self.as_page(""))


def table(title: str, rows: Iterable[Row]) -> str:
    """A title, and under it names, values and units in columns; rows whose value is None are left out."""
    shown = [(name, _words(value), unit) for name, value, unit in rows if value is not None]
    names, values = (max((len(row[column]) for row in shown), default=0) for column in (0, 1))
    return "\n".join([title, *(f"  {name:{names}}  {value:>{values}}  {unit}".rstrip() for name, value, unit in shown)])


def _words(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if isfinite(value) else "not known"
    return str(value)


def check_outs(asked: Iterable[tuple[str, Path | None]], runs: Iterable[Path] = (), read: Iterable[Path] = ()) -> None:
    """Raise BadInput as ``check_out`` for any of the files to write, by the options that ask for them, and where two
    are one file."""
    folders, files = list(runs), list(read)
    taken: set[Path] = set()
    for option, out in asked:
        if out is not None:
            if out.resolve() in taken:
                raise BadInput(f"{option} {out}: expected a different file each time")
            check_out(out, folders, files, option)
            taken.add(out.resolve())


def check_out(out: Path, runs: Iterable[Path], read: Iterable[Path] = (), option: str = "--out") -> None:
    """Raise BadInput where a file to write is one of a run or another that is read, or cannot be written.

    runs      their folders
    option    how the file was asked for
    """
    from logger.store.formats.drive_file import DRIVE, EXCITATION, PROFILE, RUN

    said = f"{option} {out}".lstrip()
    if out.resolve() in {(folder / name).resolve() for folder in runs for name in (DRIVE, PROFILE, EXCITATION, RUN)}:
        raise BadInput(f"{said}: expected a file that does not belong to a run")
    if out.resolve() in {path.resolve() for path in read}:
        raise BadInput(f"{said}: expected a file other than the input")
    if not out.parent.is_dir() or out.is_dir():
        raise BadInput(f"{said}: expected a file in a folder that exists")
    if why := why_not_written(out):
        raise BadInput(f"{said}: expected a file that may be written ({why})")


def checks_json(record: EvenRecord) -> dict[str, Any]:
    """``doubts``, one object each; ``resampled``: how, or null; ``left_out``: of its samples."""
    return {**left_out_json(record.left_out), "doubts": [doubt.as_json() for doubt in record.doubts],
            "resampled": None if record.resampled is None else asdict(record.resampled)}


def checks_lines(record: EvenRecord) -> list[str]:
    """What was done to the record; empty: nothing."""
    done = record.resampled
    if done is None:
        return left_out_lines(record.left_out)
    dropped = f"{done.repeats_dropped:.0%} repeated samples dropped, then " if done.repeats_dropped else ""
    return [*left_out_lines(record.left_out),
            f"Resampled: {dropped}converted from {done.from_hz:.4g} Hz (steps up to {done.widest_step_s:.3g} s) to an "
            f"even {done.to_hz:.4g} Hz, through an anti-alias filter."]
