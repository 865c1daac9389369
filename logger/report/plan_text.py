"""A plan in sentences for a person, and as one object for a program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from logger.lab.planning.outlook import ISOLABLE_SIGMA
from logger.lab.planning.plan import NextDrive, Plan
from logger.lab.planning.planned_drive import Option
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.report.text_layout import columns, paragraphs

_MOST_NEXT, _MOST_GAINS = 5, 4
HEADS = ("Effect", "Stands out by", "Separated by", "Most like", "")
GAIN_HINT = "Effects more: how many more could be named, in expectation."
SENSOR_HINT = ("A second accelerometer is taken to be as noisy as the first one, a travel sensor to 0.5 mm, a "
               "gyroscope to 0.001 rad/s.")
_OBSTACLES = {"bump": "a speed bump {height_m:g} m high and {width_m:g} m long",
              "plate": "a plank {height_m:g} m high and {length_m:g} m long"}
_SENSES = {"acceleration": "an accelerometer on", "travel": "a travel sensor at", "pitch_rate": "a pitch gyroscope on"}


def summary(found: Plan) -> list[str]:
    """What the drives could show, all together: paragraphs."""
    seconds = sum(each for _, each in found.drives)
    count = len(found.drives)
    chances = found.now.chances
    named = int((chances > 0.5).sum())
    from_where = ("as in the runs" if found.measured else "as given or usual")
    lines = [f"{count} drive{'s' * (count != 1)}, {seconds:.0f} s; noise {found.noise.variance**0.5:.3g} m/s2 r.m.s., "
             f"{from_where}. Of {len(found.names)} effects at their usual strength, each by itself, "
             f"ridelog diagnose would name {named}."]
    if found.groups:
        lines.append("Detected, but not separable: " + "; ".join(", ".join(one) for one in found.groups) + ".")
    hidden = [name for name, each in zip(found.names, found.now.detectability, strict=True) if each < DETECTABLE_SIGMA]
    if hidden:
        lines.append(f"Too faint to be seen in these drives: {', '.join(hidden)}.")
    lines += [f"{name} is left out: {why}." for name, why in found.obstacles.items()]
    return lines


def rows(found: Plan) -> list[tuple[str, str, str, str, str]]:
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
    return "can be named" if apart >= ISOLABLE_SIGMA else "cannot be separated"


def number(deviations: float) -> str:
    """Of standard deviations."""
    return f"{deviations:.1f}" if deviations < 100 else f"{deviations:.0f}"


def meaning() -> str:
    """What the numbers are."""
    return (f"Standard deviations, the car's own numbers and the distances being free within their tolerance. An "
            f"effect is detected from {DETECTABLE_SIGMA:g} on, and separated from another one if {ISOLABLE_SIGMA:.1f} "
            "remain when that one is fitted in its place.")


def plan_lines(found: Plan) -> list[str]:
    """What a person reads of a plan."""
    lines = [paragraphs(summary(found)), "", *columns([HEADS, *rows(found)]), "", paragraphs([meaning()])]
    if found.next:
        lines += ["", "Next, the drive that adds most first:"]
        lines += [paragraphs([f"{number}. {next_words(one)}"]) for number, one in enumerate(found.next[:_MOST_NEXT], 1)]
        lines.append(paragraphs([SENSOR_HINT]))
    else:
        lines += ["", paragraphs(["No next drive can be proposed: the road is too short, or too rough to be driven at "
                                  "these speeds."])]
    return lines


def do_words(option: Option) -> str:
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


def next_words(one: NextDrive) -> str:
    """What is to be done, and what it brings."""
    if not one.gains:
        return f"{do_words(one.option)}: adds next to nothing."
    shown = _most(one.gains)
    more = len(one.gains) - len(shown)
    gains = ", ".join(f"{name} by {number(each)}" for name, each in shown.items())
    count = f"{one.more_named:.1f} effects more could be named" if one.more_named >= 0.05 else "no more can be named"
    return f"{do_words(one.option)}: {count}. Better separated: {gains}{f' and {more} more' if more else ''}."


def _most(gains: Mapping[str, float]) -> dict[str, float]:
    return dict(list(gains.items())[:_MOST_GAINS])


def as_json(found: Plan) -> dict[str, Any]:
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
