"""Before anybody drives: which effects drives could show and distinguish, and which drive would add most.

The answer, its words for a person and for a program, and the page with numbers of pairs as shaded cells.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.inputs import model_of, read_profile
from logger.api.lab.bench import Bench, among, bench_with, planned_bench, tolerance_of, word_of
from logger.api.lab.question import PlanQuestion
from logger.api.lab.words import not_tried
from logger.api.shared_fields import each
from logger.api.shown import CommandResult
from logger.chart_data import Array
from logger.errors import BadInput
from logger.estimation.sensor_noise import NOISE_MPS2
from logger.lab.plan import ISOLABLE_SIGMA, DriveOption, LabNextDrive, LabPlan, PlannedCar, SensorNoise, at_speed
from logger.lab.plan import plan as planned_by_lab
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.profiles.track import Track
from logger.question import function
from logger.report import document as doc
from logger.report.blocks import SHOWN_ROWS, Block, Blocks, Bullets, Detail, Hint, Section, Table, page
from logger.report.quantities import some
from logger.runs import LEAST_S, Past, Run
from logger.store.formats import drive_file, profile_file, vehicle_file


@dataclass(frozen=True)
class NextDrive:
    """A further drive that ``plan`` proposes.

    do            in words
    gains         deviations by which effects would be separated better from what is most like them
    more_named    how many more effects ``diagnose`` would name, were each of them there by itself
    """

    do: str
    gains: Mapping[str, float]
    more_named: float


@dataclass(frozen=True, eq=False, repr=False)
class Plan(CommandResult):
    """Which effects of usual strength drives could show, in standard deviations, with the car's parameters and the
    distances free within their tolerance.

    found            all that the lab says, of the ``vehicle`` of this name
    detectability    by how much each effect stands out, by name
    isolability      what of the first effect remains when the second one is fitted in its place, by both names
    groups           effects that would be detected, but not separated from each other
    next             drives that may come next, those that add most first
    noise_mps2       of the accelerometer, rounding in it [m/s2]
    """

    found: LabPlan
    vehicle: str
    detectability: Mapping[str, float]
    isolability: Mapping[str, Mapping[str, float]]
    groups: tuple[tuple[str, ...], ...]
    next: tuple[NextDrive, ...]
    noise_mps2: float

    def figures(self) -> list[doc.Html]:
        """The matrix of what remains of one effect when another is fitted."""
        return [figure(self.found)]

    def as_page(self, of: str) -> doc.Html:
        """The plan as one HTML document."""
        drives = ", ".join(f"{name}, {seconds:.0f} s" for name, seconds in self.found.drives)
        return page(f"{self.vehicle}: which effects could these drives show?", drives, self.blocks())


@function(PlanQuestion)
def plan(question: PlanQuestion) -> Plan:
    model, bench = model_of(question.vehicle), None
    tolerance = tolerance_of(question.tolerance, model)
    road = None if question.profile is None else drive_file.track_of(
        question.profile if isinstance(question.profile, profile_file.Wheelpaths) else read_profile(question.profile))
    if each(question.runs):
        bench = bench_with(question, "ridelog plan")
        if alone := next((run.name for run in bench.runs.runs if run.past is Past.FREE), None):
            raise BadInput(f"{alone}: expected a run that something drives, as a plan repeats it: nothing drives this")
    elif not question.speeds_mps:
        raise BadInput("plan: expected a run, or --profile and --speed of a planned drive")
    drives = _empty_drives(model, road, question)
    ready = bench or planned_bench(word_of(question.vehicle, model), model, drives,
                                   list(map(str, question.effect_files)), tolerance)
    posterior = ready.posterior(searches=True)
    there = PlannedCar(posterior.vehicle, posterior.start_vehicle, tolerance, model.effects,
                       posterior.prior.logs(posterior.vehicle, posterior.start_vehicle))
    usual = SensorNoise(NOISE_MPS2, question.step_mps2)
    noise = None if question.noise_mps2 is None else SensorNoise(question.noise_mps2, question.step_mps2)
    with ready.blamed():
        found = planned_by_lab(there, None if bench is None else posterior, drives,
                               among(ready.effects, question.candidates), noise, usual, road or _longest_road(bench),
                               question.progress)
    summary = as_json(found)
    return Plan(Blocks(plan_blocks(found)), summary, found, model.vehicle.name, summary["detectability"],
                summary["isolability"], tuple(map(tuple, found.groups)),
                tuple(NextDrive(do_words(one.option), dict(one.gains), one.more_named) for one in found.next),
                summary["noise_mps2"])


def _empty_drives(model: vehicle_file.CarModel, road: Track | None, question: PlanQuestion) -> list[Run]:
    """The drives that are planned. WrongOption for one that is too short, or too long to be simulated."""
    name = str(question.profile) if isinstance(question.profile, Path | str) else "profile"
    found = []
    for speed in question.speeds_mps:
        assert road is not None
        seconds = (road.end_m - road.start_m) / speed
        if seconds < LEAST_S:
            raise question.wrong("speeds_mps", f" {speed:g}: expected a drive of {LEAST_S:g} s or longer, found "
                                               f"{seconds:.3g} s over {name}")
        try:
            found.append(at_speed(f"{name} at {speed:g} m/s", road, model.vehicle, speed))
        except ValueError as error:
            raise question.wrong("speeds_mps", f" {speed:g}: {error}") from None
    return found


def _longest_road(bench: Bench | None) -> Track | None:
    """Of the runs; None where none has one."""
    roads = [] if bench is None else [run.track for run in bench.runs.runs if isinstance(run.track, Track)]
    return max(roads, key=lambda one: float(np.subtract(one.end_m, one.start_m)), default=None)


SENSOR_HINT = ("Assumed noise: a second accelerometer as noisy as the first, a travel sensor 0.5 mm, a gyroscope 0.001 "
               "rad/s.")
_OBSTACLES = {"bump": "a speed bump {height_m:g} m high and {width_m:g} m long",
              "plate": "a plank {height_m:g} m high and {length_m:g} m long"}
_SENSES = {"acceleration": "an accelerometer on", "travel": "a travel sensor at", "pitch_rate": "a pitch gyroscope on"}


def summary(found: LabPlan) -> list[str]:
    """What the drives could show, all together: paragraphs."""
    seconds = sum(each for _, each in found.drives)
    count = len(found.drives)
    chances = found.now.chances
    named = int((chances > 0.5).sum())
    from_where = ("as in the runs" if found.measured else "as given, or the usual one")
    lines = [f"ridelog diagnose would name {named} of {len(found.names)} effects, each alone and of usual strength, "
             f"from {count} drive{'s' * (count != 1)} of {seconds:.0f} s in all with noise of "
             f"{found.noise.variance**0.5:.3g} {found.unit} r.m.s. ({from_where})."]
    if found.groups:
        lines.append("Detected, but not distinguished: " + "; ".join(", ".join(one) for one in found.groups) + ".")
    hidden = [name for name, each in zip(found.names, found.now.detectability, strict=True) if each < DETECTABLE_SIGMA]
    if hidden:
        lines.append(f"Too faint to detect: {', '.join(hidden)}.")
    return lines + not_tried(found.obstacles)


def rows(found: LabPlan) -> list[tuple[str, str, str, str, str]]:
    """Each effect, those that stand out most first: by how much, by how much it is separated from what, and what that
    means."""
    made = []
    for index in sorted(range(len(found.names)), key=lambda one: -found.now.detectability[one]):
        alone, apart = float(found.now.detectability[index]), float(found.now.isolability[index])
        near = int(found.now.nearest[index])
        like = found.names[near] if near != index and alone >= DETECTABLE_SIGMA else ""
        made.append((found.names[index], number(alone), number(apart), like, _judged(alone, apart)))
    return made


def _judged(alone: float, apart: float) -> str:
    if alone < DETECTABLE_SIGMA:
        return "too faint"
    return "can be named" if apart >= ISOLABLE_SIGMA else "not distinguished"


def number(deviations: float) -> str:
    """Of standard deviations."""
    return f"{deviations:.1f}" if deviations < 100 else f"{deviations:.0f}"


def meaning() -> str:
    """What the numbers are."""
    return ("Detectability: by how many standard deviations the effect would stand out after a refit of the model and "
            f"the distances; {DETECTABLE_SIGMA:g} needed. Isolability: how many remain when the most similar effect is "
            f"fitted in its place; {ISOLABLE_SIGMA:.1f} needed.")


def plan_blocks(found: LabPlan) -> Iterator[Block]:
    """What a person reads of a plan."""
    yield doc.tiles([
        ("Effects that could be named", f"{int((found.now.chances > 0.5).sum())}", f"of {len(found.names)}"),
        ("Too faint", f"{int((found.now.detectability < DETECTABLE_SIGMA).sum())}", ""),
        ("Groups not distinguished", f"{len(found.groups)}", ""),
        ("Noise", f"{found.noise.variance**0.5:.3g}", "m/s2 r.m.s.")])
    yield from summary(found)
    yield Detail("Which effects are distinguished", [figure(found)])
    yield Section("Each effect", [Table(("Effect", "Detectability", "Isolability", "Most like", ""), rows(found),
                                        (0, 3, 4)), Hint(meaning())])
    if found.next:
        yield Section("Drives that would add most", [
            *(f"{number}. {next_words(one)}" for number, one in enumerate(found.next[:SHOWN_ROWS], 1)),
            Hint(SENSOR_HINT)])
    else:
        yield "No further drive to propose: the road is too short, or too rough for these speeds."
    yield Detail("Sources", [Bullets([
        "G. Cowan, K. Cranmer, E. Gross, O. Vitells, European Physical Journal C 71, 1554 (2011): what is expected to "
        "be found, from one data set without noise."])])


def do_words(option: DriveOption) -> str:
    """What is to be done."""
    words = (f"The same excitation again, {option.seconds:.0f} s" if option.speed_mps is None else
             f"{option.seconds:.0f} s over this road at {option.speed_mps:.3g} m/s")
    if option.obstacle is not None:
        laid = _OBSTACLES[option.obstacle.name].format(**option.obstacle.parameters)
        words += f", with {laid} on it at {option.obstacle.parameters['start_m']:.0f} m"
    if option.signal is not None:
        place = (f"the body {option.signal.ahead_m:.2f} m ahead of its centre of gravity" if option.signal.ahead_m else
                 f"the {option.signal.of.replace('_', ' ')}")
        words += f", with {_SENSES[option.signal.measures]} {place}"
    return words


def next_words(one: LabNextDrive) -> str:
    """What is to be done, and what it brings."""
    if not one.gains:
        return f"{do_words(one.option)}: adds next to nothing."
    gains = some([f"{name} {number(each)}" for name, each in one.gains.items()])
    count = f"{one.more_named:.1f} more effects named" if one.more_named >= 0.05 else "no more effects named"
    return (f"{do_words(one.option)}: {count} (expected). Standard deviations gained: {gains}.")


def as_json(found: LabPlan) -> dict[str, Any]:
    """One object: see the formats of ridelog. What remains of an effect after itself is fitted is not in it."""
    now, names = found.now, found.names
    return {
        "drives": [{"drive": name, "seconds": seconds} for name, seconds in found.drives],
        "noise_mps2": found.noise.variance**0.5, "noise_measured": found.measured,
        "effects": {one.effect.name: dict(one.values) for one in found.effects},
        "detectability": dict(zip(names, map(float, now.detectability), strict=True)),
        "isolability": {name: {other: float(now.pairwise[row, column]) for column, other in enumerate(names)
                               if column != row} for row, name in enumerate(names)},
        "groups": [list(one) for one in found.groups], "left_out": dict(found.obstacles),
        "next": [{"do": do_words(one.option), "gains": dict(one.gains), "more_named": one.more_named}
                 for one in found.next],
    }


def figure(found: LabPlan) -> doc.Html:
    """The matrix: each row an effect that is there; in its own column how far it stands out, in the others what remains
    when that one is fitted in its place. Those that stand out most first."""
    order = np.argsort(-found.now.detectability, kind="stable")
    return heat_map("Standard deviations that remain of a row's effect when the column's effect is fitted in its "
                    "place; framed: its detectability",
                    [found.names[one] for one in order], found.now.pairwise[np.ix_(order, order)],
                    ISOLABLE_SIGMA)


_CELL_PX, _HIGH_PX, _LEFT_PX, _TOP_PX, _ROOM_PX = 40, 24, 190, 150, 60


def heat_map(title: str, names: Sequence[str], values: Array, least: float) -> doc.Html:
    """The figure element of values (n, n): one row and one column for each name, the diagonal framed.

    What is below ``least`` is red, what is above it blue, and darker the farther, by its logarithm.
    """
    full = max(float(values.max(initial=0.0)), 2 * least)
    width, height = _LEFT_PX + _CELL_PX * len(names) + _ROOM_PX, _TOP_PX + _HIGH_PX * len(names) + 8
    heads = doc.concatenated(
        doc.html('<text transform="translate({:.0f} {}) rotate(-55)">{}</text>', _LEFT_PX + _CELL_PX * (column + 0.5),
                 _TOP_PX - 8, name) for column, name in enumerate(names))
    rows = doc.concatenated(
        doc.html('<text x="{}" y="{}" text-anchor="end">{}</text>', _LEFT_PX - 8, _TOP_PX + _HIGH_PX * row + 17, name)
        + doc.concatenated(_cell(row, column, float(values[row, column]), least, full) for column in range(len(names)))
        for row, name in enumerate(names))
    return doc.html('<figure><figcaption>{}</figcaption><svg class="plot" viewBox="0 0 {} {}" role="img" '
                    'aria-label="{}">{}{}</svg></figure>', title, width, height, title, heads, rows)


def _cell(row: int, column: int, value: float, least: float, full: float) -> doc.Html:
    x, y = _LEFT_PX + _CELL_PX * column, _TOP_PX + _HIGH_PX * row
    shade = min(abs(log(max(value, least**2 / full) / least)) / log(full / least), 1.0)
    colour = "--c0" if value >= least else "--c4"
    frame = "stroke:var(--ink);stroke-width:1.5" if row == column else "stroke:none"
    ink = "#fff" if shade > 0.5 else "var(--ink)"
    return doc.html('<rect x="{}" y="{}" width="{}" height="{}" style="fill:var({});fill-opacity:{:.2f};{}"/>'
                    '<text x="{}" y="{}" text-anchor="middle" style="fill:{};font-size:11px">{}</text>',
                    x + 1, y + 1, _CELL_PX - 2, _HIGH_PX - 2, colour, shade, frame, x + _CELL_PX // 2, y + 16, ink,
                    f"{value:.1f}" if value < 10 else f"{value:.0f}")
