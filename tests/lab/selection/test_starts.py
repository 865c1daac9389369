"""Effects on a rig whose numbers nobody knows, shaken by an integrator that shares nothing with ridelog."""

from pathlib import Path

import numpy as np
import pytest

import ridelog

from ...support.drives.bench_rig import Rig, shaken, swept_table, write_run

CANDIDATES = ("progressive_spring", "dry_friction", "sensor_gain")
FILE = ("name: bench\nmodel: quarter_car\nsprung_mass_kg: 2.5 +- 2%\nfront:\n  unsprung_mass_kg: {}\n"
        "  suspension_stiffness_n_per_m: {}\n  suspension_damping_n_s_per_m: {}\n  tire_stiffness_n_per_m: {}\n"
        "contact_patch_m: 0\neffects: []\n")


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "effect"), [
    (Rig(wheel_kg=1.0, damper=7.5, tire=6000.0, cubic=4e6), "progressive_spring"), (Rig(wheel_kg=1.0, damper=7.5), "")])
def test_an_effect_is_found_though_the_file_is_off_by_a_factor_of_two(rig: Rig, effect: str, tmp_path: Path) -> None:
    write_run(tmp_path / "run", shaken(rig, swept_table(20.0, 1.0, 15.0, 0.006)), 0.02, 3)
    off = rig.wheel_kg * 2, rig.spring / 2, rig.damper * 2, rig.tire * 1.8
    vehicle = tmp_path / "rig.yaml"
    vehicle.write_text(FILE.format(*(f"{one} +- 100%" for one in off)), "utf-8")
    found = ridelog.diagnose(vehicle, tmp_path / "run", candidates=CANDIDATES)
    assert found.verdict == ((effect,) if effect else ())
    if effect:
        one = found.candidates[0]
        assert one.parameters["cubic_stiffness_n_per_m3"] == pytest.approx(
            rig.cubic, abs=3 * one.standard_errors["cubic_stiffness_n_per_m3"])
        assert one.standard_errors["cubic_stiffness_n_per_m3"] < 0.1 * rig.cubic
        assert "starts ended there" in str(found)
        assert found.steps[-1][1] < 0.2 * found.steps[1][1]
        assert np.isfinite([error for _, error in found.steps]).all()
