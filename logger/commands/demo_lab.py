"""``ridelog demo --lab``: the lab's loop on two drives that ship with the package, explained on the way."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.lab.question import CompareQuestion
from logger.commands.lab import say, take, walk
from logger.commands.options import warned
from logger.report.quantities import columns, wrapped

if TYPE_CHECKING:
    from logger.lab.session import Story

_INTRODUCTION = (
    "Somebody drove a RAV4 along two poor town streets with speed bumps, slowly on the one and briskly on the other, "
    "with an accelerometer on the body. Both streets were measured beforehand, and the file of the car, rav4-2009, "
    "comes with ridelog. This car has something that its file does not know, and the lab finds out what."
)
_EXPLAINED = {
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
    from logger.api.lab.loop import unsaid_lines
    from logger.demo.lab_drives import VEHICLE

    if not unpack_only:
        require_compiler("ridelog demo --lab", sought_effects().values())
    folders = unpack(out)
    drives = " ".join(map(str, folders))
    if unpack_only:
        print(json.dumps({"vehicle": VEHICLE, "runs": list(map(str, folders))}) if as_json else
              f"Two drives: {drives}\nNext: ridelog compare --vehicle {VEHICLE} {drives}")
        return
    if not as_json:
        print(wrapped([_INTRODUCTION]))
    given = bench_with(CompareQuestion(VEHICLE, folders, warn=warned))
    found = walk(given, out, take, unsaid_lines if as_json else say, _explained)
    print(json.dumps(found.as_json(), allow_nan=False) if as_json else "\n".join(_answer(found.story)))


def _explained(chapter: str, _effect: str, _vehicle: str) -> str:
    return wrapped([_EXPLAINED[chapter]]) if chapter in _EXPLAINED else ""


def unpack(out: Path) -> list[Path]:
    """Write the drives below ``out``, as ``unpacked``; their folders."""
    from logger.demo.unpacking import unpacked

    return sorted({path.parent for path in unpacked("lab.zip", out)}, reverse=True)


def _answer(story: Story) -> list[str]:
    """What the simulated car truly was, and what was found."""
    from logger.api.lab.loop import chapter
    from logger.demo.lab_drives import EFFECT, EFFECT_VALUES, OFF

    sentence, table = truth_beside(story, EFFECT, EFFECT_VALUES, OFF)
    return [*chapter("The answer"), wrapped([sentence]), "", *table]


def truth_beside(story: Story, effect: str, values: Mapping[str, float], off: Mapping[str, float]
                 ) -> tuple[str, list[str]]:
    """What a simulated car truly was, and what was found: a sentence, and the lines of a table.

    effect, values    that it had
    off               by which factor its numbers were not those of its file
    """
    from logger.report.quantities import numbers_of

    found = {one.effect.name for one in story.last.effects}
    rows = [("Number", "True", "Without", "With")]
    rows += [(one.name, f"{off.get(one.name, 1.0) - 1:+.1%}", f"{one.without / one.nominal - 1:+.1%}",
              f"{one.found / one.nominal - 1:+.1%} ± {one.standard_error / one.found:.1%}") for one in story.moved]
    numbers = ", ".join(f"{name} {value:.3g}" for name, value in values.items())
    mine = numbers_of(story.rounds[-1].addition.new[-1]) if effect in found else "nothing of the kind"
    return (f"The drives were simulated. The car had {effect}, {numbers}; found: {mine}. Its numbers differed from its "
            "file, in per cent:", columns(rows))
