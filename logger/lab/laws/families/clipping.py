"""A record that goes no farther than a limit: a sensor or an amplifier that clips.

What clips sits before the recorder's filter, which rounds the corners: the record is taken in finer steps, band-limited
as it is, cut off there, and what was cut off goes through such a filter.
"""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def record(self, p, recording):
    accel = recording.accel_z_mps2
    n = len(accel)
    finer = 8 * np.fft.irfft(np.fft.rfft(accel), 8 * n)
    cut = np.fft.rfft(np.clip(finer, -p.limit_mps2, p.limit_mps2) - finer)[: n // 2 + 1] / 8
    # The recorder's filter is flat up to 0.38 of the rate, and leaves nothing at half of it.
    beyond = np.clip((np.arange(len(cut)) / n - 0.38) / 0.12, 0.0, 1.0)
    return accel + np.fft.irfft(cut * np.cos(0.5 * np.pi * beyond) ** 2, n)
"""
_AT_LIMIT = (0.98, 0.8)  # of the greatest reading


class Clipping(Family):
    name = "clipping"
    title = "a record that goes no farther than a limit"
    shown_by = "drive a rougher road: the strongest readings stay where they are"

    def drafts(self, context: LawContext) -> list[Draft]:
        greatest = max(float(np.abs(run.kept_mps2).max()) for run in context.runs)
        predictions = context.state.predictions
        reach = max(float(np.abs(run.main(one)).max()) for run, one in zip(context.runs, predictions, strict=True))
        if reach < _AT_LIMIT[1] * greatest:
            return []
        limit = Parameter("limit_mps2", rounded(greatest, 4), rounded(0.1 * greatest), rounded(10 * greatest),
                          float("inf"), Scale.RECIPROCAL, tuple(rounded(one * greatest, 4) for one in _AT_LIMIT),
                          "no reading is stronger")
        return [Draft(family=self.name, kind="RecordEffect", title=self.title, parameters=(limit,),
                      source="data sheets of accelerometers give a range that they do not leave",
                      signature="strong motions are cut off at one acceleration, up and down alike",
                      shown_by=self.shown_by, method=_METHOD, variant="both")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"a record that is cut off at {say('limit_mps2')}"


FAMILY = Clipping()
