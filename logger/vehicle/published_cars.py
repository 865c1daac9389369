"""What a car is likely to be before anybody has measured it: the spread of published cars.

Problem: a user has a car, not its masses and springs. Solution: what an accelerometer sees of a road depends on a dozen
ratios alone (``NUMBERS``): natural frequencies, damping ratios, ratios of masses and places. They differ from car to
car by 10 to 30 %, whatever the cars weigh. Their mean and covariance over published cars are a prior for any car whose
wheelbase is known; its mass may be anything.

The spread is that of one more car (the predictive distribution of a normal one whose mean and variance are not known:
A. Gelman et al., Bayesian Data Analysis, 3rd ed., 3.2), as few cars are published whole. What both axles of a car share
and what sets them apart are counted on their own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from logger.arrays import Array
from logger.vehicle.linear_car import STEP
from logger.vehicle.named_parameters import read, sized
from logger.vehicle.uncertain import NumberErrors
from logger.vehicle.vehicle import AT_CENTRE_OF_GRAVITY, GENERIC, Axle, SensorPlace, Vehicle

OF_AXLE = ("bounce_hz", "damping_ratio", "hop_hz", "unsprung_to_sprung")
"""Of each axle with the mass that it carries: sqrt(k / m) / 2 pi, c / (2 sqrt(k m)), sqrt((k + kt) / mu) / 2 pi and
mu / m, with suspension k and c, tire kt, unsprung mu and sprung m."""
NUMBERS = (*(f"front.{one}" for one in OF_AXLE), *(f"rear.{one}" for one in OF_AXLE), "dynamic_index", "rear_share",
           "contact_patch_m")
"""The dynamic index is the pitch inertia over mass and both distances of the centre of gravity, I / (m a b); the rear
share is the part of the sprung mass on the rear axle, a / (a + b)."""
USUAL_MASS_KG = 700.0
"""Sprung mass of one side where nobody says it (a convention): no IRI depends on it."""


@dataclass(frozen=True)
class PublishedAxle:
    """One end of a published car, of one side: masses [kg], stiffnesses [N/m] and damping [N s/m]."""

    sprung_kg: float
    unsprung_kg: float
    stiffness: float
    damping: float
    tire_stiffness: float

    def logs(self) -> Array:
        """Logarithms (4,) of ``OF_AXLE``."""
        return np.log([np.sqrt(self.stiffness / self.sprung_kg) / (2 * np.pi),
                       self.damping / (2 * np.sqrt(self.stiffness * self.sprung_kg)),
                       np.sqrt((self.stiffness + self.tire_stiffness) / self.unsprung_kg) / (2 * np.pi),
                       self.unsprung_kg / self.sprung_kg])


# sprung mass of a side, pitch inertia of a side, distance of the centre of gravity from the front and the rear axle,
# then unsprung mass, stiffness, damping and tire stiffness of each axle
HALF_CARS = {
    "Toyota RAV4 2009 (Blum 2015, Table 4.2)":
        (875, 1100, 1.47, 1.47, (55, 23088, 1776, 238180), (55, 23088, 1776, 238180)),
    "mid-size sedan (Abid, Chen and Nassar, International Scholarly Research Notices 2015, 974020, Table 2)":
        (730, 1230, 1.011, 1.803, (40, 19960, 1290, 175500), (35.5, 17500, 1690, 175500)),
    "Ford Escort (Althoff and Wuersching, CommonRoad: Vehicle models, 2020, Table 6)":
        (547.27, 671.13, 0.88392, 1.50876, (32.836, 21898, 1459.4, 189790), (32.836, 21898, 1459.4, 189790)),
    "BMW 320i (the same)":
        (482.855, 782.9, 1.1562, 1.4227, (31.896, 24453, 1786.2, 158290), (31.896, 19636, 1649.1, 158290)),
    "VW Vanagon (the same)":
        (658.3, 1102.15, 1.1508, 1.3211, (40.572, 33577, 2405.6, 212640), (40.572, 39125, 2769.7, 212640)),
}
# The RAV4 was compared with its source, the three cars of Althoff and Wuersching with the parameter files of
# CommonRoad. The rest is as other works quote it. Of the sedan's rear damper some have 1620 N s/m where this has 1690:
# that moves the mean damping ratio of the prior by 0.2 %.
QUARTER_CARS = {
    "Golden Car, a median of American cars of 1980 (Sayers, Transportation Research Record 1501, 1995)":
        PublishedAxle(1.0, 0.15, 63.3, 6.0, 653.0),
    "Renault Megane Coupe (Savaresi et al., Semi-Active Suspension Control Design for Vehicles, 2010)":
        PublishedAxle(315, 37.5, 29500, 1500, 210000),
    "passenger car (Lin and Kanellakopoulos, IEEE Control Systems 17(3), 1997)":
        PublishedAxle(290, 59, 16812, 1000, 190000),
    "passenger car (Rajamani, Vehicle Dynamics and Control, 2nd ed., 2012, chapter 10)":
        PublishedAxle(250, 45, 16000, 1000, 160000),
    "passenger car (Yue, Butsuen and Hedrick, Journal of Dynamic Systems, Measurement, and Control 111, 1989)":
        PublishedAxle(240, 36, 16000, 980, 160000),
}
_HOP_APART = 0.08
"""Logarithm by which a car's wheel hops differ (a judgement: the tables give both axles one tire and often one mass, so
that they do not say it)."""
_PATCH_M, _PATCH_SPREAD = 0.22, 0.15
"""Length over which a tire averages the road: contact patch and what the belt bridges, 0.2 to 0.25 m in the files that
come with ridelog, 0.25 m in ASTM E1926; a judgement."""


@dataclass(frozen=True, eq=False)
class CarPrior:
    """Mean (p,) and covariance (p, p) of a car's coordinates: logarithms of ``NUMBERS``, of ``rear_share`` the log odds
    log(s / (1 - s))."""

    mean: Array
    covariance: Array


@cache
def published_prior() -> CarPrior:
    """Of a car that nobody has measured."""
    halves = [_of_half_car(*one) for one in HALF_CARS.values()]
    axles = np.array([[front.logs(), rear.logs()] for front, rear, *_ in halves])
    of_cars = np.vstack([axles.mean(axis=1), [one.logs() for one in QUARTER_CARS.values()]])
    middle, common = _one_more(of_cars)
    _, apart = _one_more(axles[:, 0] - axles[:, 1])
    apart[OF_AXLE.index("hop_hz")] = _HOP_APART**2
    index, share = (_one_more(np.array([one[place] for one in halves])[:, None]) for place in (2, 3))
    count = len(OF_AXLE)
    mean, covariance = np.zeros(len(NUMBERS)), np.zeros((len(NUMBERS), len(NUMBERS)))
    mean[:2 * count] = np.tile(middle, 2)
    for one in range(count):
        ends = np.ix_([one, count + one], [one, count + one])
        covariance[ends] = common[one] + apart[one] / 4 * np.array([[1, -1], [-1, 1]])
    for place, (value, variance) in enumerate((index, share), start=2 * count):
        mean[place], covariance[place, place] = value[0], variance[0]
    mean[-1], covariance[-1, -1] = np.log(_PATCH_M), _PATCH_SPREAD**2
    return CarPrior(mean, covariance)


WHEELBASE_ERROR = 0.01
"""Share by which a wheelbase out of a car's papers, or by a tape, is off: they give it to a millimetre, and the load
moves it by a per cent (a judgement)."""


def generic_car(wheelbase_m: float | None = None, mass_kg: float | None = None) -> tuple[Vehicle, NumberErrors]:
    """The car that nobody has measured, as a half car, and the standard errors of its numbers with their correlations.

    wheelbase_m    known to ``WHEELBASE_ERROR`` [m]; None: that of one more of the published cars
    mass_kg        of the whole car [kg]; None: as of ``USUAL_MASS_KG``. It is a scale: no IRI depends on it
    """
    prior = published_prior()
    logs, spread = _one_more(np.log([[one[2] + one[3]] for one in HALF_CARS.values()]))
    middle, variance = (logs[0], spread[0]) if wheelbase_m is None else (np.log(wheelbase_m), WHEELBASE_ERROR**2)
    mean = np.append(prior.mean, middle)
    covariance = np.diag(np.append(np.zeros(len(prior.mean)), variance))
    covariance[:-1, :-1] = prior.covariance

    def vehicle(at: Array, sprung_mass_kg: float = USUAL_MASS_KG) -> Vehicle:
        return car_of(at[:-1], float(np.exp(at[-1])), sprung_mass_kg)

    usual = vehicle(mean)
    whole_kg = 2 * (USUAL_MASS_KG + sum(one.unsprung_mass_kg for one in (usual.front, usual.rear) if one is not None))
    car = usual if mass_kg is None else vehicle(mean, USUAL_MASS_KG * mass_kg / whole_kg)
    return car, number_errors(lambda at: vehicle(at, car.sprung_mass_kg), mean, covariance)


def number_errors(vehicle_at: Callable[[Array], Vehicle], at: Array, covariance: Array) -> NumberErrors:
    """Errors of the numbers of a vehicle's file out of the covariance (p, p) of coordinates (p,). The sensor's place is
    one of them where it is not at the centre of gravity. ``vehicle_at``: the vehicle with such coordinates, all of one
    sprung mass."""
    names = [name for name in sized(vehicle_at(at)) if name != "sprung_mass_kg"]
    if vehicle_at(at).sensor.ahead_m:
        names.append("sensor.ahead_m")
    ends = ((vehicle_at(at + step), vehicle_at(at - step)) for step in STEP * np.eye(len(at)))
    slopes = np.array([[read(high, name) - read(low, name) for name in names] for high, low in ends]).T / (2 * STEP)
    return NumberErrors.of_covariance(names, slopes @ covariance @ slopes.T)


def _of_half_car(mass: float, inertia: float, front_m: float, rear_m: float, front: Sequence[float],
                 rear: Sequence[float]) -> tuple[PublishedAxle, PublishedAxle, float, float]:
    """Its axles, the logarithm of its dynamic index, and the log odds of its rear share."""
    share = front_m / (front_m + rear_m)
    return (PublishedAxle(mass * (1 - share), *front), PublishedAxle(mass * share, *rear),
            float(np.log(inertia / (mass * front_m * rear_m))), float(np.log(share / (1 - share))))


def _one_more(values: Array) -> tuple[Array, Array]:
    """Mean and variance (p,) of one more car, out of those that there are (n, p): Student's t with n - 1 degrees."""
    n = len(values)
    return values.mean(axis=0), values.var(axis=0, ddof=1) * (1 + 1 / n) * (n - 1) / (n - 3)


def share_of(coordinate: float) -> float:
    """The share that a coordinate stands for: the inverse of the logit."""
    return float(1 / (1 + np.exp(-coordinate)))


def car_of(coordinates: Array, wheelbase_m: float, sprung_mass_kg: float = USUAL_MASS_KG,
           sensor: SensorPlace = AT_CENTRE_OF_GRAVITY, name: str = GENERIC) -> Vehicle:
    """The half car with these coordinates (p,), as ``CarPrior`` has them; ``sprung_mass_kg`` of one side."""
    x = np.asarray(coordinates, float)
    share = share_of(x[NUMBERS.index("rear_share")])
    front_m, rear_m = wheelbase_m * share, wheelbase_m * (1 - share)
    inertia = float(np.exp(x[NUMBERS.index("dynamic_index")])) * sprung_mass_kg * front_m * rear_m
    count = len(OF_AXLE)
    front = _axle(np.exp(x[:count]), front_m, sprung_mass_kg * (1 - share))
    rear = _axle(np.exp(x[count:2 * count]), rear_m, sprung_mass_kg * share)
    return Vehicle(name, "half_car", float(sprung_mass_kg), inertia, front, rear, float(np.exp(x[-1])), sensor=sensor)


def _axle(numbers: Array, cg_distance_m: float, carried_kg: float) -> Axle:
    bounce_hz, damping, hop_hz, ratio = map(float, numbers)
    stiffness = carried_kg * (2 * np.pi * bounce_hz) ** 2
    unsprung_kg = ratio * carried_kg
    tire = unsprung_kg * (2 * np.pi * hop_hz) ** 2 - stiffness
    return Axle(cg_distance_m, unsprung_kg, float(stiffness), float(2 * damping * np.sqrt(stiffness * carried_kg)),
                float(tire))


def coordinates_of(vehicle: Vehicle) -> Array:
    """Coordinates (p,) of a half car or a full car, as ``CarPrior`` has them. ValueError for a quarter car."""
    rear = vehicle.rear
    if rear is None or vehicle.pitch_inertia_kg_m2 is None:
        raise ValueError(f"{vehicle.name}: expected a car with two axles")
    sides = 2 if vehicle.model == "full_car" else 1
    mass, inertia = vehicle.sprung_mass_kg / sides, vehicle.pitch_inertia_kg_m2 / sides
    ends = [(one.unsprung_mass_kg, one.suspension_stiffness_n_per_m, one.suspension_damping_n_s_per_m,
             one.tire_stiffness_n_per_m) for one in (vehicle.front, rear)]
    front, back, index, share = _of_half_car(mass, inertia, vehicle.front.cg_distance_m, rear.cg_distance_m, *ends)
    return np.concatenate([front.logs(), back.logs(), [index, share, np.log(vehicle.contact_patch_m)]])
