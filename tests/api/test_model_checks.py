"""Right input is not refused, whatever is missing from the model: a suspension that sticks shakes the body two to three
times as much as a free one, and above its bounce the other way; a sensor far behind the centre of gravity feels a pitch
that may be stronger than the bounce, half a swing later."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from logger.api.inputs import run_on_road as read_run
from logger.api.lab.bench import known_effects, silent
from logger.api.lab.checks import check_model, checked_runs, predicted
from logger.commands.main import main
from logger.errors import BadInput
from logger.lab.likelihood.priors import Tolerance
from logger.lab.road_match import match_below_bounce
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.vehicle_file import read_model
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz

from ..support.slow import release

MODEL = read_model(vehicle_file("rav4-2009"))
EFFECTS, _ = known_effects(MODEL, ())


def stuck(tmp_path: Path, road: str, friction_n: int) -> SimulatedRuns:
    """A drive at walking pace over a smooth road, in a car whose suspension rubs so much that it hardly moves."""
    return driven(tmp_path, road, 6, f"dry_friction:friction_force_n={friction_n}")


def driven(tmp_path: Path, road: str, speed_mps: float, effect: str, vehicle: str = "rav4-2009") -> SimulatedRuns:
    """A drive of a car with one effect."""
    folder = tmp_path / "run"
    folder.mkdir()
    main(["road", "generate", "--class", road, "--length", "250", "--seed", "5", "--out", str(folder / "profile.csv")])
    main(["simulate", "--vehicle", vehicle, "--profile", str(folder / "profile.csv"), "--speed", f"{speed_mps:g}",
          "--effect", effect, "--out", str(folder / "drive.csv")])
    return checked_runs([read_run(folder)])


OFFSET, AHEAD, BEHIND = "sensor_offset:offset_m=-1.2", "cg_shift:shift_m=0.47", "cg_shift:shift_m=-0.47"


@pytest.mark.slow
@pytest.mark.parametrize(("road", "friction_n"), [("A", 300), *release(("A", 200), ("B", 500))])
def test_a_suspension_that_sticks_is_no_wrong_input(tmp_path: Path, road: str, friction_n: int) -> None:
    check_model("rav4-2009", MODEL, stuck(tmp_path, road, friction_n), silent, EFFECTS, Tolerance())


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "speed_mps"), [
    (OFFSET, 6.2), (AHEAD, 4.5), (BEHIND, 5.5),
    *release((OFFSET, 4.5), (OFFSET, 5.5), (AHEAD, 5.5), (AHEAD, 6.2), (BEHIND, 4.5), (BEHIND, 6.2))])
def test_a_sensor_far_from_the_centre_of_gravity_is_no_wrong_input(tmp_path: Path, effect: str,
                                                                   speed_mps: float) -> None:
    """Below the bounce the sign is that of the wave at hand, not of the next half wave."""
    runs = driven(tmp_path, "A", speed_mps, effect)
    check_model("rav4-2009", MODEL, runs, silent, EFFECTS, Tolerance())
    prediction, = predicted("rav4-2009", MODEL, runs, ())
    body_hz = undamped_frequencies_hz(structure_of(MODEL.vehicle))[:2]
    for run, sign in ((runs.runs[0], 1), (replace(runs.runs[0], measured_mps2=-runs.runs[0].measured_mps2), -1)):
        found = match_below_bounce(run, run.main(prediction), body_hz)
        assert sign * (found.correlation - found.turned) > 0.25


def car_yaml(front: tuple[int, int], rear: tuple[int, int]) -> str:
    """A car's file with these springs [N/m] and dampers [N s/m]."""
    axles = "".join(
        f"{name}:\n  cg_distance_m: 1.45\n  unsprung_mass_kg: 80\n  suspension_stiffness_n_per_m: {spring}\n"
        f"  suspension_damping_n_s_per_m: {damper}\n  tire_stiffness_n_per_m: 300000\n"
        for name, (spring, damper) in (("front", front), ("rear", rear)))
    return (f"name: other\nmodel: half_car\nsprung_mass_kg: 1040\npitch_inertia_kg_m2: 2240\n{axles}"
            "contact_patch_m: 0.18\neffects: []\n")


OWN, FILED = car_yaml((31900, 1900), (35200, 2200)), car_yaml((38000, 1090), (63200, 3470))


@pytest.mark.parametrize(("filed", "sign", "is_turned"), [(FILED, 1, False), (OWN, 1, False), (OWN, -1, True)])
def test_where_springs_are_not_known_the_way_up_is_that_below_the_lowest_bounce_they_allow(
        tmp_path: Path, filed: str, sign: int, is_turned: bool) -> None:
    """Between its own bounce and that of a file with springs up to twice as stiff, a body moves against its model."""
    (own := tmp_path / "own.yaml").write_text(OWN, "utf-8")
    (file := tmp_path / "file.yaml").write_text(filed, "utf-8")
    run, = driven(tmp_path, "A", 8.3, "sensor_offset:offset_m=-1", str(own)).runs
    runs = SimulatedRuns([replace(run, measured_mps2=sign * run.measured_mps2)])
    said: list[str] = []
    check_model("other", read_model(file), runs, said.append, {}, Tolerance().widened(), anyway=True)
    assert any("upside down" in one for one in said) is is_turned


@pytest.mark.slow
def test_a_large_change_by_one_effect_is_no_other_car(tmp_path: Path) -> None:
    """Six numbers of a car, farther off than any are, come near to what a sensor 1.2 m behind the middle feels; the
    sensor's place comes nearer. Where it is not known as an effect, it is another car."""
    runs = driven(tmp_path, "C", 10, "sensor_offset:offset_m=-1.2")
    check_model("rav4-2009", MODEL, runs, silent, EFFECTS, Tolerance())
    others = {name: EFFECTS[name] for name in ("sensor_gain", "payload")}
    with pytest.raises(BadInput, match="found one of another car"):
        check_model("rav4-2009", MODEL, runs, silent, others, Tolerance())


@pytest.mark.slow
def test_a_free_one_in_feet_or_upside_down_is_refused(tmp_path: Path) -> None:
    run, = stuck(tmp_path, "B", 5).runs
    for factor, words in ((-1.0, "upside down"), (1 / 0.3048, "ft/s2")):
        with pytest.raises(BadInput, match=words):
            check_model("rav4-2009", MODEL,
                        SimulatedRuns([replace(run, measured_mps2=factor * run.measured_mps2)]), silent, EFFECTS,
                        Tolerance())
