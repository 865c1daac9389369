"""Check segment logs and recorded dumps: count good, torn and corrupt records, and gaps. A stick that 'ridelog export'
filled is also compared with its manifest. There each file is a record, and each file missing or not listed is a gap.

  ridelog verify /var/lib/ridelog
  ridelog verify /media/RIDELOG --json

Exit status 0: nothing is wrong; 1: something is, and it is listed. Two things are not wrong: the torn end of a log
that is still open, and a sensor that is silent in a dump (a gap).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE
from logger.printable import printable
from logger.store.integrity import FileCheck, verify

_COUNTS = ("records_good", "records_torn", "records_corrupt", "gaps")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the verb."""
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH",
                        help="a log, a dump, a manifest, or a folder of them")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Check and print. Raises BadInput for a path that is not there or is neither log nor dump."""
    checks = verify(args.paths)
    ok = all(check.ok for check in checks)
    if args.json:
        print(json.dumps(_as_json(checks, ok)))
    else:
        _print_text(checks, ok)
    return EXIT_DONE if ok else EXIT_CHECK_FAILED


def _totals(checks: list[FileCheck]) -> dict[str, int]:
    return {name: sum(getattr(check, name) for check in checks) for name in _COUNTS}


def _as_json(checks: list[FileCheck], ok: bool) -> dict[str, object]:
    files = [{"path": str(check.path), "kind": check.kind, "state": check.state, "ok": check.ok,
              **_totals([check]), "problems": list(check.problems), "notes": list(check.notes)} for check in checks]
    return {"ok": ok, **_totals(checks), "files": files}


def _print_text(checks: list[FileCheck], ok: bool) -> None:
    for check in checks:
        state = ", open" if check.state == "open" else ""
        print(f"{printable(str(check.path))} ({check.kind}{state}): {_counts_in_words(_totals([check]))}")
        for words in (*check.problems, *check.notes):
            print(f"    {printable(words)}")
    files = "1 file" if len(checks) == 1 else f"{len(checks)} files"
    print(f"{'ok' if ok else 'WRONG'}: {files}, {_counts_in_words(_totals(checks))}")


def _counts_in_words(counts: dict[str, int]) -> str:
    return (f"{counts['records_good']} good, {counts['records_torn']} torn, {counts['records_corrupt']} corrupt, "
            f"{counts['gaps']} {'gap' if counts['gaps'] == 1 else 'gaps'}")
