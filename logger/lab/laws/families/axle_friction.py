"""Dry friction in the suspensions of one axle alone: Coulomb's, which sticks."""

from __future__ import annotations

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
from logger.vehicle.effect import Chosen, Parameter, Scale


class AxleFriction(Family):
    name = "axle_friction"
    title = "dry friction in the suspensions of one axle"
    related_effects = ("dry_friction", "hysteresis")
    source = "C. A. Coulomb; B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083"
    signature = "small motions of one axle die away at once: it sticks"
    shown_by = "drive a smooth road slowly, so that the suspension of one axle sticks and that of the other does not"

    def drafts(self, context: LawContext) -> list[Draft]:
        force = Parameter("friction_force_n", 60.0, 0.0, 5000.0, 0.0, Scale.LINEAR, (25.0, 100.0),
                          "in each suspension of this axle")
        one = self.draft((force,), "def laws(self, p, laws):\n"
                         "    return replace(laws, dry_friction_n=laws.dry_friction_n + p.friction_force_n)",
                         title="dry friction", at="loop")
        return [one.of_axle(axle) for axle in context.axles]  # at both it is dry_friction of the list

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return f"dry friction, {say('friction_force_n')}"


FAMILY = AxleFriction()
