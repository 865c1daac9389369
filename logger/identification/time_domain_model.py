"""What a car with effects would have recorded on the runs that were driven: it is stepped through time.

Problem: dry friction, a bump stop or a sensor on a loose bracket are no numbers of a linear car, and the laws of some
of them have no transform. Solution: the car with its effects is driven through the runs as the lab drives it
(``SimulatedRuns``), whatever its laws are; derivatives are differences of such drives, over steps on the scales that
the numbers move on. An obstacle of which only the kind is known lies on the road in closed form, as it does in
frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.identification.drive_model import DriveModel
from logger.identification.obstacle_paths import Obstacle
from logger.identification.unknown_inputs import SPEED_SCALE, RoadInput
from logger.profiles.track import Stance, Surface, Track, Way, WheelPath, WheelTracks, along_paths
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns, steps_hz
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import slope_of, steps_of
from logger.vehicle.named_parameters import Free
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

# Steps of differences, either way: of what moves by factors, and of effects' numbers as shares; of a factor of all
# distances, which moves what lies far away; of places [m]. What sticks and slips makes a response that is jagged on a
# fine scale: smaller steps show its teeth, and not where it leads.
_STEP, _SHARE_STEP, _SPEED_STEP, _PLACE_STEP_M = 5e-3, 1e-2, 1e-6, 5e-3
_KEPT_TRACKS = 4


class SimulatedModel(DriveModel):
    """A car with effects, of any laws."""

    exact = False

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], records: Sequence[Run],
                 road: RoadInput | None = None, effects: Sequence[Chosen] = ()) -> None:
        super().__init__(vehicle, parameters, records, road, effects)
        self._runs = SimulatedRuns(records, steps_hz(vehicle))
        self._tracks: dict[tuple[int, tuple[Obstacle, ...]], WheelTracks] = {}

    def predict(self, values: Array) -> list[Array]:
        """As ``Predictor``: accelerations without the beginnings of the records [m/s2]."""
        roads = [self.road_with(values, run) for run in range(len(self.records))]
        farther_m = [record.distance_m * (1 / road.speed_scale - 1)
                     for record, road in zip(self.records, roads, strict=True)]
        tracks = [self._track(run, road) for run, road in enumerate(roads)]
        predictions = self._runs.predict(self.car_with(values), farther_m, tracks=tracks)
        return [self.observed(run, one[self.records[run].first:]) for run, one in enumerate(predictions)]

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``DifferentiablePredictor``: differences, to both sides of a number unless it is at a bound."""
        columns = []
        for index, one in enumerate(self.parameters):
            step = self._step(one, float(values[index]))
            ends = np.clip(values[index] + step * np.array([-1.0, 1.0]), one.low, one.high)
            low, high = (self.predict(np.where(np.arange(len(values)) == index, end, values)) for end in ends)
            columns.append([(there - here) / (ends[1] - ends[0]) for here, there in zip(low, high, strict=True)])
        return self.predict(values), [np.stack(parts, axis=1) for parts in zip(*columns, strict=True)]

    def _step(self, one: Free, value: float) -> float:
        """Of a number where it is."""
        if (free := self._free_parameters.get(one.name)) is not None:
            chosen = self.effects[free.effect]
            parameter = chosen.effect.parameters[free.parameter]
            here = Chosen(chosen.effect, {**chosen.values, parameter.name: value})
            step = float(steps_of([*self.effects[: free.effect], here], [free], _STEP, _SHARE_STEP)[0])
            return step / slope_of(parameter, value)
        if one.by_factors:
            return value * (_SPEED_STEP if one.name.endswith(SPEED_SCALE) else _STEP)
        return _PLACE_STEP_M

    def _track(self, run: int, road: RoadInput) -> WheelTracks:
        """The road of a run with what lies on it; the same object as long as nothing changes."""
        track, obstacles = self.records[run].track, tuple(road.obstacles.values())
        if not obstacles or not isinstance(track, Track):
            return track
        if (run, obstacles) not in self._tracks:
            for old in [*self._tracks][: -_KEPT_TRACKS * len(self.records)]:
                del self._tracks[old]
            self._tracks[run, obstacles] = _TrackWithObstacles(track, obstacles)
        return self._tracks[run, obstacles]


@dataclass(frozen=True, eq=False)
class _TrackWithObstacles:
    """A track on which obstacles lie, alike under left and right wheels."""

    track: Track
    obstacles: tuple[Obstacle, ...]

    def resurfaced(self, surface: Surface) -> _TrackWithObstacles:
        """The road itself under the obstacles, which stay what they are."""
        return replace(self, track=self.track.resurfaced(surface))

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """As ``WheelTracks``."""
        patch_m = stance.contact_patch_m
        obstacles = [one.path(patch_m) for one in self.obstacles]
        return along_paths([_Sum([path, *obstacles]) for path in self.track.tire_paths(patch_m)], way, stance)


@dataclass(frozen=True, eq=False)
class _Sum:
    """Paths on top of each other."""

    paths: Sequence[WheelPath]

    def step_means(self, distance_m: Array) -> tuple[Array, Array]:
        """As ``WheelPath``."""
        elevations, means = zip(*(one.step_means(distance_m) for one in self.paths), strict=True)
        return sum(elevations[1:], elevations[0]), sum(means[1:], means[0])
