"""Something that hums into the record by itself: an engine, a fan, a pump.

Its frequency stays, or wanders as an engine's does by a slow swing (time is that since the run began), or goes with the
speed of the car as an engine's does in one gear. The road does not cause it, so that it is added to the record.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look, Say, rounded
from logger.lab.laws.repeating import along_the_way, tone_in_time
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def record(self, p, recording):
    turned = 2 * np.pi * {cycles}
    return recording.accel_z_mps2 + p.cos_mps2 * np.cos(turned) + p.sin_mps2 * np.sin(turned)
"""
_STEADY = "p.frequency_hz * recording.time_s"
_WANDERS = """p.frequency_hz * (
        recording.time_s + p.early_cos_s * np.cos(2 * np.pi * recording.time_s / p.period_s)
        + p.early_sin_s * np.sin(2 * np.pi * recording.time_s / p.period_s))"""
_BY_WAY = "p.cycles_per_m * recording.distance_m"
_LOWEST_HZ = 2.0
_PER_M = (0.3, 5.0)
_MOST_MPS2 = 100.0
# Slopes are taken over so small a part of a cycle in a minute.
_STEP, _STEP_S = 1e-5, 1e-4


class Hum(Family):
    name = "hum"
    title = "a hum that the road does not cause"
    shown_by = "stand with the engine running, and drive one road in two gears"

    def drafts(self, look: Look) -> list[Draft]:
        hz = (_LOWEST_HZ, 0.37 * look.runs[0].rate_hz)
        drafts = []
        for wanders in (False, True):
            tone = tone_in_time(look, hz, wanders)
            if tone is None:
                continue
            numbers = [_shape("frequency_hz", tone.frequency_hz, "mean frequency", step=_STEP)]
            if wanders:
                numbers += [
                    Parameter("early_cos_s", tone.wander_cos_s, -20.0, 20.0, None, Scale.LINEAR, (tone.wander_cos_s,),
                              "by how much it is early as a run begins", step=_STEP_S),
                    Parameter("early_sin_s", tone.wander_sin_s, -20.0, 20.0, None, Scale.LINEAR, (tone.wander_sin_s,),
                              "by how much it is early a quarter of a period later", step=_STEP_S),
                    _shape("period_s", tone.period_s, "in which its frequency goes up and down", step=10 * _STEP)]
            drafts.append(self._draft(look, numbers, _WANDERS if wanders else _STEADY,
                                      "wanders" if wanders else "steady",
                                      "a tone that is there whatever the speed and the road"))
        per_m = along_the_way(look, _PER_M) if look.is_driven else None
        if per_m is not None:
            drafts.append(self._draft(look, [_shape("cycles_per_m", per_m, "cycles in a metre of the way", step=_STEP)],
                                      _BY_WAY, "by_way", "a tone whose frequency goes with the speed",
                                      words=("needs_road = True",)))
        return drafts

    def _draft(self, look: Look, numbers: list[Parameter], cycles: str, variant: str, signature: str,
               **more: Any) -> Draft:
        size = rounded(float(np.std(np.concatenate(look.residuals))))
        strengths = [Parameter(f"{part}_mps2", 0.1 * size, -_MOST_MPS2, _MOST_MPS2, 0.0, Scale.LINEAR, (0.1 * size,),
                               f"{words} of the hum", step=0.02 * size)
                     for part, words in (("cos", "even part"), ("sin", "odd part"))]
        return Draft(family=self.name, kind="RecordEffect", title=self.title, parameters=(*strengths, *numbers),
                     source="orders of engines and machines (ISO 20816-1:2016)", signature=signature,
                     shown_by=self.shown_by, method=_METHOD.format(cycles=cycles), variant=variant, **more)

    def words(self, draft: Draft, found: Chosen, say: Say) -> str:
        size = _strength(found.values)
        if draft.variant == "by_way":
            return f"a hum of {size:.2g} m/s2 r.m.s. with {say('cycles_per_m')} cycles, that the road does not cause"
        wanders = ""
        if draft.variant == "wanders":
            late_s = float(np.hypot(found.values["early_cos_s"], found.values["early_sin_s"]))
            share = 2 * np.pi * late_s / found.values["period_s"]
            wanders = f", going up and down by {share:.0%} in {say('period_s')}"
        return (f"a hum of {size:.2g} m/s2 r.m.s. at {say('frequency_hz')}{wanders}, that the road does not cause: an "
                "engine or a fan")


def _strength(values: Mapping[str, float]) -> float:
    return float(np.hypot(values["cos_mps2"], values["sin_mps2"]) / np.sqrt(2))


def _shape(name: str, value: float, meaning: str, step: float) -> Parameter:
    return Parameter(name, value, 0.2 * value, 5.0 * value, None, Scale.LOG, (value,), meaning, step=step)


FAMILY = Hum()
