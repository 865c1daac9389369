"""What a run says of itself: where its band ends, how far its other signals are off, what to call it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.runs import RecordFacts, Signal, shortened, signal_errors

from .support.lab.runs_with_residual import a_run


@pytest.mark.parametrize(("facts", "end_hz"), [
    (RecordFacts(), None), (RecordFacts(taken_hz=50.0), 25.0), (RecordFacts(pass_band_hz=(0.5, 15.0)), 15.0)])
def test_a_record_ends_at_half_the_rate_it_was_taken_at_or_where_its_pass_band_ends(facts: RecordFacts,
                                                                                    end_hz: float | None) -> None:
    assert facts.seen_to_hz == end_hz


def test_each_signal_is_judged_against_its_own_prediction() -> None:
    run = a_run("run", 10.0, 6.0, 1)
    wave = np.sin(np.arange(run.count) / 7.0)
    signals = tuple(Signal(name, "acceleration") for name in ("near", "far"))
    run = replace(run, more=np.stack([2.0 * wave, 5.0 * wave]), facts=replace(run.facts, signals=signals))
    predicted = np.concatenate([np.zeros(run.count), 1.8 * wave, 4.0 * wave])
    assert signal_errors([run], [predicted]) == pytest.approx({"near": 0.1, "far": 0.2})


def test_a_run_is_called_as_its_last_folder_unless_two_are_alike() -> None:
    assert shortened(["a/one", "b/two/"]) == {"a/one": "one", "b/two/": "two"}
    assert shortened(["a/one", "b/one"]) == {"a/one": "a/one", "b/one": "b/one"}
