"""What of the runs was compared, in a sentence for a person and in an object for a program."""

from __future__ import annotations

from typing import Any

from logger.lab.likelihood.record_band import ComparedBand


def band_words(band: ComparedBand | None) -> list[str]:
    """Which frequencies were compared, and why; nothing where all were."""
    if band is None:
        return []
    errors = "errors compare measurement and model below that"
    if band.low_hz > 0:
        errors = f"nor below {band.low_hz:.3g} Hz; errors compare measurement and model in between"
    if band.cutoff_hz is None:
        return [f"Above {band.high_hz:.3g} Hz nothing is compared, as was asked or as run.yaml says; {errors}."]
    which = "Some of the records were" if band.some else "The record was"
    return [f"{which} low-passed at about {band.cutoff_hz:.2g} Hz: above {band.high_hz:.3g} Hz nothing is compared; "
            f"{errors}."]


def band_json(band: ComparedBand | None) -> dict[str, Any]:
    """The same for a program; nothing where all were."""
    if band is None:
        return {}
    return {"pass_band_hz": [band.low_hz, band.high_hz], "low_passed_at_hz": band.cutoff_hz}
