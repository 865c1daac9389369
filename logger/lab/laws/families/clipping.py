"""A record that goes no farther than a limit: a sensor or an amplifier that clips."""

from __future__ import annotations

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, Look, Say, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def record(self, p, recording):
    return np.clip(recording.accel_z_mps2, -p.limit_mps2, p.limit_mps2)
"""
_AT_LIMIT = (0.98, 0.8)  # of the greatest reading


class Clipping(Family):
    name = "clipping"
    title = "a record that goes no farther than a limit"
    shown_by = "drive a rougher road: the strongest readings stay where they are"

    def drafts(self, look: Look) -> list[Draft]:
        greatest = max(float(np.abs(run.kept_mps2).max()) for run in look.runs)
        predictions = look.state.predictions
        reach = max(float(np.abs(run.main(one)).max()) for run, one in zip(look.runs, predictions, strict=True))
        if reach < _AT_LIMIT[1] * greatest:
            return []
        limit = Parameter("limit_mps2", rounded(greatest, 4), rounded(0.1 * greatest), rounded(10 * greatest),
                          float("inf"), Scale.RECIPROCAL, tuple(rounded(one * greatest, 4) for one in _AT_LIMIT),
                          "no reading is stronger")
        return [Draft(family=self.name, kind="RecordEffect", title=self.title, parameters=(limit,),
                      source="data sheets of accelerometers give a range that they do not leave",
                      signature="strong motions are cut off at one acceleration, up and down alike",
                      shown_by=self.shown_by, method=_METHOD, variant="both")]

    def words(self, draft: Draft, found: Chosen, say: Say) -> str:
        return f"a record that is cut off at {say('limit_mps2')}"


FAMILY = Clipping()
