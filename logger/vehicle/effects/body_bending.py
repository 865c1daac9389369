"""A body is not rigid: its first bending mode is driven by the axles and felt where the sensor sits.

The mode's coordinate at the sensor, e, follows e'' + 2 z w e' + w^2 e = p F / m, with F the forces of the suspensions
on the body, m the body's mass and p the participation; the sensor reads the rigid body's acceleration plus e''. Where
the axles are near the mode's nodes it moves the sensor and hardly the ends of the suspensions. Where they are not, the
ends move by p e, so that the forces work on what they move.
"""

from dataclasses import replace

import numpy as np

from logger.vehicle.effect import BodyEffect, Parameter, Scale, Values, resonances_hz
from logger.vehicle.structure import Structure, hung

# What the ends of the suspensions move by, over the sensor, where the axles are near the nodes: nothing to speak of.
_AT_A_NODE = 1e-3


class BodyBending(BodyEffect):
    title = "first bending mode of the body"
    parameters = (
        Parameter("frequency_hz", 22.0, 5.0, 60.0, None, Scale.LOG, resonances_hz(11.0, 42.0, 0.05), "of the mode"),
        Parameter("damping_ratio", 0.04, 0.003, 0.5, None, Scale.LOG, (0.05,), "of the mode"),
        Parameter("participation", 0.5, -10.0, 10.0, 0.0, Scale.LINEAR, (0.5,),
                  "how strongly the axles' forces drive the mode at the sensor"),
        Parameter("ends_move", 0.0, 0.0, 1.0, None, Scale.LINEAR, (0.0, 1.0),
                  "whether the ends of the suspensions move with the mode (1), or the sensor alone (0)",
                  choices=(0.0, 1.0), default=0.0),
    )
    needs_wheel = True
    source = "T. D. Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 5; modal superposition"
    signature = "a narrow peak above wheel hop that follows the forces of the suspensions, with a dip beside it"
    shown_by = "drive a rough road at two speeds: the peak keeps its frequency and grows with the road"

    stage = 5  # what hangs on the body hangs on the rigid one

    def structure(self, p: Values, structure: Structure) -> Structure:
        omega, mass = 2 * np.pi * p.frequency_hz, structure.mass[0, 0]
        share = 1.0 if p.ends_move else _AT_A_NODE
        ends = np.full(len(structure.wheels), p.participation * share)
        bent = hung(structure, mass, mass * omega**2, 2 * p.damping_ratio * omega * mass,
                    np.zeros(len(structure.mass)), ends)
        body = bent.body.copy()
        body[-1, 0] = 1.0 / share
        return replace(bent, body=body)


EFFECT = BodyBending()
