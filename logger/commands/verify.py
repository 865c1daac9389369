"""``ridelog verify``: what is damaged or missing in logs, recordings and sticks."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from logger.printable import counted, printable
from logger.question import Argument, Checked, Question, Verb
from logger.store.integrity import FileCheck, verify

_COUNTS = ("records_good", "records_torn", "records_corrupt", "gaps")


@dataclass(frozen=True, kw_only=True)
class VerifyQuestion(Question):
    """Check segment logs and recorded dumps: count good, torn and corrupt records, and gaps. A stick that 'ridelog
    export' filled is also compared with its manifest: each file then counts as a record, and each missing or unlisted
    file as a gap.

      ridelog verify /var/lib/ridelog
      ridelog verify /media/RIDELOG --json

    Exit status 0: nothing is wrong; 1: something is, and it is listed. Two things are not wrong: the torn end of a log
    that is still open, and a sensor that is silent in a dump (a gap).
    """

    paths: Annotated[list[Path], Argument("a log, a dump, a manifest, or a folder of them", metavar="PATH", read=Path,
                                          many=list)]


VERB = Verb(VerifyQuestion, "logger.commands.verify:verified")


def verified(asked: VerifyQuestion) -> Checked:
    """Check. Raises BadInput for a path that is not there or is neither log nor dump."""
    checks = verify(asked.paths)
    ok = all(check.ok for check in checks)
    files = [{"path": str(check.path), "kind": check.kind, "state": check.state, "ok": check.ok,
              **_totals([check]), "problems": list(check.problems), "notes": list(check.notes)} for check in checks]
    return Checked("\n".join(map(printable, _lines(checks, ok))), {"ok": ok, **_totals(checks), "files": files}, ok)


def _totals(checks: list[FileCheck]) -> dict[str, int]:
    return {name: sum(getattr(check, name) for check in checks) for name in _COUNTS}


def _lines(checks: list[FileCheck], ok: bool) -> Iterator[str]:
    """The answer; then each file that something is wrong with, then the others."""
    yield f"{'ok' if ok else 'WRONG'}: {counted(len(checks), 'file')}, {_counts_in_words(_totals(checks))}"
    for check in sorted(checks, key=lambda one: one.ok):
        state = ", open" if check.state == "open" else ""
        yield f"{check.path} ({check.kind}{state}): {_counts_in_words(_totals([check]))}"
        yield from (f"    {words}" for words in (*check.problems, *check.notes))
    if not ok:
        yield ("Commands skip torn and corrupt records and read all others."
               + " Export to the stick again." * any(not check.ok and check.kind == "manifest" for check in checks))


def _counts_in_words(counts: dict[str, int]) -> str:
    return (f"{counts['records_good']} good, {counts['records_torn']} torn, {counts['records_corrupt']} corrupt, "
            f"{counts['gaps']} {'gap' if counts['gaps'] == 1 else 'gaps'}")
