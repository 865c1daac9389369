"""Inertia in the suspensions that moves with their travel, behind a spring: an inerter, or a mount filled with fluid.

A flywheel that is geared to the travel, or a column of fluid that a rubber spring pushes to and fro through a channel,
resists as a mass would that is so many times the channel's (M. C. Smith, IEEE Trans. Automatic Control 47, 2002, 1648;
W. C. Flower, SAE 850975, 1985: hydraulic mounts). With y, how far it has moved, the force is k (x - y), and
y'' = w2 (x - y) - 2 z w y'.
"""

from __future__ import annotations

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext, rounded
from logger.lab.laws.families.friction_with_memory import BETWEEN
from logger.vehicle.effect import Chosen, Parameter, Scale

_SHARE = 0.5  # of the suspension's own stiffness
_HZ = (4.0, 8.0, 16.0)

_FUNCTIONS = """
def force(p, seen):
    return p.stiffness_n_per_m * (seen.travel_m - seen.memory[0])


def rates(p, seen):
    moved_m, moved_mps = seen.memory
    omega = 2 * np.pi * p.frequency_hz
    return (moved_mps, omega**2 * (seen.travel_m - moved_m) - 2 * p.damping_ratio * omega * moved_mps)
"""
_METHOD = ("def laws(self, p, laws):\n"
           "    return laws.with_law(Between.BODY_AND_WHEEL, force, p, rates, memory=(0.0, 0.0))")


class InertiaBehindSpring(Family):
    name = "inertia_behind_spring"
    title = "inertia behind a spring in the suspensions"
    related_effects = ("top_mount_compliance", "hysteresis")
    shown_by = "drive a rough road, on which the suspensions move at all frequencies up to that of the wheels"

    def drafts(self, context: LawContext) -> list[Draft]:
        stiffness = rounded(_SHARE * context.vehicle.front.suspension_stiffness_n_per_m)
        return [Draft(
            family=self.name, kind="ForceEffect", title=self.title, shown_by=self.shown_by,
            parameters=(
                Parameter("stiffness_n_per_m", stiffness, 0.0, 100 * stiffness, 0.0, Scale.LINEAR, (stiffness,),
                          "of the spring, where the inertia behind it stands still"),
                Parameter("frequency_hz", 8.0, 1.0, 40.0, None, Scale.LOG, _HZ, "of the inertia on its spring"),
                Parameter("damping_ratio", 0.2, 0.01, 3.0, None, Scale.LOG, (0.2,), "of its motion")),
            source="M. C. Smith, IEEE Trans. Automatic Control 47 (2002) 1648: the inerter; W. C. Flower, SAE 850975 "
                   "(1985): hydraulic mounts",
            signature="the suspension is softer below a frequency, and stiffer above it",
            functions=_FUNCTIONS, method=_METHOD, imports=BETWEEN, at="loop")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"inertia behind a spring of {say('stiffness_n_per_m', 0.001, 'N/mm')}, {say('frequency_hz')} with a "
                f"damping ratio of {say('damping_ratio')}: an inerter, or a mount filled with fluid")


FAMILY = InertiaBehindSpring()
