"""Effects on a rig whose numbers nobody knows, shaken by an integrator that shares nothing with ridelog."""

from pathlib import Path

import numpy as np
import pytest

import ridelog

from ...support.drives.bench_rig import Rig, shaken, swept_table, write_run

CANDIDATES = ("progressive_spring", "frame_friction", "dry_friction", "sensor_gain")
FILE = ("name: bench\nmodel: quarter_car\nsprung_mass_kg: 2.5 +- 2%\nfront:\n  unsprung_mass_kg: {}\n"
        "  suspension_stiffness_n_per_m: {}\n  suspension_damping_n_s_per_m: {}\n  tire_stiffness_n_per_m: {}\n"
        "contact_patch_m: 0\neffects: []\n")


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "effect", "number", "truth"), [
    (Rig(wheel_kg=1.0, damper=7.5, tire=6000.0, cubic=4e6), "progressive_spring", "cubic_stiffness_n_per_m3", 4e6),
    (Rig(wheel_kg=1.0, damper=7.5, tire=6000.0, body_guide_n=1.5), "frame_friction", "body_friction_force_n", 1.5),
    (Rig(wheel_kg=1.0, damper=7.5), "", "", 0.0)])
def test_an_effect_is_found_though_the_file_is_off_by_a_factor_of_two(
        rig: Rig, effect: str, number: str, truth: float, tmp_path: Path) -> None:
    write_run(tmp_path / "run", shaken(rig, swept_table(20.0, 1.0, 15.0, 0.006)), 0.02, 3)
    off = rig.wheel_kg * 2, rig.spring / 2, rig.damper * 2, rig.tire * 1.8
    vehicle = tmp_path / "rig.yaml"
    vehicle.write_text(FILE.format(*(f"{one} +- 100%" for one in off)), "utf-8")
    found = ridelog.diagnose(vehicle, tmp_path / "run", candidates=CANDIDATES)
    assert found.verdict == ((effect,) if effect else ())
    if effect:
        one = found.candidates[0]
        assert one.parameters[number] == pytest.approx(truth, abs=3 * one.standard_errors[number])
        assert one.standard_errors[number] < 0.1 * truth
        assert "starting points led to this result" in " ".join(str(found).split())
        assert found.steps[-1][1] < 0.2 * found.steps[1][1]
        assert np.isfinite([error for _, error in found.steps]).all()
