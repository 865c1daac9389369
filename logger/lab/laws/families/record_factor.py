"""A correction between body and record: a stable rational transfer function of low order.

1 + (a + b s / w) / (1 + 2 z s / w + s2 / w2) adds one pair of poles in parallel to the direct path: a bracket, a panel
that rings, a filter with a notch. 1 + a / (1 + s / w) adds one pole; 1 + a (s / w) / (1 + s / w) leaves slow motions
as they are, and raises or lowers quick ones.
"""

from dataclasses import replace

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
from logger.vehicle.effect import Chosen, Parameter, Scale

_POLE = """def factor(self, p, s):
    return 1.0 + p.added_ratio / (1.0 + s / (2 * np.pi * p.frequency_hz))
"""
_RISING = """def factor(self, p, s):
    at = s / (2 * np.pi * p.frequency_hz)
    return 1.0 + p.added_ratio * at / (1.0 + at)
"""
_PAIR = """def factor(self, p, s):
    at = s / (2 * np.pi * p.frequency_hz)
    return 1.0 + (p.added_ratio + p.rate_ratio * at) / (1.0 + 2 * p.damping_ratio * at + at**2)
"""
_HZ = (2.0, 5.0, 10.0, 18.0, 28.0)


class RecordFactor(Family):
    title = "a linear filter between body and record"
    related_effects = ("sensor_bandwidth", "sensor_mount_resonance", "body_bending", "sensor_gain")
    kind = "SensorEffect"
    source = "a rational function of low order (L. Ljung, System Identification, 1999, section 4.2)"
    signature = "the measurement is the model times one function of frequency, on every road"
    shown_by = "shake the sensor, in its place, together with a reference sensor"

    def drafts(self, context: LawContext) -> list[Draft]:
        added = Parameter("added_ratio", 0.1, -10.0, 10.0, 0.0, Scale.LINEAR, (0.1, -0.1), "change of the gain at "
                                                                                           "frequency 0",
                          step=0.01)
        rate = Parameter("rate_ratio", 0.1, -10.0, 10.0, 0.0, Scale.LINEAR, (0.1,), "change of the gain in proportion "
                                                                                    "to the frequency",
                         step=0.01)
        frequency = Parameter("frequency_hz", 10.0, 0.5, 60.0, None, Scale.LOG, _HZ, "of the pole")
        damping = Parameter("damping_ratio", 0.2, 0.02, 2.0, None, Scale.LOG, (0.2,), "of the pair of poles")
        rising = replace(added, meaning="change of the gain at high frequencies")
        return [self.draft((added, frequency), _POLE, variant="pole"),
                self.draft((rising, frequency), _RISING, variant="rising"),
                *(self.draft((added, rate, replace(frequency, start=one, trials=(one,)), damping), _PAIR,
                             variant=f"pair_{one:g}") for one in _HZ)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.variant == "pole":
            return f"a gain of the record that is larger by {say('added_ratio')} below {say('frequency_hz')}"
        if draft.variant == "rising":
            return f"a gain of the record that is larger by {say('added_ratio')} above {say('frequency_hz')}"
        return (f"a record with a resonance at {say('frequency_hz')} of damping ratio {say('damping_ratio')}, which "
                f"adds {say('added_ratio')}, and {say('rate_ratio')} in proportion to the frequency")


FAMILY = RecordFactor()
