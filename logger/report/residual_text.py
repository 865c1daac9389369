"""What the residual of a model looks like, in sentences: what each test says when it finds something."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from logger.lab.residuals.breakdown import Part
from logger.lab.residuals.force_state_map import Curve
from logger.lab.residuals.residual_tests import ResidualTest
from logger.lab.residuals.unexplained import Shape, SpatialLine
from logger.report.quantities import percent

_MUCH_DRIFT_M = 0.3
_WHEEL_RADII_M = (0.22, 0.5)
_AROUND = {
    "below body bounce": "below the body's bounce",
    "body bounce": "around the body's bounce",
    "between": "between body bounce and wheel hop",
    "wheel hop": "around the wheels' hop",
    "above wheel hop": "above the wheels' hop",
    "far above wheel hop": "far above the wheels' hop",
    "beyond the recorder's filter": "beyond the recorder's filter",
}


def sentence(test: ResidualTest) -> str:
    """What a test says when it finds something."""
    return _SENTENCES[test.name](test, **test.figures)


def looks_like(shape: Shape) -> list[str]:
    """What a residual that no candidate explains looks like."""
    turns = [line_sentence(shape.line)] if shape.line is not None and shape.line.found else []
    found = turns + [sentence(test) for test in shape.tests.found]
    return found or ["No test says more: it is spread over all frequencies, speeds and places."]


def line_sentence(line: SpatialLine) -> str:
    """What repeats along the way, and what may do so."""
    every_m = 1 / line.at_per_m
    if line.steady:
        return (f"It repeats every {every_m:.2f} m of the way or {line.at_per_m * line.speed_mps:.1f} times a second: "
                f"at a steady speed that is the same (clearest in {line.run}). A drive at another speed would show "
                "which.")
    radius_m = 1 / (2 * np.pi * line.at_per_m)
    wheel = (f" A wheel of {radius_m:.2f} m radius turns at that rate: look at its balance and roundness."
             if _WHEEL_RADII_M[0] < radius_m < _WHEEL_RADII_M[1] else "")
    return f"It repeats every {every_m:.2f} m of the way, at any speed (clearest in {line.run}).{wheel}"


def error_text(part: Part, digits: int) -> str:
    """The error of a part with so many digits behind the point; a dash where there is none."""
    return f"{part.error:.{digits}f}" if np.isfinite(part.error) else "-"


def paired(before: Sequence[Part], after: Sequence[Part]) -> list[tuple[Part | None, Part]]:
    """Parts with those of another model of the same runs: bands by their names, as a car's own vibrations move with its
    numbers; others by their ends. None where there is no such part."""
    known = {one.name or (one.low, one.high): one for one in before}
    return [(known.get(one.name or (one.low, one.high)), one) for one in after]


# --- the residual by itself ---


def _whiteness(test: ResidualTest, lag_s: float) -> str:
    return (f"The residual is not white: samples {lag_s * 1000:.0f} ms apart have a correlation of {test.value:.2f}.")


def _frequency(test: ResidualTest, part: Part, white_share: float) -> str:
    return (f"{percent(test.value)} of the residual's power lies {_AROUND[part.name]} ({part.low:.2g} to "
            f"{part.high:.2g} Hz), where white noise would have {percent(white_share)}; the error there is "
            f"{error_text(part, 2)}.")


def _lean(test: ResidualTest) -> str:
    way = "up" if test.value > 0 else "down"
    return (f"The residual has its sharp peaks {way}ward (skewness {test.value:.1f}): something pushes the body {way} "
            "in short blows.")


def _tone(test: ResidualTest, run: str) -> str:
    return (f"A single frequency stands out in the residual: {test.value:.1f} Hz, in {run}. Something hums or rings "
            "there.")


# --- the residual and the road ---


def _coherence(test: ResidualTest, band: str) -> str:
    return (f"At least {percent(test.value)} of the residual is coherent with the road, most of it {_AROUND[band]}. "
            "This part is not noise; a linear effect could cause it.")


def _gain(test: ResidualTest) -> str:
    return (f"Where both agree in shape, the measurement is {test.value:.3g} times the model (standard error "
            f"{test.standard_error:.1g}).")


def _shift(test: ResidualTest, time_s: float, length_m: float, is_time: bool | None) -> str:
    as_time, as_length = f"{abs(time_s) * 1000:.0f} ms", f"{abs(length_m):.2f} m"
    if not np.isfinite(length_m):  # a rig has no speed
        words = f"{as_time} all along"
    elif is_time is None:
        words = f"about {as_time} or {as_length}; drives at other speeds would show which"
    else:
        words = f"{as_time if is_time else f'{as_length} of road'}, at any speed"
    return f"The measurement {'lags' if time_s > 0 else 'leads'} the model by {words}."


def _drift(test: ResidualTest, in_all_m: float) -> str:
    more = " All other findings may come from that alone." if in_all_m > _MUCH_DRIFT_M else ""
    return (f"The model runs {'ahead' if test.value > 0 else 'behind'} by {abs(test.value) * 100:.2g} m in each 100 m "
            f"of the way, {in_all_m:.2g} m in the longest run: the recorded speed has a scale error.{more}")


def _proportion(test: ResidualTest, weak: float, strong: float, band: str) -> str:
    return (f"The response is not proportional to the road: {_AROUND[band]} the measurement is {weak:.2f} of the model "
            f"at small motion and {strong:.2f} at large motion.")


# --- the residual and the suspensions ---


def _by_rate(test: ResidualTest, curve: Curve, bend: float) -> str:
    both = f"like a damper that {'yields at speed' if bend < 0 else 'stiffens with speed'}"
    return (f"A force in the suspensions that depends on their velocity, {_side(curve, both)}, would explain "
            f"{percent(curve.share)} of the residual. In addition to linear dampers: {_ends(curve, 1, 'm/s')}.")


def _by_travel(test: ResidualTest, curve: Curve, bend: float) -> str:
    both = f"like a spring that {'softens' if bend < 0 else 'hardens'} far from its rest"
    return (f"A force in the suspensions that depends on their travel, {_side(curve, both)}, would explain "
            f"{percent(curve.share)} of the residual. In addition to linear springs: {_ends(curve, 1000, 'mm')}.")


def _side(curve: Curve, both: str) -> str:
    """On which side a curve acts; ``both``: what to say where it acts on both in opposite directions."""
    low, high = abs(float(curve.force_n[0])), abs(float(curve.force_n[-1]))
    if min(low, high) < max(low, high) / 3:
        return f"mostly in {'compression' if low > high else 'extension'}"
    return both if curve.force_n[0] * curve.force_n[-1] < 0 else "in the same direction in compression and extension"


def _ends(curve: Curve, factor: float, unit: str) -> str:
    """What a curve does to body and wheel at both its ends."""
    words = []
    for index, side in ((0, "compression"), (-1, "extension")):
        force, error = float(curve.force_n[index]), float(curve.error_n[index])
        size = f"{force:+.0f} ± {error:.0f} N" if abs(force) > 2 * error else "about zero"
        words.append(f"{size} at {abs(curve.at[index]) * factor:.2g} {unit} of {side}")
    return f"{' and '.join(words)} (positive pulls body and wheel together)"


def _direction(test: ResidualTest, share: float, damping: float) -> str:
    more, less = ("rebound", "bump") if test.value > 0 else ("bump", "rebound")
    ratio = f", by {percent(2 * abs(test.value) / damping)} of the model's damping" if damping > 0 else ""
    return (f"The residual depends on the direction: the suspensions seem to resist {more} more than {less}{ratio} "
            f"(this would explain {percent(share)}).")


# --- the residual and the drive ---


def _excitation(test: ResidualTest, low: Part, high: Part) -> str:
    return (f"The residual {'grows' if test.value > 0 else 'shrinks'} as the road moves the car more: "
            f"{low.residual_mps2:.2g} m/s2 where the model has up to {low.high:.2g} m/s2, {high.residual_mps2:.2g} "
            f"where it has {high.low:.2g} and more.")


def _speed(test: ResidualTest, slow_mps: float, fast_mps: float) -> str:
    return (f"On stretches with the same motion of the car, the residual is {test.value:.1f} times as large at "
            f"{fast_mps:.0f} m/s as at {slow_mps:.0f} m/s.")


def _place(test: ResidualTest, worst: Sequence[Part], usual_mps2: float, names: Mapping[str, str]) -> str:
    named = "; ".join(f"{names[part.name]}, {part.low:g} to {part.high:g} m ({part.residual_mps2 / usual_mps2:.1f} "
                      "times)" for part in worst)
    return f"At some places the residual is much larger than usual: {named}."


_SENTENCES: Mapping[str, Callable[..., str]] = {
    "whiteness": _whiteness, "frequency": _frequency, "lean": _lean, "tone": _tone, "coherence": _coherence,
    "gain": _gain, "shift": _shift, "drift": _drift, "proportion": _proportion, "force by rate": _by_rate,
    "force by travel": _by_travel, "direction": _direction, "excitation": _excitation, "speed": _speed,
    "place": _place,
}
