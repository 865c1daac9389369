"""Numbers with their errors and units, as a person reads them."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, isfinite, log10

from logger.vehicle.effect import Chosen

_UNITS = {
    "n_s2_per_m2": "N s2/m2", "n_s_per_m": "N s/m", "n_per_m3": "N/m3", "n_per_m": "N/m", "m_per_s": "m/s",
    "kg_m2": "kg m2", "n": "N", "kg": "kg", "hz": "Hz", "m": "m", "s": "s",
}
_LARGE, _SMALL = 1e6, 1e-3
_RARE = 1e-9


def unit_of(name: str) -> str:
    """The unit that a name ends in; nothing for a ratio."""
    return next((unit for ending, unit in _UNITS.items() if name.endswith(f"_{ending}")), "")


def measured(value: float, error: float | None) -> str:
    """A value with its standard error, in no more digits than it deserves: ``85 ± 4``, ``1.61e6 ± 0.04e6``."""
    if error is None or not isfinite(error) or not error > 0 or not isfinite(value):
        return f"{value:.3g}"
    decimals = 1 - floor(log10(error)) - (error / 10.0 ** floor(log10(error)) >= 2)
    size = max(abs(value), error)
    if _SMALL <= size < _LARGE:
        return " ± ".join(f"{round(one, decimals):.{max(decimals, 0)}f}" for one in (value, error))
    power = floor(log10(size))
    return " ± ".join(f"{one / 10.0**power:.{max(decimals + power, 0)}f}e{power}" for one in (value, error))


def numbers_of(one: Chosen) -> str:
    """The numbers of an effect: ``friction_force_n 85 ± 4 N``; nothing for one that has none."""
    return ", ".join(f"{name} {_with_unit(value, one.standard_errors, name)}" for name, value in one.values.items())


def _with_unit(value: float, errors: Mapping[str, float], name: str) -> str:
    return f"{measured(value, errors.get(name))} {unit_of(name)}".rstrip()


def chance(p_value: float) -> str:
    """How probable, for a sentence."""
    if p_value < _RARE:
        return "below 1e-9"
    return f"{p_value:.2g}" if p_value < 0.1 else f"{p_value:.0%}"


def finite(errors: Mapping[str, float]) -> dict[str, float]:
    """Those standard errors that are known."""
    return {name: error for name, error in errors.items() if isfinite(error)}
