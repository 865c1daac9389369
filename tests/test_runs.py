"""What a run says of itself: where its band ends, what to call it."""

from __future__ import annotations

import pytest

from logger.runs import RecordFacts, shortened


@pytest.mark.parametrize(("facts", "end_hz"), [
    (RecordFacts(), None), (RecordFacts(taken_hz=50.0), 25.0), (RecordFacts(pass_band_hz=(0.5, 15.0)), 15.0)])
def test_a_record_ends_at_half_the_rate_it_was_taken_at_or_where_its_pass_band_ends(facts: RecordFacts,
                                                                                    end_hz: float | None) -> None:
    assert facts.seen_to_hz == end_hz


def test_a_run_is_called_as_its_last_folder_unless_two_are_alike() -> None:
    assert shortened(["a/one", "b/two/"]) == {"a/one": "one", "b/two/": "two"}
    assert shortened(["a/one", "b/one"]) == {"a/one": "a/one", "b/one": "b/one"}
