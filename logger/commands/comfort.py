"""How a recorded ride feels and what it does to health: ISO 2631-1 values of an acceleration record.

FILE is CSV with the columns t_s and accel_z_mps2 (vertical, at the seat), evenly sampled at 80 Hz or more, perhaps
accel_x_mps2 and accel_y_mps2 as well. Its mean is taken off. The weighting is the standard's formula, magnitude and
phase, applied to the whole record by Fourier transform.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import EXIT_DONE, BadInput

if TYPE_CHECKING:
    from logger.comfort.exposure import CautionZone
    from logger.comfort.iso2631 import AxisFigures
    from logger.dsp.weightings.weighting import Weighting
    from logger.store.formats.record_file import AccelerationRecord

LOWEST_RATE_HZ = 80.0
# Rounded times make an 80 Hz record look a little slower.
RATE_ROUNDING = 1e-3
SHORTEST_S = 1.0
METHOD = "formula of the standard, magnitude and phase, by Fourier transform of the whole record"

USUAL = "wk"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="CSV with t_s,accel_z_mps2[,accel_x_mps2,accel_y_mps2]")
    parser.add_argument("--weighting", default=USUAL, metavar="NAME",
                        help="weighting of accel_z_mps2: wk (default), wd, wf, wc, we, wj or wb. With wk, accel_x_mps2 "
                             "and accel_y_mps2 are weighted by wd and combined with it")
    parser.add_argument("--daily-hours", type=float, metavar="H",
                        help="hours a day of such riding, for the health values (default: the length of the record)")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog comfort``."""
    from logger.plugins import catalogue
    from logger.store.formats.record_file import read_record

    weightings = catalogue("logger.dsp.weightings", "WEIGHTING")
    if args.weighting not in weightings:
        raise BadInput(f"--weighting: expected one of {', '.join(weightings)}, found {args.weighting!r}")
    if args.daily_hours is not None and not 0.0 < args.daily_hours <= 24.0:
        raise BadInput(f"--daily-hours: expected more than 0 and at most 24 hours, found {args.daily_hours:g}")
    record = read_record(args.file)
    _check(record, str(args.file))
    weighting = weightings[args.weighting]
    result = measure(record, weighting, weightings.get(weighting.horizontal), args.daily_hours)
    if args.json:
        print(json.dumps(as_json(result), allow_nan=False))
    else:
        print("\n".join(screen(result, args.file.name)))
    return EXIT_DONE


def _check(record: AccelerationRecord, file: str) -> None:
    if record.rate_hz < LOWEST_RATE_HZ * (1.0 - RATE_ROUNDING):
        raise BadInput(f"{file}: expected at least {LOWEST_RATE_HZ:g} samples a second, found {record.rate_hz:.4g}")
    if record.duration_s < SHORTEST_S:
        raise BadInput(f"{file}: expected at least {SHORTEST_S:g} s, found {record.duration_s:.3g} s")


@dataclass(frozen=True)
class Measured:
    """Figures by axis, and what each was weighted by: ``z`` always, ``x`` and ``y`` where all three are combined."""

    rate_hz: float
    daily_hours: float
    axes: dict[str, AxisFigures]
    by: dict[str, Weighting]
    left_out: bool

    @property
    def weighting(self) -> Weighting:
        return self.by["z"]

    @property
    def vertical(self) -> AxisFigures:
        return self.axes["z"]

    @property
    def health_factors(self) -> dict[str, float]:
        """By axis (ISO 2631-1 clause 7.2.3); empty where the weighting is none of health."""
        if self.weighting.health_factor is None:
            return {}
        return {axis: k for axis in "xyz" if axis in self.by and (k := self.by[axis].health_factor) is not None}

    @property
    def unseen_from_hz(self) -> float | None:
        """Where the record ends and the weighting does not [Hz]; None when the record holds all that counts."""
        return self.rate_hz / 2 if self.rate_hz / 2 < self.weighting.counts_up_to_hz else None


def measure(
    record: AccelerationRecord, weighting: Weighting, horizontal: Weighting | None, daily_hours: float | None
) -> Measured:
    """Weigh the axes of a record that belong together and take their figures."""
    from logger.comfort.iso2631 import axis_figures

    axes = {"z": axis_figures(weighting.weigh(record.accel_z_mps2, record.rate_hz), record.rate_hz)}
    others = {"x": record.accel_x_mps2, "y": record.accel_y_mps2}
    measured = {axis: accel for axis, accel in others.items() if accel is not None}
    by = {"z": weighting}
    combined = horizontal is not None and len(measured) == len(others)
    if horizontal is not None and combined:
        for axis, accel in measured.items():
            axes[axis] = axis_figures(horizontal.weigh(accel, record.rate_hz), record.rate_hz)
            by[axis] = horizontal
    hours = daily_hours if daily_hours is not None else record.duration_s / 3600.0
    return Measured(record.rate_hz, hours, axes, by, left_out=bool(measured) and not combined)


def as_json(result: Measured) -> dict[str, Any]:
    """The agreed fields of the vertical axis first, then what else there is; null where there is no such value."""
    vertical = _axis_json(result.vertical)
    first = ("a_w_mps2", "mtvv_mps2", "vdv_mps175", "crest_factor")
    agreed = {"weighting": result.weighting.name, **{name: vertical.pop(name) for name in first},
              "comfort": _word(result, result.vertical.a_w_mps2)}
    more = {"rate_hz": result.rate_hz, "duration_s": result.vertical.duration_s, **vertical,
            "method": METHOD, "unseen_from_hz": result.unseen_from_hz}
    if result.weighting.is_sickness:
        more["msdv_mps15"] = _sickness_dose(result.vertical)
        more["report_beside_a_w"] = ["msdv"]
    if len(result.axes) > 1:
        more |= {"axes": {axis: _axis_json(result.axes[axis]) for axis in "xyz"}, **_totals(result)}
    return agreed | more | {"health": _health(result)}


def _axis_json(figures: AxisFigures) -> dict[str, Any]:
    return {
        "a_w_mps2": figures.a_w_mps2,
        "mtvv_mps2": figures.mtvv_mps2,
        "mtvv_exponential_mps2": figures.mtvv_exponential_mps2,
        "vdv_mps175": figures.vdv_mps175,
        "crest_factor": _known(figures.crest_factor),
        "mtvv_ratio": _known(figures.mtvv_ratio),
        "vdv_ratio": _known(figures.vdv_ratio),
        "report_beside_a_w": list(figures.beside_a_w()),
    }


def _known(value: float) -> float | None:
    return value if isfinite(value) else None


def _word(result: Measured, a_w_mps2: float) -> str | None:
    """Table 2.5 has no words for motion sickness."""
    from logger.comfort.iso2631 import comfort_word

    return None if result.weighting.is_sickness else comfort_word(a_w_mps2)


def _sickness_dose(figures: AxisFigures) -> float:
    from logger.comfort.iso2631 import motion_sickness_dose

    return motion_sickness_dose(figures.a_w_mps2, figures.duration_s)


def _totals(result: Measured) -> dict[str, Any]:
    """All three axes in one: for comfort with its word, and for health."""
    from logger.comfort.iso2631 import COMFORT_FACTORS, HEALTH_FACTORS, total

    a_w_mps2 = [result.axes[axis].a_w_mps2 for axis in "xyz"]
    comfort_mps2 = total(a_w_mps2, COMFORT_FACTORS)
    return {"total_a_w_mps2": comfort_mps2, "total_comfort": _word(result, comfort_mps2),
            "health_total_a_w_mps2": total(a_w_mps2, HEALTH_FACTORS)}


def _health(result: Measured) -> dict[str, Any] | None:
    """Daily exposure by the worst axis, and where it stands; None where the weighting is none of health."""
    from logger.comfort import exposure

    factors = result.health_factors
    if not factors:
        return None
    hours, seconds = result.daily_hours, result.vertical.duration_s
    a_w_mps2, a_w_axis = max((k * result.axes[axis].a_w_mps2, axis) for axis, k in factors.items())
    vdv, vdv_axis = max((k * result.axes[axis].vdv_mps175, axis) for axis, k in factors.items())
    a8_mps2, dose = exposure.a8(a_w_mps2, hours), exposure.daily_vdv(vdv, seconds, hours)
    a8_at, vdv_at = exposure.A8_MPS2, exposure.VDV_MPS175
    return {
        "daily_hours": hours,
        "a8_mps2": a8_mps2, "a8_axis": a_w_axis, "a8_verdict": a8_at.verdict(a8_mps2),
        "hours_to_a8_action": _known(exposure.hours_to_a8(a_w_mps2, a8_at.action)),
        "hours_to_a8_limit": _known(exposure.hours_to_a8(a_w_mps2, a8_at.limit)),
        "daily_vdv_mps175": dose, "vdv_axis": vdv_axis, "vdv_verdict": vdv_at.verdict(dose),
        "hours_to_vdv_action": _known(exposure.hours_to_vdv(vdv, seconds, vdv_at.action)),
        "hours_to_vdv_limit": _known(exposure.hours_to_vdv(vdv, seconds, vdv_at.limit)),
        "caution_zone": {
            "n2": _zone(exposure.caution_zone(hours, 2), a_w_mps2, "mps2"),
            "n4": _zone(exposure.caution_zone(hours, 4), a_w_mps2, "mps2"),
            "vdv": _zone(exposure.CAUTION_ZONE_VDV_MPS175, dose, "mps175"),
        },
    }


def _zone(zone: CautionZone, value: float, unit: str) -> dict[str, Any]:
    return {f"lower_{unit}": zone.lower, f"upper_{unit}": zone.upper, "verdict": zone.verdict(value)}


def screen(result: Measured, name: str) -> list[str]:
    """The lines a person sees; ``name`` is that of the file."""
    lines = [f"{name}: {result.vertical.duration_s:.1f} s at {result.rate_hz:.6g} Hz, "
             f"weighting {result.weighting.name.capitalize()}", ""]
    heads = ("axis", "a_w m/s2", "MTVV m/s2", "VDV m/s1.75", "crest", "MTVV/a_w", "VDV/a_wT^1/4")
    lines.append(f"{heads[0]:5}" + "".join(f"{head:>13}" for head in heads[1:]))
    for axis in sorted(result.axes):
        figures = result.axes[axis]
        values = (figures.a_w_mps2, figures.mtvv_mps2, figures.vdv_mps175, figures.crest_factor, figures.mtvv_ratio,
                  figures.vdv_ratio)
        lines.append(f"{axis:5}" + "".join(f"{value:13.3f}" for value in values))
    exponential = ", ".join(f"{result.axes[axis].mtvv_exponential_mps2:.3f}" for axis in sorted(result.axes))
    lines += [f"MTVV with exponential averaging: {exponential} m/s2", "", *_conclusions(result), "",
              f"Method: {METHOD}; the mean is taken off."]
    if result.unseen_from_hz is not None:
        lines.append(f"The record cannot show what lies above {result.unseen_from_hz:.4g} Hz. The standard counts it "
                     f"up to {result.weighting.counts_up_to_hz:g} Hz: the values are of what was recorded.")
    if result.left_out:
        lines.append(f"Other axes are combined only with {USUAL.capitalize()}, x and y together; left out.")
    return lines


def _conclusions(result: Measured) -> list[str]:
    """What the figures come to: how it feels, which of them to use, what it does to health."""
    lines = []
    if result.weighting.is_sickness:
        lines.append(f"Motion sickness dose: {_sickness_dose(result.vertical):.3f} m/s1.5.")
    elif len(result.axes) > 1:
        totals = _totals(result)
        lines.append(f"Feels {_spoken(totals['total_comfort'])}: {totals['total_a_w_mps2']:.3f} m/s2 over three axes.")
    else:
        lines.append(f"Feels {_spoken(_word(result, result.vertical.a_w_mps2))}.")
    if not result.weighting.is_sickness:
        lines.append(_which_to_use(result))
    health = _health(result)
    if health is None:
        return [*lines, f"Health: {result.weighting.name.capitalize()} is not a weighting of health."]
    n2, n4, dose = (health["caution_zone"][name] for name in ("n2", "n4", "vdv"))
    return [
        *lines,
        f"Health, {health['daily_hours']:.3g} h a day like this:",
        f"  A(8) {health['a8_mps2']:.3f} m/s2 ({health['a8_axis']}), {_spoken(health['a8_verdict'])}"
        f"{_from_hours(health['hours_to_a8_action'])}",
        f"  VDV {health['daily_vdv_mps175']:.2f} m/s1.75 ({health['vdv_axis']}), {_spoken(health['vdv_verdict'])}"
        f"{_from_hours(health['hours_to_vdv_action'])}",
        f"  Caution zone: {_spoken(n2['verdict'])} ({n2['lower_mps2']:.2f} to {n2['upper_mps2']:.2f} m/s2) for "
        f"n = 2, {_spoken(n4['verdict'])} ({n4['lower_mps2']:.2f} to {n4['upper_mps2']:.2f}) for n = 4, "
        f"{_spoken(dose['verdict'])} by VDV",
    ]


def _which_to_use(result: Measured) -> str:
    wanted = {axis: figures.beside_a_w() for axis, figures in sorted(result.axes.items()) if figures.beside_a_w()}
    if not wanted:
        return "a_w is enough: no crest factor above 9, no ratio above 1.5 or 1.75."
    which = "; ".join(f"{axis}: {' and '.join(name.upper() for name in names)}" for axis, names in wanted.items())
    return f"a_w alone understates it, there are shocks. Report beside it {which}."


def _spoken(word: str | None) -> str:
    return (word or "").replace("_", " ")


def _from_hours(hours: float | None) -> str:
    if hours is None or hours > 24.0:
        return "; not reached in a day"
    return f"; action value reached after {hours:.3g} h"
