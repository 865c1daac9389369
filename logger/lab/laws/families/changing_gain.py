"""A sensor whose gain changes as a run goes on: it warms up, or its supply sinks."""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def record(self, p, recording):
    return recording.accel_z_mps2 * (p.gain_at_first_ratio + p.change_ratio * recording.time_s / {lasts_s!r})
"""


class ChangingGain(Family):
    title = "a gain that changes during a run"
    related_effects = ("sensor_gain",)
    kind = "RecordEffect"
    source = "data sheets of accelerometers give a change of sensitivity with temperature"
    signature = "the residual is in proportion to the model, more so the longer a run lasts"
    shown_by = "drive one road at the beginning and at the end of a long run"

    def drafts(self, context: LawContext) -> list[Draft]:
        lasts_s = max(run.count / run.rate_hz for run in context.runs)
        change = Parameter("change_ratio", 0.1, -0.95, 5.0, 0.0, Scale.LINEAR, (0.1, -0.1),
                           f"change of the gain over {lasts_s:g} s", step=0.01)
        first = Parameter("gain_at_first_ratio", 1.0, 0.5, 2.0, None, Scale.LOG, (1.0,), "gain at the start of a run",
                          default=1.0)
        method = _METHOD.format(lasts_s=lasts_s)
        return [self.draft((change,), method.replace("p.gain_at_first_ratio", "1.0"), variant="from_one"),
                self.draft((change, first), method, variant="from_any")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        begins = f", from {say('gain_at_first_ratio')} on" if draft.variant == "from_any" else ""
        return f"a gain that changes by {say('change_ratio')} over the longest run{begins}"


FAMILY = ChangingGain()
