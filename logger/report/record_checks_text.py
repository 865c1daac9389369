"""What was found and done about a record before it was used, for a person and for a program."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from logger.left_out import left_out_json, left_out_lines
from logger.store.formats.record_checks import EvenRecord


def checks_json(record: EvenRecord) -> dict[str, Any]:
    """``doubts``, one object each; ``resampled``: how, or null; ``left_out``: of its samples."""
    return {**left_out_json(record.left_out), "doubts": [doubt.as_json() for doubt in record.doubts],
            "resampled": None if record.resampled is None else asdict(record.resampled)}


def checks_lines(record: EvenRecord) -> list[str]:
    """What was done to the record; empty: nothing."""
    done = record.resampled
    if done is None:
        return left_out_lines(record.left_out)
    dropped = f"{done.repeats_dropped:.0%} repeated samples dropped, then " if done.repeats_dropped else ""
    return [*left_out_lines(record.left_out),
            f"Resampled: {dropped}laid from {done.from_hz:.4g} Hz (steps up to {done.widest_step_s:.3g} s) on an even "
            f"grid of {done.to_hz:.4g} Hz, through an anti-alias filter."]
