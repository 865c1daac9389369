"""Run a recorded drive through the service and show the result; needs no hardware.

The drive is simulated: a half car over generated roads, recorded as the bytes that a BMA220 and a GPS would have
sent. It goes through recorded buses into the real drivers and the real service. --lab finds what a car has that its
model lacks; --field does so from recorded bytes, and shows how the IRI improves. --car learns an unmeasured car
from four drives. --years compares two years of a road.

  ridelog demo
  ridelog demo --lab
  ridelog demo --field
  ridelog demo --car
  ridelog demo --years
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

from logger.api.lab.question import CompareQuestion
from logger.commands.lab import say, take, walk
from logger.commands.options import on_screen, progress, warned, wipe
from logger.commands.replay import ReplayQuestion, replayed
from logger.demo import BEYOND, CAR, DRIVES, FIELD, FOURTH, LAB, LINE, TrueCar
from logger.errors import EXIT_DONE, BadInput
from logger.files import make_folder, together, write_file, write_text
from logger.printable import silent
from logger.report.quantities import columns, wrapped

if TYPE_CHECKING:
    from logger.api.extraction import Extracted
    from logger.api.lab.loop import Say, Story
    from logger.chart_data import Curves
    from logger.estimation.batch import Assessment


REPORT_NAME, DUMP_NAME = "report.html", "drive.dump.gz"
DRIVE_DIR, LAB_DIR, FIELD_DIR, CAR_DIR, YEARS_DIR = (
    "ridelog-demo", "ridelog-lab", "ridelog-field", "ridelog-car", "ridelog-years")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog demo``."""
    shown = parser.add_mutually_exclusive_group()
    for name, (_, folder, words) in _SHOWN.items():
        shown.add_argument(f"--{name}", dest="what", action="store_const", const=name,
                           help=f"{words} (folder: {folder})")
    parser.add_argument("--out", metavar="DIR", type=Path, help=f"folder for what is written (default: {DRIVE_DIR})")
    parser.add_argument("--unpack", action="store_true",
                        help="with one of these: only write the drives, so that you can find the answer yourself")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog demo``."""
    if args.unpack and args.what is None:
        raise BadInput("demo: expected --lab, --field, --car or --years with --unpack")
    if args.what is None:
        _drive(args.out or Path(DRIVE_DIR), args.json)
    else:
        show, folder, _ = _SHOWN[args.what]
        show(args.out or Path(folder), args.unpack, args.json)
    return EXIT_DONE


def _drive(out: Path, as_json: bool) -> None:
    """The drive through the service."""
    from logger.commands.report import write_report

    dump = out / DUMP_NAME
    make_folder(out)
    write_file(dump, [(resources.files("logger.demo") / DUMP_NAME).read_bytes()])
    with progress() as notify:
        outcome = replayed(ReplayQuestion(dump=dump, out=out, progress=notify))
    report = out / REPORT_NAME
    write_report([(log, None) for log in outcome.files], report)
    if as_json:
        print(json.dumps(outcome.as_json() | {"report": str(report), "dump": str(dump)}))
    else:
        print(outcome.text)
        print(f"Recording: {dump} (ridelog replay and ridelog extract read it)")
        print(f"Report: {report} (open it in a browser; it needs no network)")


_UNMEASURED = (
    "A box in an old car recorded four ordinary drives over four roads, at 30 to 100 km/h. Nobody measured the roads, "
    "and nothing but the car's wheelbase is known. All of it is simulated. What car is this?"
)
_ORDINARY = ((30.0, "C"), (50.0, "C"), (70.0, "B"), (100.0, "B"))
"""Speed of each drive [km/h] and class of its road; each lasts ``_ORDINARY_S``."""
_ORDINARY_S = 200.0


def car(out: Path, unpack_only: bool, as_json: bool) -> None:
    """Write drives of a car that nobody measured into ``out``, and learn it as ``ridelog learn-car`` does."""
    import numpy as np

    from logger.api.drives import simulate
    from logger.api.inputs import read_vehicle, write_run
    from logger.api.roads import random_road
    from logger.vehicle.published_cars import NUMBERS, coordinates_of

    given = read_vehicle(CAR.vehicle)
    true = given.with_numbers({name: given.numbers[name] * factor for name, factor in CAR.off.items()})
    folders = [out / f"{kmh:g}kmh" for kmh, _ in _ORDINARY]
    for number, (folder, (kmh, iso_class)) in enumerate(zip(folders, _ORDINARY, strict=True), 1):
        road = random_road(iso_class=iso_class, length_m=_ORDINARY_S * kmh / 3.6, seed=number)
        drive = simulate(true, road, kmh / 3.6, noise_mps2=0.147, step_mps2=0.153, seed=number)
        write_run(folder, replace(drive, profile=None))
    assert true.vehicle.rear is not None
    wheelbase_m = true.vehicle.front.cg_distance_m + true.vehicle.rear.cg_distance_m
    learned = out / "mycar.yaml"
    words = [*map(str, folders), "--wheelbase", f"{wheelbase_m:.2f}", "--out", str(learned), "--out",
             str(learned.with_suffix(".html"))]
    _typed_for(_UNMEASURED, "learn-car", words, {"runs": list(map(str, folders)), "wheelbase_m": wheelbase_m}
               if unpack_only else None, as_json)
    if unpack_only:
        return
    if not as_json:
        was, found = (np.exp(coordinates_of(one.vehicle)) for one in (true, read_vehicle(learned)))
        rows = [(name, f"{was[at]:.3f}", f"{found[at]:.3f}") for at, name in enumerate(NUMBERS)
                if name.endswith(("_hz", "damping_ratio"))]
        head = ["", "True values of the simulated car:", ""]
        print("\n".join([*head, *columns([("Parameter", "True", "Found"), *rows])]))


_TWO_YEARS = (
    "A box recorded six drives along one road, three in June 2025 and three in June 2026. In between, 200 m broke up "
    "and 200 m were repaved. All of it is simulated. What changed, and where?"
)


def years(out: Path, unpack_only: bool, as_json: bool) -> None:
    """Unpack the logs of two years into ``out``, and compare them as ``ridelog passes`` does."""
    folders = sorted({str(path.parents[1]) for path in unpacked("years.zip", out)})
    _typed_for(_TWO_YEARS, "passes", [*folders, "--split", "2026", "--out", str(out / "changes.html")],
               {"logs": folders} if unpack_only else None, as_json)


def _typed_for(introduction: str, verb: str, words: Sequence[str], only: Mapping[str, Any] | None, as_json: bool
               ) -> None:
    """Introduce a command and run it; ``only``: say what was unpacked and what to type, and run nothing."""
    from logger.commands.main import command

    typed = " ".join(["ridelog", verb, *words])
    if only is not None:
        print(json.dumps(only) if as_json else f"Next: {typed}")
        return
    if not as_json:
        print(f"{wrapped([introduction])}\n\n    {typed}\n")
    parser, run_it = command(verb)
    run_it(parser.parse_args([*words, *(["--json"] if as_json else [])]))


_INTRODUCTION = (
    "Somebody drove a RAV4 along two poor town streets with speed bumps, slowly on one and briskly on the other, with "
    "an accelerometer on the body. Both streets had been measured, and the car's file, rav4-2009, comes with ridelog. "
    "This car has something that its file lacks, and the lab finds out what."
)
_LAB_EXPLAINED = {
    "compare": "First question: does the model fail at all, or are only its parameters a little off? Nominal masses "
               "and springs are never exact, so compare refits them within a few per cent; only the residual after "
               "that is evidence.",
    "diagnose": "Second question: which physical effect would explain the residual? diagnose simulates each effect "
                "that ridelog knows, fits it together with the car's parameters on two thirds of each drive, and "
                "judges it on the other third.",
    "add": "add-effect fits the effect on all drives, with the car's parameters. The table shows how the missing "
           "effect had biased masses, springs and dampers: they looked like results, and were wrong.",
    "again": "The same comparison once more, with the new vehicle file.",
}


def lab(out: Path, unpack_only: bool, as_json: bool) -> None:
    """Unpack the drives into ``out`` and find what is missing."""
    from logger.api.lab.bench import bench_with, require_compiler, sought_effects
    from logger.api.lab.loop import chapter

    if not unpack_only:
        require_compiler("ridelog demo --lab", sought_effects().values())
    folders = unpack(out)
    drives = " ".join(map(str, folders))
    if unpack_only:
        print(json.dumps({"vehicle": LAB.vehicle, "runs": list(map(str, folders))}) if as_json else
              f"Two drives: {drives}\nNext: ridelog compare --vehicle {LAB.vehicle} {drives}")
        return
    if not as_json:
        print(wrapped([_INTRODUCTION]))
    given = bench_with(CompareQuestion(LAB.vehicle, folders, warn=warned))
    found = walk(given, out, take, silent if as_json else say, _explained)
    if as_json:
        print(json.dumps(found.as_json(), allow_nan=False))
        return
    sentence, table = truth_beside(found.story, LAB)
    print("\n".join([*chapter("The answer"), wrapped([sentence]), "", *table]))


def _explained(chapter: str, _effect: str, _vehicle: str) -> str:
    return wrapped([_LAB_EXPLAINED[chapter]]) if chapter in _LAB_EXPLAINED else ""


def unpack(out: Path) -> list[Path]:
    """Write the drives below ``out``, as ``unpacked``; their folders."""
    return sorted({path.parent for path in unpacked("lab.zip", out)}, reverse=True)


def truth_beside(story: Story, car: TrueCar) -> tuple[str, list[str]]:
    """What a simulated car truly was, and what was found: a sentence, and the lines of a table."""
    from logger.report.quantities import numbers_of

    found = {one.effect.name for one in story.last.effects}
    rows = [("Parameter", "True", "Without", "With")]
    rows += [(one.name, f"{car.off.get(one.name, 1.0) - 1:+.1%}", f"{one.without / one.nominal - 1:+.1%}",
              f"{one.found / one.nominal - 1:+.1%} ± {one.standard_error / one.found:.1%}") for one in story.moved]
    numbers = ", ".join(f"{name} {value:.3g}" for name, value in car.values.items())
    mine = numbers_of(story.rounds[-1].addition.new[-1]) if car.effect in found else "nothing of the kind"
    return (f"The drives were simulated. The car had {car.effect}, {numbers}; found: {mine}. Difference of its "
            "parameters from its file:", columns(rows))


PAGE, RUNS = "field.html", "runs"
_ABOUT = (
    "A box in a RAV4 recorded three drives along one street, slowly, briskly and fast, and a fourth over the street "
    "beyond. Drives two and four come from the box's BMA220, which reads in steps of 0.6 m/s2, drives one and three "
    "from a serial accelerometer. Both streets had been measured. All of it is simulated: car, streets and GPS, down "
    "to the bytes.",
    "This car has something that its file, rav4-2009, lacks, and that makes the IRI wrong. The lab finds it from the "
    "first three drives; the fourth shows whether the lab was right.",
)
_EXPLAINED = {
    "extract": "First, extract turns the bytes into runs. Look at the positions: GPS fixes are late and a metre or two "
               "off, but the car felt the measured road, and that shows where it was.",
    "before": "What IRI does the box give for the fourth street? Look at the bias, and at the share of windows within "
              "two standard errors (ideal: 95%). On a street that nobody measured, nothing would show the error.",
    "compare": "Does the model fail on the three drives, or are only its parameters a little off? compare first refits "
               "them within a few per cent. Look at the residual that remains, and where it is.",
    "diagnose": "Which physical effect would explain that? Look at the p-value, and at the NRMSE on held-out "
                "stretches: with the right effect it falls to the noise floor.",
    "add": "ridelog fits the effect and the car's parameters on all three drives. Look at the parameters that the "
           "missing effect had biased.",
    "again": "Is that all? Look for anything that is more than noise.",
    "after": "The same estimate with the new file. The lab has never seen this drive.",
}


def field(out: Path, unpack_only: bool, as_json: bool) -> None:
    """Unpack the drives into ``out``, find what is missing, and judge the fourth with and without it."""
    from logger.api.lab.bench import require_compiler
    from logger.api.lab.loop import as_json as story_json
    from logger.api.lab.loop import ending, figures_of, iri_blocks
    from logger.report.blocks import text
    from logger.store.formats.effect_file import shipped_effects

    if not unpack_only:
        require_compiler("ridelog demo --field", shipped_effects().values())
    unpacked("field.zip", out)
    first, fourth = [out / f"{name}.dump.gz" for name in DRIVES], out / f"{FOURTH}.dump.gz"
    commands = _Commands(out, first, fourth, FIELD.vehicle)
    if unpack_only:
        print(json.dumps({"vehicle": FIELD.vehicle, "dumps": [*map(str, first), str(fourth)],
                          "lines": [str(out / LINE), str(out / BEYOND)]}) if as_json else
              f"Four drives and two measured lines in {out}\nNext: {commands.extract()[0]}")
        return
    tell: Say = silent if as_json else say
    tell([wrapped(_ABOUT)])
    tell(_headed("Extract", "extract", *commands.extract()))
    extracted = [*(_extracted(one, out, LINE, tell) for one in first), _extracted(fourth, out, BEYOND, tell)]
    before = _judged(out / RUNS / FOURTH, FIELD.vehicle, "The fourth drive, with the original file", "before", commands,
                     tell)
    story = _story(commands, out, tell)
    last = story.rounds[-1].file if story.rounds else FIELD.vehicle
    after = _judged(out / RUNS / FOURTH, last, "The fourth drive, with the new file", "after", commands, tell)
    page, sentence, table = out / PAGE, *truth_beside(story, FIELD)
    _write_page(page, out, story, before, after, sentence)
    tell(["", "=== The end ===", "", text([*ending(story), *iri_blocks(before, after)]), "",
          f"All of it as a page: {page} (open it in a browser; it needs no network)"])
    tell(["", "=== The answer ===", "", wrapped([sentence]), "", *table])
    if as_json:
        print(json.dumps({"runs": [one.as_json() for each in extracted for one in each.runs], **story_json(story),
                          "fourth": {"before": figures_of(before), "after": figures_of(after)}, "page": str(page),
                          "truth": {"effect": FIELD.effect, "parameters": dict(FIELD.values),
                                    "numbers_times": dict(FIELD.off)}}, allow_nan=False))


def unpacked(archive: str, out: Path) -> list[Path]:
    """Write the files of an archive of this folder below ``out``, where they may be already; their paths.

    Raises BadInput, and writes nothing, where something else of one of their names is there; OSError as ``open``.
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out {out}: expected a folder")
    with resources.as_file(resources.files("logger.demo") / archive) as file, ZipFile(file) as kept:
        contents = {out / name: kept.read(name) for name in kept.namelist()}
    for path, content in contents.items():
        if path.parent.exists() and not path.parent.is_dir():
            raise BadInput(f"{path.parent}: expected a folder, or nothing; choose another folder with --out")
        if path.exists() and not (path.is_file() and path.read_bytes() == content):
            raise BadInput(f"{path}: expected nothing there, or the demo's own file, found something else; choose "
                           "another folder with --out")
    with together():
        for path, content in contents.items():
            make_folder(path.parent)
            write_file(path, [content])
    return list(contents)


# --- steps ---


class _Commands:
    """What a person types for each step."""

    def __init__(self, out: Path, first: list[Path], fourth: Path, vehicle: str) -> None:
        self._out, self._first, self._fourth, self.vehicle = out, first, fourth, vehicle
        self.runs = [out / RUNS / name for name in DRIVES]
        self._listed = " ".join(map(str, self.runs))

    def extract(self) -> tuple[str, str]:
        runs = self._out / RUNS
        return (f"ridelog extract {' '.join(map(str, self._first))} --out {runs} --profile {self._out / LINE}",
                f"ridelog extract {self._fourth} --out {runs} --profile {self._out / BEYOND}")

    def estimate(self, folder: Path, vehicle: str) -> str:
        return f"ridelog estimate {folder} --vehicle {vehicle}"

    def explain(self, chapter: str, effect: str, vehicle: str) -> str:
        """Of the steps of ``loop.go_through``."""
        command = {
            "compare": f"ridelog compare --vehicle {vehicle} {self._listed}",
            "diagnose": f"ridelog diagnose --vehicle {vehicle} {self._listed}",
            "add": f"ridelog add-effect {effect} --vehicle {self.vehicle} --out {vehicle} {self._listed}",
            "again": f"ridelog compare --vehicle {vehicle} {self._listed}",
        }[chapter]
        if chapter == "again":
            self.vehicle = vehicle  # what the next effect is added to
        return _typed(chapter, command)


def _extracted(dump: Path, out: Path, line: str, tell: Say) -> Extracted:
    from logger.api.extraction import extract_dump, read_measured_profile
    from logger.commands.extract import lines

    try:
        found = extract_dump(dump, out / RUNS, None, read_measured_profile(out / line), on_screen())
    finally:
        wipe()
    tell(lines(dump, found))
    return found


def _story(commands: _Commands, out: Path, tell: Say) -> Story:
    from logger.api.lab.bench import bench_with
    from logger.api.lab.loop import go_through, make_ready

    given = bench_with(CompareQuestion(commands.vehicle, commands.runs, warn=warned))
    make_ready(given, out, "--out")
    return go_through(given, out, take, tell, progress, commands.explain)[0]


def _judged(folder: Path, vehicle: str, title: str, why: str, commands: _Commands, tell: Say) -> Assessment:
    """The road of a drive, read in the steps that its record says, as ``ridelog estimate`` finds it."""
    from logger.api.drives import as_json, assessed, blocks, sensor_of
    from logger.api.inputs import checked_run
    from logger.report.blocks import Hint, Lines, Table, text
    from logger.shipped import vehicle_path
    from logger.store.formats.record_checks import RecordRules
    from logger.store.formats.vehicle_file import read_model
    from logger.units import WINDOW_M

    tell(_headed(title, why, commands.estimate(folder, vehicle)))
    with progress() as say:
        say("estimating the road")
        drive, _ = checked_run(folder, RecordRules(None, None))
        found = assessed(drive, read_model(vehicle_path(vehicle)), *sensor_of(drive), WINDOW_M)
    # Of what is printed: the mean, and the table's head, last row and remark.
    content = list(blocks(found, as_json(str(folder), found)))
    answer, table, remark = (next(one for one in content if isinstance(one, kind)) for kind in (Lines, Table, Hint))
    assert isinstance(answer, Lines) and isinstance(table, Table)
    tell([text([Lines(answer.lines[:1]), replace(table, rows=table.rows[-1:]), remark])])
    return found


# --- what it came to ---


def _write_page(file: Path, out: Path, story: Story, before: Assessment, after: Assessment, sentence: str) -> None:
    from logger.api.lab.loop import field_page

    write_text(file, field_page(f"{FIELD.vehicle}: four drives, and what was missing", _ABOUT, ways(out), story, before,
                                after, [sentence.partition(" Difference")[0]]))


def ways(out: Path) -> Curves:
    """A map of the measured lines, and of the drives: a place a second."""
    from logger.api.extraction import RATE_HZ
    from logger.chart_data import Curves, Line
    from logger.geodesy import east_and_north_m
    from logger.store.formats.drive_file import DRIVE, PLACE, read_columns
    from logger.store.formats.profile_file import read_places

    places = {name: list(read_places(out / name)[1:]) for name in (LINE, BEYOND)}
    for name in (*DRIVES, FOURTH):
        _, columns = read_columns(out / RUNS / name / DRIVE)
        places[name] = [columns[one][::round(RATE_HZ)] for one in PLACE]
    lat0_deg, lon0_deg = (float(one[0]) for one in places[LINE])
    return Curves("The drives", "east [m]", "north [m]", tuple(
        Line(name, *east_and_north_m(lat_deg, lon_deg, lat0_deg, lon0_deg), dots=name not in (LINE, BEYOND))
        for name, (lat_deg, lon_deg) in places.items()), equal=True)


# --- words ---


def _headed(title: str, why: str, *commands: str) -> list[str]:
    from logger.api.lab.loop import chapter

    return chapter(title, _typed(why, *commands))


def _typed(why: str, *commands: str) -> str:
    """What a step is for, and what to type for it."""
    return "\n".join([wrapped([_EXPLAINED[why]]), "", *(f"    {one}" for one in commands)])


_SHOWN = {
    "lab": (lab, LAB_DIR, "show the lab: from two drives it finds what the model of a car lacks"),
    "field": (field, FIELD_DIR, "show the way from recordings in a car to a better IRI: four drives, two roads"),
    "car": (car, CAR_DIR, "learn the springs and dampers of an unmeasured car from four ordinary drives"),
    "years": (years, YEARS_DIR, "show what changed on a road between two years: six drives"),
}
"""What can be shown instead of a drive through the service, the folder for it, and its help."""
