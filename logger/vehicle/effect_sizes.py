"""Effects in the sizes of a vehicle: what is usual in a car is not in a bench rig of 2.5 kg.

Problem: the values that a search begins at, and what may be asked for, are those of cars: a friction of 60 N holds a
rig of 25 N still. Solution: a vehicle that is lighter or quicker than cars by a factor has forces, springs, dampers
and travels that follow by their dimensions (E. Buckingham, Physical Review 4, 1914), gravity being the same for all:
with masses as m and times as t, travels go as t2, forces as m, springs as m / t2, dampers as m / t. Places on the car
go with its wheelbase. Factors of masses and places are powers of ten, those of times half ones, as trials are that far
apart: of every car they are 1.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from logger.vehicle.effect import Effect, ForceEffect, Parameter
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.vehicle import Vehicle

# Of a car of the middle class: sprung mass on each wheel, frequency of its bounce, wheelbase.
_MASS_KG, _BOUNCE_HZ, _WHEELBASE_M = 350.0, 1.4, 2.7
# Powers of mass and time by the end of a name, the longest ends first.
_POWERS = {
    "_n_per_m3": (1, -6), "_n_s_per_m": (1, -1), "_n_per_m": (1, -2), "_m_per_s": (0, 1), "_kg": (1, 0), "_n": (1, 0),
}
_LENGTH = "_m"


def sized(effect: Effect, vehicle: Vehicle) -> Effect:
    """An effect with starts, trials and bounds in the sizes of a vehicle; of a car itself."""
    mass, time, wheelbase = _factors(vehicle)
    found = tuple(_times(one, _factor(effect, one.name, mass, time, wheelbase)) for one in effect.parameters)
    if found == effect.parameters:
        return effect
    made = copy(effect)
    made.parameters = found
    return made


def grows_with_mass(name: str) -> bool:
    """Whether a number of a car or an effect, by its unit, grows by the same factor as all masses and forces do where a
    vehicle moves alike."""
    above = name.partition("_per_")[0].split("_")[1:]
    return "kg" in above or "n" in above


def _factors(vehicle: Vehicle) -> tuple[float, float, float]:
    """Of masses, times and places on the vehicle, over those of a car."""
    structure = structure_of(vehicle)
    mass_kg = vehicle.sprung_mass_kg / len(structure.wheels)
    bounce_hz = float(undamped_frequencies_hz(structure)[0])
    wheelbase_m = float(structure.behind_m.max()) or _WHEELBASE_M
    return (_power_of_ten(mass_kg / _MASS_KG), _power_of_ten(_BOUNCE_HZ / bounce_hz, 2),
            _power_of_ten(wheelbase_m / _WHEELBASE_M))


def _power_of_ten(ratio: float, parts: int = 1) -> float:
    """The nearest one, or the nearest root of one."""
    return float(10.0 ** (np.round(parts * np.log10(ratio)) / parts))


def _factor(effect: Effect, name: str, mass: float, time: float, wheelbase: float) -> float:
    for end, (of_mass, of_time) in _POWERS.items():
        if name.endswith(end):
            return mass**of_mass * time**of_time
    if name.endswith(_LENGTH):
        return time**2 if isinstance(effect, ForceEffect) else wheelbase
    return 1.0  # frequencies that resonate are looked for everywhere between bounce and what the recorder keeps


def _times(one: Parameter, factor: float) -> Parameter:
    """Its usual values times a factor, within bounds that reach as far as before at least."""
    if factor == 1.0:
        return one
    return replace(one, start=one.start * factor, low=min(one.low, one.low * factor),
                   high=max(one.high, one.high * factor), trials=tuple(value * factor for value in one.trials),
                   step=None if one.step is None else one.step * factor)
