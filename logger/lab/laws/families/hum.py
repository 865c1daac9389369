"""Something that hums into the record by itself: an engine, a fan, a pump.

Its frequency stays, or wanders as an engine's does by a slow swing (time is that since the run began), or goes with the
speed of the car as an engine's does in one gear. The road does not cause it, so that it is added to the record. It may
begin elsewhere in each run: then each has two strengths of its own.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.lab.laws.repeating import ALL_ALIKE, BEGINS, EACH, each_run, in_run, of_run, spatial_frequency, tone_in_time
from logger.lab.likelihood.whittle import HIGHEST_OF_RATE
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def record(self, p, recording):
    turned = 2 * np.pi * {cycles}
    cos_mps2, sin_mps2 = {pick}
    return recording.accel_z_mps2 + cos_mps2 * np.cos(turned) + sin_mps2 * np.sin(turned)
"""
_STEADY = "p.frequency_hz * recording.time_s"
_WANDERS = """p.frequency_hz * (
        recording.time_s + p.early_cos_s * np.cos(2 * np.pi * recording.time_s / p.period_s)
        + p.early_sin_s * np.sin(2 * np.pi * recording.time_s / p.period_s))"""
_BY_WAY = "p.cycles_per_m * recording.distance_m"
# Slopes are taken over so small a part of a cycle in a minute.
_STEP, _STEP_S = 1e-5, 1e-4


class Hum(Family):
    title = "a hum that the road does not cause"
    kind = "RecordEffect"
    source = "orders of engines and machines (ISO 20816-1:2016)"
    shown_by = "stand with the engine running, and drive one road in two gears"
    stands_out = True

    def drafts(self, context: LawContext) -> list[Draft]:
        hz = (2.0, HIGHEST_OF_RATE * context.runs[0].rate_hz)
        drafts = []
        for wanders in (False, True):
            tone = tone_in_time(context, hz, wanders)
            if tone is None:
                continue
            numbers = [_shape("frequency_hz", tone.frequency_hz, "mean frequency", step=_STEP)]
            if wanders:
                numbers += [
                    Parameter("early_cos_s", tone.wander_cos_s, -20.0, 20.0, None, Scale.LINEAR, (tone.wander_cos_s,),
                              "lead of the tone at the start of a run", step=_STEP_S),
                    Parameter("early_sin_s", tone.wander_sin_s, -20.0, 20.0, None, Scale.LINEAR, (tone.wander_sin_s,),
                              "lead of the tone a quarter of a period later", step=_STEP_S),
                    _shape("period_s", tone.period_s, "in which its frequency rises and falls", step=10 * _STEP)]
            cycles, variant = (_WANDERS, "wanders") if wanders else (_STEADY, "steady")
            drafts += self._drafts(context, numbers, cycles, variant,
                                   "a tone that is present at every speed and on every road")
        per_m = spatial_frequency(context, (0.3, 5.0)) if context.is_driven else None
        if per_m is not None:
            drafts += self._drafts(context, [_shape("cycles_per_m", per_m, "cycles per metre of road", step=_STEP)],
                                   _BY_WAY, "by_way", "a tone whose frequency grows in proportion to the speed",
                                   words=("needs_road = True",))
        return drafts

    def _drafts(self, context: LawContext, numbers: list[Parameter], cycles: str, variant: str, signature: str,
                **more: Any) -> list[Draft]:
        """A tone of one phase at the beginning of all runs, and one of another phase in each."""
        size = rounded(float(np.std(np.concatenate(context.residuals))))
        most, unit = max(100.0, 10 * size), context.runs[0].facts.main.name.rsplit("_", 1)[-1]

        def draft(runs: Sequence[str], variant: str) -> Draft:
            strengths = [Parameter(in_run(part, run, unit), 0.1 * size, -most, most, 0.0, Scale.LINEAR,
                                   (0.1 * size,), f"{words} of the hum{of_run(run)}", step=0.02 * size)
                         for run in runs for part, words in (("cos", "cosine part"), ("sin", "sine part"))]
            pairs = ", ".join(f"(p.{in_run('cos', run, unit)}, p.{in_run('sin', run, unit)})" for run in runs)
            pick = pairs if len(runs) == 1 else f"(\n        {pairs},\n    )[min(recording.run, {len(runs) - 1})]"
            return self.draft((*strengths, *numbers), _METHOD.format(cycles=cycles, pick=pick), signature=signature,
                              variant=variant, **more)

        ways = ((ALL_ALIKE, variant), (each_run(context), f"{variant}{EACH}"))
        return [draft(runs, name) for runs, name in ways if runs]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        (size, unit), begins = _strength(found.values), BEGINS * draft.variant.endswith(EACH)
        if draft.variant.startswith("by_way"):
            return (f"a hum of {size:.2g} {unit} r.m.s. with {say('cycles_per_m')} cycles{begins}, that the road does "
                    "not cause")
        wanders = ""
        if draft.variant.startswith("wanders"):
            late_s = float(np.hypot(found.values["early_cos_s"], found.values["early_sin_s"]))
            share = 2 * np.pi * late_s / found.values["period_s"]
            wanders = f", rising and falling by {share:.0%} in {say('period_s')}"
        return (f"a hum of {size:.2g} {unit} r.m.s. at {say('frequency_hz')}{wanders}{begins}, that the road does not "
                "cause: an engine or a fan")


def _strength(values: Mapping[str, float]) -> tuple[float, str]:
    """How loud it is, and its unit."""
    parts = {name: value for name, value in values.items() if name.startswith(("cos_", "sin_"))}
    unit = next(iter(parts)).rsplit("_", 1)[-1]
    return (float(np.linalg.norm(list(parts.values())) / np.sqrt(len(parts))),
            {"mps2": "m/s2", "mps": "m/s", "n": "N"}.get(unit, unit))


def _shape(name: str, value: float, meaning: str, step: float) -> Parameter:
    return Parameter(name, value, 0.2 * value, 5.0 * value, None, Scale.LOG, (value,), meaning, step=step)


FAMILY = Hum()
