"""``ridelog demo --lab``: the lab's loop on two drives that ship with the package, explained on the way."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import ZipFile

from logger.commands.lab import say, take, walk
from logger.commands.lab_model import bench_from
from logger.errors import BadInput
from logger.files import naming
from logger.report.text_layout import columns, paragraphs

if TYPE_CHECKING:
    from logger.lab.session import Story

_INTRODUCTION = (
    "Somebody drove a RAV4 along two poor town streets with speed bumps, slowly on the one and briskly on the other, "
    "with an accelerometer on the body. Both streets were measured beforehand, and the file of the car, rav4-2009, "
    "comes with ridelog. Something is in this car that its file does not know; what, the lab is to find out."
)
_EXPLAINED = {
    "compare": "First question: does the model fail at all, or are only its numbers a little off? Nominal masses and "
               "springs are never exact, so they are refitted within a few per cent, and only what is left then is "
               "evidence.",
    "diagnose": "Second question: which physical effect would explain what is left? Each that ridelog knows is "
                "simulated and fitted together with the car's numbers, on two thirds of each drive; the other third is "
                "the judge.",
    "add": "The effect is fitted on all of the drives, with the car's numbers. Look at the table: what the missing "
           "effect had made of masses, springs and dampers. They looked like results, and were wrong.",
    "again": "The same comparison once more, with the new vehicle file.",
}


def lab(out: Path, unpack_only: bool, as_json: bool) -> None:
    """Unpack the drives into ``out`` and find what is missing."""
    from logger.api.bench import require_compiler, sought_effects
    from logger.api.lab_loop import STORY, unsaid_lines
    from logger.demo.lab_drives import VEHICLE
    from logger.report.session_text import as_json as story_json

    if not unpack_only:
        require_compiler("ridelog demo --lab", sought_effects().values())
    folders = unpack(out)
    drives = " ".join(map(str, folders))
    if unpack_only:
        print(json.dumps({"vehicle": VEHICLE, "runs": list(map(str, folders))}) if as_json else
              f"Two drives: {drives}\nNext: ridelog compare --vehicle {VEHICLE} {drives}")
        return
    if not as_json:
        print(paragraphs([_INTRODUCTION]))
    given = bench_from(VEHICLE, folders)
    story = walk(given, out, take, unsaid_lines if as_json else say, _EXPLAINED)
    if as_json:
        print(json.dumps(story_json(story) | {"story": str(out / STORY)}, allow_nan=False))
    else:
        print("\n".join(_answer(story)))


def unpack(out: Path) -> list[Path]:
    """Write the drives below ``out``, where they may be already; their folders.

    Raises BadInput, and writes nothing, where something else of one of their names is there; OSError as ``open``.
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out {out}: expected a folder")
    with resources.as_file(resources.files("logger.demo") / "lab.zip") as file, ZipFile(file) as archive:
        contents = {out / name: archive.read(name) for name in archive.namelist()}
    for path, content in contents.items():
        if path.parent.exists() and not path.parent.is_dir():
            raise BadInput(f"{path.parent}: expected a folder, or nothing; choose another folder with --out")
        if path.exists() and not (path.is_file() and path.read_bytes() == content):
            raise BadInput(f"{path}: expected nothing there, or the demo's own file, found something else; choose "
                           "another folder with --out")
    for path, content in contents.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        with naming(path):
            path.write_bytes(content)
    return sorted({path.parent for path in contents}, reverse=True)


def _answer(story: Story) -> list[str]:
    """What the simulated car truly was, beside what was found."""
    from logger.demo.lab_drives import EFFECT, EFFECT_VALUES, OFF
    from logger.report.quantities import numbers_of

    found = {one.effect.name: one for one in story.last.effects}
    rows = [("Number", "True", "Without", "With")]
    rows += [(one.name, f"{OFF.get(one.name, 1.0) - 1:+.1%}", f"{one.without / one.nominal - 1:+.1%}",
              f"{one.found / one.nominal - 1:+.1%} ± {one.standard_error / one.found:.1%}") for one in story.moved]
    told = ", ".join(f"{name} {value:.3g}" for name, value in EFFECT_VALUES.items())
    mine = numbers_of(story.rounds[-1].addition.new[-1]) if EFFECT in found else "nothing of the kind"
    return ["", "=== The answer ===", "", paragraphs([
        f"The drives were simulated. The car had {EFFECT}, {told}; found: {mine}. Its numbers differed from its "
        "file, in per cent:"]), "", *columns(rows)]
