"""The wheels are larger or smaller than the speed signal believes: speed and distance are recorded too large.

The car was where the recorded distance, divided by the scale, says.
"""

from logger.arrays import Array
from logger.vehicle.effect import DriveEffect, Misalignment, Parameter, Scale, Values

# So little moves all waves alike: a search can see from it how much it takes. Runs lie wrong from the second on.
_LITTLE, _WRONG = 1e-5, 0.0005


class SpeedScale(DriveEffect):
    title = "the recorded speed and distance are wrong by a factor"
    parameters = (Parameter("scale", 1.01, 0.7, 1.4, 1.0, Scale.LOG, (0.98, 1.02), "recorded over true", step=1e-7),)
    source = "UN Regulation 39: a speedometer may read up to a tenth too much; worn tires change the rest"
    signature = "model and measurement drift apart with distance"
    shown_by = "drive a long stretch with a mark at each end, and measure it"
    realigns, reshapes = True, False

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        if seen is None:
            return [{"scale": 1 - _WRONG}, {"scale": 1 + _WRONG}]
        wrong = [seen.scale] if abs(seen.scale - 1) > _WRONG else []
        return [{"scale": scale} for scale in (1 + _LITTLE, *wrong)]

    def driven(self, p: Values, distance_m: Array) -> Array:
        return distance_m / p.scale


EFFECT = SpeedScale()
