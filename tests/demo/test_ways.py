"""The map of ``demo --field``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.commands import demo
from logger.demo import BEYOND, DRIVES, FOURTH, LINE


def test_measured_lines_are_whole_and_drives_have_a_place_a_second(tmp_path: Path) -> None:
    demo.unpacked("field.zip", tmp_path)
    for name in (*DRIVES, FOURTH):
        folder = tmp_path / demo.RUNS / name
        folder.mkdir(parents=True)
        rows = [f"{index / 100:.2f},0,10,{index / 10:.1f},39,-77\n" for index in range(300)]
        (folder / "drive.csv").write_text("t_s,accel_z_mps2,speed_mps,distance_m,lat_deg,lon_deg\n" + "".join(rows))
    lines = {one.name: one for one in demo.ways(tmp_path).lines}
    for name, length_m in ((LINE, 500.0), (BEYOND, 600.0)):
        assert not lines[name].dots
        assert np.hypot(np.diff(lines[name].x), np.diff(lines[name].y)).sum() == pytest.approx(length_m, rel=0.01)
    for name in (*DRIVES, FOURTH):
        assert lines[name].dots and len(lines[name].x) == 3
