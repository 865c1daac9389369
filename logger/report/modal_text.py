"""Modes of a vibration record, for a person and for a program."""

from __future__ import annotations

from cmath import phase
from math import degrees, floor, isfinite, log10
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.modal.mode import FoundMode, ModalResult
from logger.report.quantities import known
from logger.store.formats.channel_file import ChannelRecord

Array = npt.NDArray[np.float64]

_REJECTED_SHOWN = 12
_IN_STEP = 0.02  # a shape whose parts are nearer to in step than this is shown with signs alone


def as_json(result: ModalResult, record: ChannelRecord, method: str) -> dict[str, Any]:
    """The agreed fields of each mode first, then its shape; null where the method cannot tell."""
    return {
        "modes": [mode_json(mode, record.names) for mode in result.modes],
        "rejected": [{"frequency_hz": one.frequency_hz, "damping_ratio": known(one.damping_ratio),
                      "reason": one.reason} for one in result.rejected],
        "method": method, "how": result.how, "order": result.order, "rate_hz": record.rate_hz,
        "samples": len(record.samples),
    }


def mode_json(mode: FoundMode, names: tuple[str, ...]) -> dict[str, Any]:
    """One mode; ``names`` of the channels."""
    return {
        "frequency_hz": mode.frequency_hz, "damping_ratio": known(mode.damping_ratio),
        "frequency_std_hz": mode.frequency_std_hz, "damping_std": known(mode.damping_std),
        "shape": [{"channel": name, "amplitude": float(abs(part)), "phase_deg": degrees(phase(part))}
                  for name, part in zip(names, mode.shape.tolist(), strict=True)],
    }


def vehicle_json(frequency_hz: Array, frequency_std_hz: Array, damping_ratio: Array, damping_std: Array
                 ) -> dict[str, Any]:
    """Modes (m,) of a vehicle's file; null where a standard deviation is not known."""
    rows = zip(*(one.tolist() for one in (frequency_hz, frequency_std_hz, damping_ratio, damping_std)), strict=True)
    return {"modes": [{"frequency_hz": hz, "damping_ratio": ratio, "frequency_std_hz": known(hz_std),
                       "damping_std": known(ratio_std)} for hz, hz_std, ratio, ratio_std in rows]}


def vehicle_lines(title: str, frequency_hz: Array, frequency_std_hz: Array, damping_ratio: Array, damping_std: Array
                  ) -> list[str]:
    """The same for a person."""
    rows = zip(*(one.tolist() for one in (frequency_hz, frequency_std_hz, 100 * damping_ratio, 100 * damping_std)),
               strict=True)
    return [title, "mode   frequency Hz           damping %",
            *(f"{number:4}   {with_error(hz, hz_std):22} {with_error(percent, percent_std)}"
              for number, (hz, hz_std, percent, percent_std) in enumerate(rows, start=1))]


def lines(result: ModalResult, record: ChannelRecord, name: str) -> list[str]:
    """What a person reads; ``name`` is that of the file."""
    seconds = len(record.samples) / record.rate_hz
    order = f", order {result.order}" if result.order else ""
    shown = [f"{name}: {seconds:.4g} s at {record.rate_hz:.6g} Hz, {len(record.names)} channels",
             f"{result.how}{order}", ""]
    if result.modes:
        shown.append("mode   frequency Hz           damping %             shape")
        shown += [f"{number:4}   {with_error(mode.frequency_hz, mode.frequency_std_hz):22} "
                  f"{with_error(100 * mode.damping_ratio, 100 * mode.damping_std):21} {_shape_words(mode)}"
                  for number, mode in enumerate(result.modes, start=1)]
        shown += ["", f"+- is one standard deviation. Shape: {', '.join(record.names)[:200]}; the largest is 1."]
    else:
        shown.append("No mode: nothing in this record stands out of what noise would do.")
    if result.rejected:
        shown += ["", "Found and not believed:"]
        shown += [f"  {one.frequency_hz:9.4g} Hz  {one.reason}" for one in result.rejected[:_REJECTED_SHOWN]]
        if len(result.rejected) > _REJECTED_SHOWN:
            shown.append(f"  and {len(result.rejected) - _REJECTED_SHOWN} more")
    return shown


def with_error(value: float, std: float) -> str:
    """A value with as many decimals as its error allows."""
    if not isfinite(value):
        return "not known"
    if not isfinite(std) or std <= 0:
        return f"{value:.4g}"
    decimals = min(9, max(0, 1 - floor(log10(std))))
    return f"{value:.{decimals}f} +- {std:.{decimals}f}"


def _shape_words(mode: FoundMode) -> str:
    if max(abs(part.imag) for part in mode.shape.tolist()) < _IN_STEP * len(mode.shape):
        return " ".join(f"{part.real:6.3f}" for part in mode.shape.tolist())
    return " ".join(f"{abs(part):.3f}@{degrees(phase(part)):.0f}°" for part in mode.shape.tolist())
