"""Wrong input is refused before any effect is sought, and right input never is.

    python -m tests.validation.wrong_input --cases 50

Each case is one to four runs of the examination's simulator, with nothing, one effect, two, or one that is off the list
missing, or with distances that wander. As it is it must pass; with the profile of another case, with its own read
backwards or beginning 50 m later, with elevations in mm or feet, and with accelerations in g or upside down, it must
not. With the vehicle of the last case of its kind it must not where that model says next to nothing of the record; cars
that are nearly alike cannot be distinguished from a missing effect, and count as neither. Printed are the shares beside
the goals. Seeds as in ``examine``.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from logger.api.inputs import run_on_road as read_run
from logger.api.lab.bench import known_effects, silent
from logger.api.lab.checks import check_model, checked_runs
from logger.errors import BadInput
from logger.lab.another_car import POOR_ERROR
from logger.lab.likelihood.priors import Tolerance
from logger.profiles.track import Track
from logger.runs import Run, normalised_rms_error
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.vehicle_file import CarModel, read_model
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.compose import compose

from .cases.case_files import write_case
from .cases.random_case import case
from .cases.seeds import add_seed_options, first_seed, seeds

KINDS = ("none", "one", "two", "outsider", "wandering")
Change = Callable[[Run, Track], Run]
"""A run made wrong, by the road of another case."""


def _with_track(change: Callable[[Track, Track], Track]) -> Change:
    return lambda run, other: replace(run, track=change(run.track, other))


def _scaled(factor: float) -> Change:
    return _with_track(lambda own, _: Track(own.spacing_m, own.elevation_m * factor, own.start_m))


WRONG: dict[str, Change] = {
    "another road": _with_track(lambda own, other: Track(other.spacing_m, other.elevation_m, own.start_m)),
    "read backwards": _with_track(lambda own, _: Track(own.spacing_m, own.elevation_m[::-1].copy(), own.start_m)),
    "50 m later": _with_track(lambda own, _: Track(own.spacing_m, own.elevation_m, own.start_m + 50.0)),
    "in mm": _scaled(1000.0), "in feet": _scaled(1 / 0.3048),
    "in g": lambda run, _: replace(run, measured_mps2=run.measured_mps2 / STANDARD_GRAVITY_MPS2),
    "upside down": lambda run, _: replace(run, measured_mps2=-run.measured_mps2),
}


ANOTHER_CAR = "another car"


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=50)
    add_seed_options(parser)
    options = parser.parse_args()
    passed: Counter[str] = Counter()
    refused: Counter[str] = Counter()
    others: Track | None = None
    cars: dict[bool, CarModel] = {}
    for number, seed in enumerate(seeds(first_seed(options), options.cases, options.release)):
        kind = KINDS[number % len(KINDS)]
        runs, model = made(kind, seed)
        for words, change in ({"right": None} | (WRONG if others is not None else {})).items():
            wrong = runs if change is None or others is None else [change(run, others) for run in runs]
            complaint = refusal(wrong, model)
            (refused if complaint else passed)[words] += 1
            if (complaint is None) != (change is None):
                print(f"{kind} {seed}, {words}: {complaint or 'not refused'}", flush=True)
        others = runs[0].track
        has_two_axles = model.vehicle.rear is not None
        other = cars.get(has_two_axles)
        if other is not None and says_little(runs, other):
            complaint = refusal(runs, other)
            (refused if complaint else passed)[ANOTHER_CAR] += 1
            print(f"{kind} {seed}, {ANOTHER_CAR}: {complaint or 'not refused'}", flush=True)
        cars[has_two_axles] = model
    return max(list(_reported(refused, passed)))


def says_little(runs: list[Run], model: CarModel) -> bool:
    """Whether a model explains less than a third of the power of what was measured."""
    return normalised_rms_error(runs, SimulatedRuns(runs).predict(compose(model.vehicle, model.effects))) > POOR_ERROR


def made(kind: str, seed: int) -> tuple[list[Run], CarModel]:
    """Runs and the vehicle of a case, as the lab reads them."""
    with tempfile.TemporaryDirectory() as name:
        write_case(case(kind, seed), Path(name))
        folders = sorted(path.parent for path in Path(name).glob("*/drive.csv"))
        return list(checked_runs(list(map(read_run, folders))).runs), read_model(Path(name) / "vehicle.yaml")


def refusal(runs: list[Run], model: CarModel) -> str | None:
    """Why a model and runs are refused; None: they are not."""
    try:
        check_model("vehicle.yaml", model, SimulatedRuns(runs), silent, known_effects(model, ())[0],
                    Tolerance.numbers)
    except BadInput as error:
        return str(error)
    return None


def _reported(refused: Counter[str], passed: Counter[str]) -> Iterator[int]:
    """Print the figures; 1 for each goal that is missed."""
    print(f"right: {refused['right']} of {refused['right'] + passed['right']} refused (goal 0)")
    yield int(refused["right"] > 0)
    for words in (*WRONG, ANOTHER_CAR):
        print(f"{words}: {refused[words]} of {refused[words] + passed[words]} refused (goal all)")
        yield int(passed[words] > 0)


if __name__ == "__main__":
    raise SystemExit(main())
