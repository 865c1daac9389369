"""A record that goes no farther than a limit: a sensor or an amplifier that clips, or nears its limit smoothly.

Smoothly, a reading x becomes x / (1 + |x / limit|^n)^(1 / n): with n = 2 it bends early, with n = 20 it all but clips
(C. Rapp, 2nd European Conference on Satellite Communications, 1991, ESA SP-332, p. 179: amplifiers). What limits a
reading sits before the recorder's filter, which rounds the corners: the record is taken in finer steps, band-limited as
it is, limited there, and what was lost goes through such a filter.
"""

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_CUT_OFF = """
def limited(p, accel):
    return np.clip(accel, -p.limit_mps2, p.limit_mps2)
"""
_BENT = """
def limited(p, accel):
    # Far beyond the limit the power is the same to any digit, and would overflow.
    size = np.minimum(np.abs(accel) / p.limit_mps2, 1e6)
    return accel / (1.0 + size**p.sharpness_ratio) ** (1.0 / p.sharpness_ratio)
"""
_METHOD = """def record(self, p, recording):
    accel = recording.accel_z_mps2
    n = len(accel)
    finer = 8 * np.fft.irfft(np.fft.rfft(accel), 8 * n)
    cut = np.fft.rfft(limited(p, finer) - finer)[: n // 2 + 1] / 8
    # The recorder's filter is flat up to 0.38 of the rate, and leaves nothing at half of it.
    beyond = np.clip((np.arange(len(cut)) / n - 0.38) / 0.12, 0.0, 1.0)
    return accel + np.fft.irfft(cut * np.cos(0.5 * np.pi * beyond) ** 2, n)
"""
_SMOOTHLY = "smoothly"
_AT_LIMIT = (0.98, 0.8)  # of the greatest reading


class Clipping(Family):
    title = "a record that is clipped"
    kind = "RecordEffect"
    source = "data sheets of accelerometers give a range that readings cannot exceed"
    signature = "strong motions are cut off at one acceleration, up and down alike"
    shown_by = "drive a rougher road: the largest readings do not grow"

    def drafts(self, context: LawContext) -> list[Draft]:
        greatest = max(float(np.abs(run.kept_mps2).max()) for run in context.runs)
        predictions = context.state.predictions
        reach = max(float(np.abs(run.main(one)).max()) for run, one in zip(context.runs, predictions, strict=True))
        if reach < _AT_LIMIT[1] * greatest:
            return []
        limit = Parameter("limit_mps2", rounded(greatest, digits=4), rounded(0.1 * greatest), rounded(10 * greatest),
                          float("inf"), Scale.RECIPROCAL, tuple(rounded(one * greatest, digits=4) for one in _AT_LIMIT),
                          "the largest possible reading")
        sharpness = Parameter("sharpness_ratio", 2.0, 1.0, 20.0, None, Scale.LOG, (2.0,),
                              "the higher, the sharper the bend")
        return [self.draft((limit,), _METHOD, _CUT_OFF, variant="both"),
                self.draft((limit, sharpness), _METHOD, _BENT, variant=_SMOOTHLY,
                           signature="the stronger a motion, the less of it is recorded, up and down alike")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.variant == _SMOOTHLY:
            return f"a record that saturates at {say('limit_mps2')}, with a sharpness of {say('sharpness_ratio')}"
        return f"a record that is cut off at {say('limit_mps2')}"


FAMILY = Clipping()
