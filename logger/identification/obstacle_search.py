"""Where on the way an obstacle lies, from what the sensor felt (4.4.5 of Blum 2015: "easily located").

Problem: a fit goes downhill, and an obstacle that is laid a car's length away from the real one has the real one behind
a hill. Solution: it is laid at every place in turn, with the height that fits best there, and the place that leaves the
least is taken; near enough for a fit to begin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from logger.identification.frequency_domain_model import VehicleModel
from logger.identification.unknown_inputs import RoadInput
from logger.runs import Run
from logger.vehicle.named_parameters import Free
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

# Places are so much of a bump's width apart, and so many seconds of the way at most.
_OF_WIDTH, _OF_TIME_S = 0.15, 0.05
_MOST_PLACES = 4000
_REFINED = 9


def located(vehicle: Vehicle, record: Run, road: RoadInput, part: str) -> float:
    """Where the ``part`` ("bump" or "step") of a road begins in a record, as true distance [m].

    Everything else is as ``vehicle`` and ``road`` have it; the height only has to have the right sign. ValueError for a
    record whose way is so long that there are too many places to try, or that has none.
    """
    obstacle = road.obstacles[part]
    way_m = record.distance_m[record.first:] / road.speed_scale
    pace_m = float(np.median(np.abs(np.diff(way_m)))) * record.rate_hz * _OF_TIME_S
    apart_m = min(pace_m, _OF_WIDTH * obstacle.length_m) if obstacle.length_m else pace_m
    first_m, last_m = float(way_m.min()) - obstacle.length_m, float(way_m.max())
    count = int((last_m - first_m) / max(apart_m, 1e-6)) + 1
    if not np.ptp(way_m) > 0:
        raise ValueError(f"{part}: expected a drive over it, found a car that stands")
    if count > _MOST_PLACES:
        raise ValueError(f"{part}: expected a start_m, as {last_m - first_m:g} m are too many to look for it on")
    place = f"{part}.start_m"
    model = VehicleModel(vehicle, [Free(place, first_m, first_m - 1, last_m + 1, place=True)], [record], road)
    without = replace(road, bump=None) if part == "bump" else replace(road, step=None)
    bare = VehicleModel(vehicle, [], [record], without).predict(np.empty(0))[0]
    coarse = _best(model, record.kept_mps2, bare, np.linspace(first_m, last_m, max(count, 2)))
    return _best(model, record.kept_mps2, bare, coarse + apart_m * np.linspace(-1, 1, _REFINED))


def _best(model: VehicleModel, measured: Array, bare: Array, places: Array) -> float:
    """The place whose response, times the best factor above 0, leaves the least of what was ``measured``; ``bare`` is
    the response without the obstacle."""
    gains = []
    for place in places:
        felt = model.predict(np.array([place]))[0] - bare
        power = float(felt @ felt)
        gains.append(max(float(felt @ (measured - bare)), 0.0) ** 2 / power if power > 0 else 0.0)
    return float(places[int(np.argmax(gains))])
