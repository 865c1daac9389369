"""The lab's whole loop in sentences for a person, and as one object for a program."""

from __future__ import annotations

from typing import Any

from logger.lab.session import Story
from logger.report.add_effect_text import bias


def steps(story: Story) -> list[tuple[str, float]]:
    """Models on the way, each with its error on what no fit saw."""
    start = story.rounds[0].addition if story.rounds else None
    return [("as its file says", start.error_before if start else story.first.plain.error),
            ("numbers refitted", start.error_refitted if start else story.first.steps[-1].error),
            *((f"with {' and '.join(one.addition.names)}", one.addition.error_after) for one in story.rounds)]


def ending(story: Story) -> list[str]:
    """What it came to."""
    diagnosis, models = story.diagnoses[-1], steps(story)
    with_what = [bias(story.added, story.moved)] if story.added else []
    lines = []
    if story.added:
        lines.append(f"{' and '.join(story.added)} reduced the error from {models[1][1]:.3f} to {models[-1][1]:.3f}, "
                     "both with the car's numbers and the distances refitted within their tolerance. With the last "
                     f"file as it is, and the distances as recorded, the error is {story.last.plain.error:.3f}.")
    lines.append(f"The sensor's noise alone makes about {story.floor:.3f}.")
    if story.refused:
        lines.append(f"Found missing and left out as you wished: {', '.join(story.refused)}.")
    if story.not_added:
        lines.append(f"Found missing and not added: {', '.join(story.not_added)}. Go on with the last file.")
    if story.refused or story.not_added:
        return [*lines, *with_what]
    if diagnosis.beyond and not diagnosis.exceeds_noise:
        lines.append("Numbers of the vehicle's file are outside their tolerance: check them.")
    elif diagnosis.unexplained and story.law is None:
        lines.append("Something is missing still that no effect explains: ridelog learn may find a law, or an effect "
                     "of your own may do it.")
    elif diagnosis.unexplained:
        lines.append("Something is missing still that no effect and no law out of the data explains: an effect of your "
                     "own may do it.")
    else:
        lines.append(f"Nothing {'more ' * bool(story.added)}is missing, as far as these runs can show.")
    return [*lines, *with_what]


def as_json(story: Story) -> dict[str, Any]:
    """The story as one JSON object."""
    models = steps(story)
    return {
        "error_before": models[0][1], "error_after": models[-1][1], "noise_floor_error": story.floor,
        "added": story.added, "refused": list(story.refused), "left": story.not_added,
        "unexplained": story.diagnoses[-1].unexplained,
        "steps": [{"step": words, "error": error} for words, error in models],
        "effects": [{"effect": one.effect.name, "parameters": dict(one.values)} for one in story.last.effects],
        "biased": [one.name for one in story.moved if one.biased],
        "vehicles": [one.file for one in story.rounds], "law": story.law.file or None if story.law else None,
        "sentences": ending(story),
    }
