"""Friction that gives before it slides: bushings, leaves, belts of a tire. The law of Bouc and Wen with one memory."""

from __future__ import annotations

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on
from logger.vehicle.effect import Chosen, Parameter, Scale
from logger.vehicle.effects import hysteresis


class FrictionWithMemory(Family):
    title = "friction with memory in the suspensions"
    related_effects = ("hysteresis", "dry_friction")
    source = ("R. Bouc, Proc. 4th Conf. on Nonlinear Oscillation, Prague (1967) 315; Y.-K. Wen, J. Eng. Mech. Div. "
              "ASCE 102 (1976) 249")
    signature = "small motions meet a stiffer spring, larger ones friction"
    shown_by = "drive a smooth road and a rough one slowly, so that the suspension moves by a few millimetres"

    def drafts(self, context: LawContext) -> list[Draft]:
        parameters = (
            Parameter("yield_force_n", 100.0, 0.0, 20000.0, 0.0, Scale.LINEAR, (100.0,),
                      "at which each suspension slides"),
            Parameter("yield_travel_m", 0.002, 0.0002, 0.05, None, Scale.LOG, (0.0008, 0.003, 0.01),
                      "over which the initial stiffness would reach that force"),
            Parameter("sharpness_ratio", 1.0, 1.0, 1.0, None, Scale.LINEAR, (1.0,),
                      "exponent: the higher, the sharper the yield", default=1.0),
            Parameter("reversal_ratio", 1.0, 1.0, 1.0, None, Scale.LINEAR, (1.0,),
                      "stiffness in unloading over the initial one", default=1.0))
        return [self.draft(parameters, handed_on(states=1), f"from {hysteresis.__name__} import force, rates",
                           title="friction that yields before it slides", at="loop")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"friction with memory, {say('yield_force_n')} over {say('yield_travel_m', 1000.0, 'mm')}"


FAMILY = FrictionWithMemory()
