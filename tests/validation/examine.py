"""The examination of the lab: random cases with hidden effects, put before ``ridelog diagnose`` and ``add-effect``.

    python -m tests.validation.examine                    the whole of it, and the report
    python -m tests.validation.examine --one 20 --none 0 --two 0 --outsider 0 --wandering 0 --docs DIR
    python -m tests.validation.examine --report-only
    python -m tests.validation.examine --release             what is published

Each case is one line of the results file as soon as it is over: stopped, the examination goes on where it was. Remove
the file to begin again, as one should after a change of the program. Writes examination.md, .html and .svg, and the
counts that ``ridelog study lab-examination`` shows: with --docs beside these pages, else into the package.

Seeds 2000 to 2099 are for development: the lab may be changed by what comes of them. Seeds 7000 to 9999 are for
releases: no development run uses them, they are refused without --release, and the report says of which kind its cases
are (``cases.seeds``).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from .cases.random_case import KINDS
from .cases.seeds import add_seed_options, first_seed, seeds
from .marking.marks import hidden, right, said
from .marking.results import appended, read_results
from .marking.sitting import Question, Record, sit
from .report.counts import counts
from .report.pages import Matrix, markdown, page

ROOT = Path(__file__).resolve().parents[2]
DOCS, PACKAGED = ROOT / "docs", ROOT / "logger" / "studies" / "field"
COUNTS = {"none": 40, "one": 100, "two": 40, "three": 40, "outsider": 39, "two_outsider": 0, "wandering": 38}
"""Five of each effect of the list, three of each off it; two of each that distances that wander do not imitate."""


def questions(counts: dict[str, int], first: int, release: bool = False) -> list[Question]:
    """Which cases, the kinds evenly mixed, so that a part of an examination says something of all of them. ValueError
    as in ``seeds``."""
    planned = [((number + 0.5) / count, Question(kind, seed)) for kind, count in counts.items() if count
               for number, seed in enumerate(seeds(first, count, release))]
    return [question for _, question in sorted(planned)]


def examine(asked: Sequence[Question], results: Path, workers: int, in_process: bool) -> None:
    """Put cases before the lab and append what it says to the results."""
    with appended(results) as file, ProcessPoolExecutor(workers) as pool:
        jobs = [pool.submit(sit, question, in_process) for question in asked]
        try:
            for done, job in enumerate(as_completed(jobs), 1):
                record = job.result()
                file.write(json.dumps(record) + "\n")
                file.flush()
                print(f"{done}/{len(asked)} {'right' if right(record) else 'WRONG'} {record['kind']} {record['seed']}: "
                      f"{', '.join(one['name'] for one in hidden(record)) or 'nothing'} -> {said(record)}", flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def report(records: Sequence[Record], asked: int, docs: Path) -> None:
    """Write the report."""
    docs.mkdir(parents=True, exist_ok=True)
    (docs / "examination.md").write_text(markdown(records, asked, "examination.svg"), "utf-8")
    (docs / "examination.html").write_text(page(records, asked), "utf-8")
    (docs / "examination.svg").write_text(Matrix.of(records).figure + "\n", "utf-8")
    beside = PACKAGED if docs.resolve() == DOCS else docs
    (beside / "examination.json").write_text(json.dumps(counts(records, asked), indent=1) + "\n", "utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for kind in KINDS:
        parser.add_argument(f"--{kind.replace('_', '-')}", type=int, default=COUNTS[kind], metavar="N",
                            help=f"how many cases of this kind (default: {COUNTS[kind]})")
    add_seed_options(parser)
    parser.add_argument("--results", type=Path, default=ROOT / "build" / "examination.jsonl")
    parser.add_argument("--docs", type=Path, default=DOCS, help="where the report goes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--in-process", action="store_true", help="call the commands instead of starting them")
    parser.add_argument("--report-only", action="store_true", help="of the results that are there")
    options = parser.parse_args()
    try:
        asked = questions({kind: getattr(options, kind) for kind in KINDS}, first_seed(options), options.release)
    except ValueError as error:
        parser.error(str(error))
    if not options.report_only:
        known = read_results(options.results)
        examine([one for one in asked if one not in known], options.results, options.workers, options.in_process)
    known = read_results(options.results)
    records = [known[one] for one in sorted(asked, key=lambda one: (KINDS.index(one.kind), one.seed)) if one in known]
    if not records:
        parser.exit(1, "no results yet\n")
    report(records, len(asked), options.docs)
    print(f"{options.docs / 'examination.md'}: {sum(map(right, records))} of {len(records)} right")


if __name__ == "__main__":
    main()
