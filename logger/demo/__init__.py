"""The recorded drives that ship with ridelog, and what the cars of the two demonstrations of the lab truly were.

All of them are simulated; ``tests/support/drives`` has the programs that made them. Each car differs from what its file
says in two ways: its masses, springs and dampers are off by up to 3 %, as those of any car are; and it has one physical
effect that the file does not know. Readers of the demonstrations should find out which before they read on here.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class TrueCar:
    """A simulated car: the vehicle whose file is its model, the effect that it has, with its numbers, and by which
    factor its other numbers are not what the file says (``off``)."""

    vehicle: str
    effect: str
    values: Mapping[str, float]
    off: Mapping[str, float]


LAB = TrueCar("rav4-2009", "progressive_spring", {"cubic_stiffness_n_per_m3": 2.5e6}, {
    "sprung_mass_kg": 1.01, "pitch_inertia_kg_m2": 0.98, "front.unsprung_mass_kg": 1.01,
    "front.suspension_stiffness_n_per_m": 0.98, "front.suspension_damping_n_s_per_m": 1.02,
    "front.tire_stiffness_n_per_m": 0.985, "rear.unsprung_mass_kg": 0.98,
    "rear.suspension_stiffness_n_per_m": 1.01, "rear.suspension_damping_n_s_per_m": 0.98,
    "rear.tire_stiffness_n_per_m": 1.015,
})
FIELD = TrueCar("rav4-2009", "dry_friction", {"friction_force_n": 150.0}, {
    "sprung_mass_kg": 1.015, "pitch_inertia_kg_m2": 0.98, "front.unsprung_mass_kg": 1.02,
    "front.suspension_stiffness_n_per_m": 0.98, "front.suspension_damping_n_s_per_m": 1.02,
    "front.tire_stiffness_n_per_m": 0.98, "rear.unsprung_mass_kg": 0.98,
    "rear.suspension_stiffness_n_per_m": 1.02, "rear.suspension_damping_n_s_per_m": 0.97,
    "rear.tire_stiffness_n_per_m": 1.015,
})

CAR = TrueCar("ford-escort", "", {}, {
    "front.suspension_stiffness_n_per_m": 1.15, "front.suspension_damping_n_s_per_m": 0.9,
    "front.tire_stiffness_n_per_m": 0.9, "rear.suspension_stiffness_n_per_m": 0.75,
    "rear.suspension_damping_n_s_per_m": 0.65, "rear.tire_stiffness_n_per_m": 0.85,
})
"""A car that nobody measured: its numbers are those of an old Escort no longer. It lacks nothing."""

DRIVES, FOURTH = ("first", "second", "third"), "fourth"
LINE, BEYOND = "line.csv", "beyond.csv"
"""Of the field: what was measured, the street of the first three drives, and the one beyond of the fourth."""
