"""A force on a rig has another gain, or the other sign, than its record says: a load cell's, a motor's constant.

What a car does under a force alone is the same where all its masses, springs and dampers are larger by the force's
gain: that needs one of them to be known, a base that moves it, too, or a law that is not linear.
"""

from logger.arrays import Array
from logger.vehicle.effect import ActuatorEffect, Parameter, Scale, Sought, Values


class ForceGain(ActuatorEffect):
    title = "scale error, or the wrong sign, of the force that drives a rig"
    parameters = (Parameter("gain", 1.1, -1e4, 1e4, 1.0, Scale.LINEAR, (-1.0, 1.1, 1000.0),
                            "force that acts over the recorded one"),)
    source = "ISO 376: what a force-measuring device shows is calibrated against the force that acts"
    signature = "what the force drives is the model times one factor; what the base drives is right"
    shown_by = "weigh what it moves: under a force alone all masses, springs and dampers are larger by its gain"
    sought = Sought.ON_RIGS
    imitates_any = True

    def force(self, p: Values, rate_hz: float, force_n: Array) -> Array:
        return p.gain * force_n


EFFECT = ForceGain()
