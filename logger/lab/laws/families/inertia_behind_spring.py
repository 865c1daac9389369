"""Inertia in the suspensions that moves with their travel, maybe behind a spring: an inerter, a fluid mount.

A flywheel that is geared to the travel, or a column of fluid that a rubber spring pushes to and fro through a channel,
resists as a mass would that is so many times the channel's (M. C. Smith, IEEE Trans. Automatic Control 47, 2002, 1648;
W. C. Flower, SAE 850975, 1985: hydraulic mounts). With y, how far it has moved, the force is k (x - y), and
y'' = w2 (x - y) - 2 z w y' - e y' |y'|: a column loses pressure by the square of its speed where it is turbulent, and
where its channel begins and ends (R. Singh, G. Kim, P. V. Ravindra, J. Sound and Vibration 158, 1992, 219). Geared
rigidly it is a mass that only the travel moves: the force is b x''.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
REACH_M = {reach_m!r}  # the memory is how far it has moved, over this, and how fast, over this times its frequency


def force(p, seen):
    return p.stiffness_n_per_m * (seen.travel_m - REACH_M * seen.memory[0])


def rates(p, seen):
    moved, speed = seen.memory
    lost = (2 * p.damping_ratio + p.square_per_m * REACH_M * np.abs(speed)) * speed
    omega = 2 * np.pi * p.frequency_hz
    return (omega * speed, omega * (seen.travel_m / REACH_M - moved - lost))
"""
_RIGID = """
def structure(self, p, structure):
    return replace(structure, mass=structure.mass + p.inertance_kg * structure.travel.T @ structure.travel)
"""


class InertiaBehindSpring(Family):
    title = "inertia beside the springs, perhaps in series with one"
    related_effects = ("top_mount_compliance", "maxwell_element", "hysteresis")
    source = ("M. C. Smith, IEEE Trans. Automatic Control 47 (2002) 1648: the inerter; W. C. Flower, SAE 850975 "
              "(1985): hydraulic mounts")
    signature = "the suspension is softer below a frequency, and stiffer above it"
    shown_by = "drive a rough road, on which the suspensions move at all frequencies up to that of the wheels"

    def drafts(self, context: LawContext) -> list[Draft]:
        front = context.vehicle.front
        stiffness = rounded(0.5 * front.suspension_stiffness_n_per_m)
        # At 0.3 m/s the square takes as much as a damping ratio of 0.15 at 8 Hz.
        sprung = (
            Parameter("stiffness_n_per_m", stiffness, 0.0, 100 * stiffness, 0.0, Scale.LINEAR, (stiffness,),
                      "of the spring while the inertia behind it stands still"),
            Parameter("frequency_hz", 8.0, 1.0, 40.0, None, Scale.LOG, (4.0, 8.0, 16.0, 32.0),
                      "of the inertia on its spring"),
            # An inerter's bearings hardly damp it, a mount's channel does.
            Parameter("damping_ratio", 0.2, 0.0, 3.0, None, Scale.LINEAR, (0.05, 0.2), "of its motion", step=0.01),
            Parameter("square_per_m", 50.0, 0.0, 30000.0, None, Scale.LINEAR, (50.0,),
                      "quadratic drag on the inertia, over its mass", step=5.0))
        wheel_kg = rounded(0.5 * front.unsprung_mass_kg)
        inertance = Parameter("inertance_kg", wheel_kg, 0.0, 100 * wheel_kg, 0.0, Scale.LINEAR, (wheel_kg,),
                              "inertance between the two ends of a suspension")
        return [self.draft((inertance,), _RIGID, kind="BodyEffect", variant="rigid",
                           title="inertia that moves with the suspensions' travel",
                           signature="the wheels hop at a lower frequency, and the body feels it"),
                self.draft(sprung, handed_on(states=2), _FUNCTIONS.format(reach_m=context.reach("travel_m", 0.9)),
                           title="inertia in series with a spring", variant="sprung", at="loop")]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.variant == "rigid":
            return f"an inertia of {say('inertance_kg')} that moves with the suspensions' travel: an inerter"
        return (f"inertia behind a spring of {say('stiffness_n_per_m', 0.001, 'N/mm')}, {say('frequency_hz')} with a "
                f"damping ratio of {say('damping_ratio')} and a quadratic drag of {say('square_per_m')}: an inerter, "
                "or a mount filled with fluid")


FAMILY = InertiaBehindSpring()
