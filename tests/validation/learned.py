"""The part "off the list" of the examination: laws that ``ridelog learn`` finds for what no effect of the list is.

    python -m tests.validation.learned                                  the whole of it: hours
    python -m tests.validation.learned --cases 1 --minutes 10            what ten minutes reach, kinds mixed
    python -m tests.validation.learned --kind flat_spot --cases 3
    python -m tests.validation.learned --kind none --kind listed --cases 10
    python -m tests.validation.learned --release                         what is published

Each case is a car of the examination's simulator with one hidden effect off the list (``simulator.outsiders``,
``simulator.newcomers``), with nothing missing (``none``), or with one effect of the list (``listed``). Its last run is
kept back. ``learn`` is asked for a law of the others, ``add-effect`` adds it, and ``compare`` says how far off the
model is on what was kept back, as it stands. Where an effect begins each drive somewhere else, as a wheel does, it is
compared after ``compare``'s refit, and with the noise.

Each case is one line of the results file as soon as it is over: stopped, it goes on where it was. Remove the file to
begin again, as one should after a change of the program. Seeds as in ``examine``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import monotonic

import numpy as np

from .cases.kept_back import KeptBack, write_kept_back
from .cases.random_case import case
from .cases.seeds import add_seed_options, first_seed, seeds
from .marking.families import DRIFT, PHASES_OF_THEIR_OWN, REMOVED_DRIFT, RIGHT, named
from .marking.marks import Goal, share
from .marking.results import appended, read_results
from .marking.sitting import NoAnswer, Question, Record, asked, fingerprint
from .simulator.effects import EFFECTS

ROOT = Path(__file__).resolve().parents[2]
NONE, LISTED = "none", "listed"
KINDS = (*RIGHT, NONE, LISTED)
COUNTS = dict.fromkeys(RIGHT, 10) | {NONE: 40, LISTED: 40}
NEAR, SECONDS = 1.10, 180.0
"""Goals: an error over what the truth reaches, and how long ``learn`` may take."""


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", action="append", choices=KINDS, metavar="KIND",
                        help=f"{', '.join(KINDS)}; may repeat (default: all)")
    parser.add_argument("--cases", type=int, metavar="N",
                        help=f"of each kind (default: {COUNTS[next(iter(RIGHT))]}, of {NONE} and {LISTED} "
                             f"{COUNTS[NONE]})")
    parser.add_argument("--minutes", type=float, default=np.inf, help="no case is begun later")
    add_seed_options(parser)
    parser.add_argument("--results", type=Path, default=ROOT / "build" / "learned.jsonl")
    parser.add_argument("--report-only", action="store_true", help="of the results that are there")
    options = parser.parse_args()
    try:
        questions = planned(options.kind or KINDS, options.cases, first_seed(options), options.release)
    except ValueError as error:
        parser.error(str(error))
    known, begun_s = read_results(options.results), monotonic()
    if not options.report_only:
        with appended(options.results) as file:
            for question in questions:
                if question not in known and monotonic() - begun_s < 60 * options.minutes:
                    known[question] = record = put(question)
                    file.write(json.dumps(record) + "\n")
                    file.flush()
                    print(reported(record), flush=True)
    records = [known[one] for one in questions if one in known]
    if not records:
        parser.exit(1, "no results yet\n")
    return max(list(_figures(records)))


def planned(kinds: Sequence[str], count: int | None, first: int, release: bool) -> list[Question]:
    """Which cases, the kinds evenly mixed. ValueError as in ``seeds``."""
    found = []
    for kind in kinds:
        of_kind = seeds(first, COUNTS[kind] if count is None else count, release)
        found += [((number + 0.5) / len(of_kind), Question(kind, seed)) for number, seed in enumerate(of_kind)]
    return [question for _, question in sorted(found)]


# --- one case ---


def put(question: Question) -> Record:
    """A case before ``learn``, and what its law is worth on what was kept back."""
    kind, seed = question.kind, question.seed
    if kind == LISTED:
        made = case("one", seed, list(EFFECTS)[seed % len(EFFECTS)])
    else:
        made = case(kind, seed) if kind == NONE else case("outsider", seed, kind)
    with tempfile.TemporaryDirectory() as name:
        given = write_kept_back(made, Path(name))
        record: Record = {**vars(question), "source": fingerprint(), "truth": given.truth, "said": None, "kept": None,
                          "failed": None, "runs": len(given.runs)}
        try:
            record["said"], record["learning"] = learned(given)
            record["kept"] = {"attainable": given.attainable_error, "floor": given.floor_error,
                              **judged(given, record["said"])}
        except NoAnswer as error:
            record["failed"] = str(error)
    return record


def law_of(given: KeptBack) -> Path:
    """Where ``learn`` writes its law."""
    return given.vehicle.with_name("law.py")


def learned(given: KeptBack) -> tuple[Record, dict[str, float]]:
    """What ``learn`` says of the runs that it may see, and what it took."""
    return asked(["learn", "--json", "--vehicle", str(given.vehicle), "--out", str(law_of(given)),
                  *map(str, given.runs)], in_process=False)


def judged(given: KeptBack, said: Record) -> Record:
    """Errors on what was kept back: of the model before, and with the law where there is one, or the known effect that
    is named in its place, as it stands and with its numbers and distances refitted. What is said to be missing beside
    the law is added first."""
    before = compared(given.vehicle, given.kept)
    found: Record = {"before": before["error"], "before_refitted": before["refitted"]["error"],
                     "without_drift": before["error_without_drift"]}
    if said["family"] is None and not said["verdict"]:
        return found
    vehicle = given.vehicle
    laws = [] if said["family"] is None else [str(law_of(given))]
    for number, name in enumerate([*said["verdict"], *laws]):
        out = given.vehicle.with_name(f"with-{number}.yaml")
        asked(["add-effect", name, "--json", "--vehicle", str(vehicle), "--out", str(out), *map(str, given.runs)],
              in_process=False)
        vehicle = out
    after = compared(vehicle, given.kept)
    return found | {"after": after["error"], "after_refitted": after["refitted"]["error"]}


def compared(vehicle: Path, run: Path) -> Record:
    """What ``compare`` says of a vehicle and a run."""
    return asked(["compare", "--json", "--vehicle", str(vehicle), str(run)], in_process=False)[0]


# --- marks ---


def family(record: Record) -> str | None:
    """Of the law that was learned; None: none was."""
    return record["said"]["family"] if record["said"] else None


def meaning(record: Record) -> str | None:
    """The family of the law; where none was learned, the most certain of the known effects that are named in its place,
    or, where a drifting sensor is what was hidden, the drift that was said to be removed. None: nothing was said."""
    if record["said"] and family(record) is None and record["said"]["verdict"]:
        return str(record["said"]["verdict"][0])
    if record["said"] and family(record) is None and RIGHT[record["kind"]].meanings == (DRIFT,):
        return REMOVED_DRIFT if record["said"]["removed"]["drift"]["error_power_share"] > 0 else None
    return family(record)


def above(record: Record) -> float:
    """The error on what was kept back over what the truth reaches there; infinite where no law was learned, and no
    drift was removed instead."""
    kept = record["kept"]
    if kept and record["kind"] in RIGHT and meaning(record) == REMOVED_DRIFT:
        return float(kept["without_drift"] / kept["floor"])
    if not kept or "after" not in kept:
        return float("inf")
    if record["kind"] in PHASES_OF_THEIR_OWN:
        return float(kept["after_refitted"] / kept["floor"])
    return float(kept["after"] / kept["attainable"])


def right_family(record: Record) -> bool:
    """Whether the law is of a family that means what was hidden."""
    return named(record["kind"], meaning(record))


def prefers_the_list(record: Record) -> bool:
    """Whether ``learn`` learned no law, or said of its law that it is nearly the effect that was hidden."""
    if no_law(record):
        return True
    nearest = record["said"]["nearest"] if record["said"] else None
    return bool(nearest and nearest["as_good"]
                and nearest["effect"] in [one["name"] for one in record["truth"]["effects"]])


def no_law(record: Record) -> bool:
    """Whether ``learn`` answered, and learned no law."""
    return record["said"] is not None and family(record) is None


def goals(records: Sequence[Record]) -> list[Goal]:
    """All that are shares of cases."""
    off_list = [one for one in records if one["kind"] in RIGHT]
    nothing, listed = ([one for one in records if one["kind"] == kind] for kind in (NONE, LISTED))
    return [
        Goal(f"Off the list: error on what was kept back at most {NEAR:.2f} times what the truth reaches", 0.80, True,
             share(off_list, lambda one: above(one) <= NEAR)),
        Goal("Off the list: right family named", 0.70, True, share(off_list, right_family)),
        Goal("Nothing missing: a law learned, or no answer", 0.0, False, share(nothing, lambda one: not no_law(one))),
        Goal("An effect of the list: no law is learned, or it is said to be that effect", 0.95, True,
             share(listed, prefers_the_list)),
    ]


def reported(record: Record) -> str:
    """One line of a case."""
    strengths = ", ".join(f"{one['name']} {one['strength']:.1f}" for key in ("effects", "outsiders")
                          for one in record["truth"][key]) or "nothing"
    head = f"{record['kind']} {record['seed']}: {strengths}"
    if record["failed"]:
        return f"{head} -> NO ANSWER: {record['failed']}"
    kept, took = record["kept"], f"{record['learning']['wall_s']:.0f} s"
    if family(record) is None:
        mark = "WRONG" if record["kind"] in RIGHT and not right_family(record) else "right"
        times = f"; {above(record):.2f}" if "after" in kept else ""
        return f"{head} -> {mark}: {record['said']['words']}{times}; {took}"
    mark = "right" if record["kind"] in RIGHT and right_family(record) else "WRONG"
    return (f"{head} -> {mark}: {family(record)} ({record['said']['words']}); error {kept['before']:.3f}, with the "
            f"law {kept['after']:.3f}, refitted {kept['after_refitted']:.3f}; the truth {kept['attainable']:.3f}, the "
            f"noise {kept['floor']:.3f}: {above(record):.2f}; {took}")


def _figures(records: Sequence[Record]) -> Iterator[int]:
    """Print each figure beside its goal; 1 for each that is missed."""
    for kind in RIGHT:
        of_kind = [one for one in records if one["kind"] == kind]
        if of_kind:
            print(f"{kind}: near {share(of_kind, lambda one: above(one) <= NEAR).count}, family "
                  f"{share(of_kind, right_family).count} of {len(of_kind)}")
    for goal in goals(records):
        if goal.found.of:
            print(f"{goal.name}: {goal.found.count} of {goal.found.of} ({goal.found.value:.0%}), goal {goal.wanted}")
            yield int(not goal.met)
    took = sorted((one["learning"]["wall_s"], one["runs"]) for one in records if one.get("learning"))
    if took:
        print(f"learn: median {took[len(took) // 2][0]:.0f} s, longest {took[-1][0]:.0f} s (of {took[-1][1]} runs), "
              f"goal {SECONDS:g} s for four runs of 60 s")
        yield int(took[-1][0] > SECONDS)


if __name__ == "__main__":
    raise SystemExit(main())
