"""Section 7.2, first item: the input found from the response, and the car without any input."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.estimation.batch import estimated
from logger.estimation.road_profile import RoadProfile, band_passed
from logger.estimation.sensor_noise import Sensor
from logger.identification.unknown_road.drive_operator import Drive
from logger.identification.unknown_road.fisher_scoring import RoadFit
from logger.identification.unknown_road.road_fit import fit_roads
from logger.identification.unknown_road.road_state import Options
from logger.profiles.track import Track
from logger.runs import Run
from logger.studies.checks import Statement, Word
from logger.studies.drives import PS_2119, RATE_HZ, Array, drive_over, places_m, random_road, rav4
from logger.studies.fit_methods import MASS, TRUTH
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table
from logger.units import WINDOW_M
from logger.vehicle.frequency_response import AxleResponse
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.named_parameters import free

SPEEDS_MPS = (10.0, 20.0)
_IRI, _LENGTH_M, _START = 4.0, 300, 1.2


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    road = random_road(_IRI, effort.count(_LENGTH_M, _LENGTH_M // 2), 7)
    drives = [drive_over(road, speed, PS_2119.on(_IRI, seed)) for seed, speed in enumerate(SPEEDS_MPS)]
    fits: list[tuple[str, list[Run]]] = [(f"one drive, {one.speed_mps[0]:g} m/s", [one]) for one in drives]
    fits.append(("both, over one road", drives))
    probes = effort.count(10, 4)
    found = [(what, _mass(which, probes)) for what, which in effort.each(fits)]
    mass = Table("Mass without any input: the road is unknown, its height and all", (
        Column("data"), Column("printed (3.4: output only)"), Column("truth [kg]", ".0f"), Column("ours [kg]", ".0f"),
        Column("error [%]", "+.1f"), Column("standard error [%]", ".1f")),
        tuple(_row(what, fit) for what, fit in found))
    profiles = [(one, *_profile(one, road)) for one in drives]
    table = Table("The input from the response of a known car", (
        Column("speed [m/s]", ".0f"), Column("waves from [m]", ".2f"), Column("to [m]", ".0f"),
        Column("road in that band, r.m.s. [mm]", ".2f"), Column("error of the estimate, r.m.s. [mm]", ".2f"),
        Column("correlation", ".3f")), tuple(_of_profile(*one) for one in profiles))
    last = found[-1][1]
    verdict = ("The source leaves it to others to find the input from the response; ridelog does both halves. With a "
               "known car ridelog estimate gives the profile itself, in the band of waves that the car feels, "
               f"correlated {min(float(str(row[-1])) for row in table.rows):.2f} or better with the true one. With an "
               "unknown mass and no profile ridelog identify --unmeasured-road takes the road for a random one: one "
               "drive tells the mass poorly and says so; two drives over one road at two speeds (--same-road) tell it "
               f"to {100 * last.standard_errors[MASS] / TRUTH[MASS]:.0f} %, because the road is the same and what the "
               "speed changes is the car. The source finds such results poor, having nothing to tell road from car.")
    drive, start_m, spacing_m, true, ours, _ = profiles[-1]
    place_m = np.asarray(start_m + spacing_m * np.arange(len(true)), float)
    picture = Picture(Curves(f"The road from the response at {drive.speed_mps[0]:g} m/s", "distance [m]",
                             "elevation in the band [mm]", (Line("true", place_m, 1000 * true),
                                                            Line("from the response", place_m, 1000 * ours))),
                      "nothing: future work")
    error, std = last.parameters[MASS] - TRUTH[MASS], last.standard_errors[MASS]
    return Result((table, mass), verdict, (picture,), (
        Statement("correlation of the profile found with the true one, the lesser drive", "further research: the input "
                  "from what is found in the response", min(float(str(row[-1])) for row in table.rows), 0.9,
                  word=Word.BETTER),
        Statement("error of the mass from two drives without any input, over its standard error", "an unknown input "
                                                                                                  "gives "
                  "poor results", error / std, -3.0, 3.0, Word.BETTER),
        Statement("that standard error [%]", "an unknown input gives poor results", 100 * std / TRUTH[MASS], 0.0, 10.0,
                  Word.BETTER)))


def _mass(drives: list[Run], probes: int) -> RoadFit:
    car = AxleResponse(rav4(), [free(rav4(), MASS, _START * TRUTH[MASS])], RATE_HZ)
    roads = [[Drive(float(RATE_HZ), one.measured_mps2, one.distance_m) for one in drives]]
    return fit_roads(car, roads, Options(probes=probes, last_probes=probes, refuse=False))


def _row(what: str, found: RoadFit) -> tuple[Cell, ...]:
    mass, error = found.parameters[MASS], found.standard_errors[MASS]
    return (what, "poor", TRUTH[MASS], mass, 100 * (mass / TRUTH[MASS] - 1), 100 * error / TRUTH[MASS])


def _profile(drive: Run, road: Track) -> tuple[float, float, Array, Array, RoadProfile]:
    """Start and spacing [m], the true road in the band that is known, and that of the estimate [m]."""
    sensor = Sensor(PS_2119.noise_mps2, PS_2119.step_mps2)
    _, found = estimated(known_vehicle(rav4()), sensor, WINDOW_M, drive.measured_mps2, drive.distance_m)
    assert found is not None
    part = max(found.parts, key=lambda one: one.length_m)
    place_m = part.start_m + part.spacing_m * np.arange(len(part.elevation_m))
    height = np.interp(place_m, places_m(road), road.elevation_m)
    true = band_passed(height, part.spacing_m, found.shortest_m, found.longest_m)
    inside = (place_m >= place_m[0] + found.longest_m / 2) & (place_m <= place_m[-1] - found.longest_m / 2)
    return float(place_m[inside][0]), part.spacing_m, true[inside], part.elevation_m[inside], found


def _of_profile(drive: Run, _start_m: float, _spacing_m: float, true: Array, ours: Array, found: RoadProfile
                ) -> tuple[Cell, ...]:
    return (float(drive.speed_mps[0]), found.shortest_m, found.longest_m, 1000 * float(true.std()),
            1000 * float((ours - true).std()), float(np.corrcoef(true, ours)[0, 1]))


STUDY = Study("section_7_2_input", "The input found from the response", "Section 7.2, first item",
              "Nothing is printed: the source names it as future work. Simulated: the car of Table 4.2 with a PS-2119 "
              "over 300 m of random road of IRI 4 m/km at 10 and 20 m/s.", run,
              items=(Item("7.2 input from response", Word.BETTER,
                          "The profile comes out of the response of a known car, and the mass out of two drives over "
                          "one road that nobody measured."),))
