"""Readings of several pieces on one grid: even whatever the pieces are, each reading once, near its own instant."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from logger.extraction.along_track import run_grid

RATE_HZ = 100.0


@given(st.floats(-1e6, 1e7), st.lists(st.tuples(st.integers(1, 300), st.floats(0.0, 0.6)), min_size=1, max_size=12))
def test_every_reading_keeps_its_value_and_its_instant(start_s: float, pieces: list[tuple[int, float]]) -> None:
    """Pieces of so many readings, each so long after a step beyond the one before."""
    times, at_s = [], round(start_s, 6)
    for count, hole_s in pieces:
        times.append(at_s + hole_s + np.arange(count) / RATE_HZ)
        at_s = times[-1][-1] + 1 / RATE_HZ
    time_s = np.round(np.concatenate(times), 6)
    grid = run_grid(time_s, RATE_HZ)
    assert np.allclose(np.diff(grid.time_s), 1 / RATE_HZ, rtol=0, atol=1e-6)
    assert grid.row[grid.row >= 0].tolist() == list(range(len(time_s)))
    assert (np.diff(grid.taken_s) > 0).all()
    assert np.array_equal(grid.taken_s[grid.row >= 0], time_s)
    assert np.abs(grid.taken_s - grid.time_s).max() <= 1 / RATE_HZ
    assert np.array_equal(grid.laid(time_s)[grid.row >= 0], time_s)


def test_a_piece_half_a_step_beside_the_first_stays_together() -> None:
    """Half a step is rounded once for the piece, not for each of its readings, up here and down there."""
    time_s = np.concatenate([np.arange(50) / RATE_HZ, 0.755 + np.arange(50) / RATE_HZ])
    grid = run_grid(time_s, RATE_HZ)
    assert np.diff(np.flatnonzero(grid.row >= 0)).tolist().count(1) == 98
    assert len(run_grid(np.empty(0), RATE_HZ).row) == 0
