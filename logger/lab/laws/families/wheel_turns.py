"""A force at the wheels that comes round with their turns: imbalance, a flat spot, a tire out of round.

A mass m that turns at a distance r from the axle pulls with m r (v / R)^2, R the tire's radius (J. P. Den Hartog,
Mechanical Vibrations, 1956, section 6.1); a tire that is out of round pushes alike, and its harmonics are as the tire's
radius is divided. Where a wheel stood when the recording began nobody knows: each axle has two strengths, in all runs
alike where their ways go on, or in each run two of its own.
"""

from collections.abc import Sequence

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
from logger.lab.laws.repeating import ALL_ALIKE, BEGINS, EACH, each_run, of_run, spatial_frequency
from logger.vehicle.effect import Chosen, Parameter, Scale

_FUNCTIONS = """
def turning(p, seen):
    turned = seen.distance_m / p.turn_radius_m
    cos_kg_m = {cos}
    sin_kg_m = {sin}
    return (cos_kg_m * np.cos(turned) + sin_kg_m * np.sin(turned)) * (seen.speed_mps / p.turn_radius_m) ** 2
"""
_METHOD = """def laws(self, p, laws):
{pick}
    return laws.with_law(Between.WHEEL_AND_GROUND, turning, own)
"""
_USUAL_KG_M = 0.02
"""A hundred grams on a rim of 0.2 m."""
_RADII_M = (0.1, 0.5)


class WheelTurns(Family):
    title = "a force that repeats with each turn of the wheels"
    source = "a rotating imbalance (J. P. Den Hartog, Mechanical Vibrations, 1956, section 6.1)"
    signature = "it repeats along the road, whatever the speed, and grows with the square of the speed"
    shown_by = "drive a smooth road at two steady speeds"
    by_axle = False
    stands_out = True

    def drafts(self, context: LawContext) -> list[Draft]:
        if not context.is_driven:
            return []
        per_m = spatial_frequency(context, (1 / (2 * np.pi * _RADII_M[1]), 1 / (2 * np.pi * _RADII_M[0])),
                                  speed_power=2)
        if per_m is None:
            return []
        radius_m = 1 / (2 * np.pi * per_m)
        return [self._draft(context.axles or ("",), runs, radius_m, variant)
                for runs, variant in ((ALL_ALIKE, "imbalance"), (each_run(context), f"imbalance{EACH}")) if runs]

    def _draft(self, axles: Sequence[str], runs: Sequence[str], radius_m: float, variant: str) -> Draft:
        strengths = [
            Parameter(_name(axle, part, run), _USUAL_KG_M, -100 * _USUAL_KG_M, 100 * _USUAL_KG_M, 0.0,
                      Scale.LINEAR, (_USUAL_KG_M,),
                      f"mass times distance from the {axle or 'wheel'} axle, {words}{of_run(run)}",
                      step=0.1 * _USUAL_KG_M)
            for axle in axles for run in runs
            for part, words in (("cos", "downward at distance 0"), ("sin", "a quarter turn later"))]
        radius = Parameter("turn_radius_m", radius_m, *_RADII_M, None, Scale.LOG, (radius_m,),
                           "of a wheel that turns once per period of the force", step=1e-5)
        functions = _FUNCTIONS.format(cos=_of_run("cos", runs), sin=_of_run("sin", runs))
        return self.draft((*strengths, radius), _METHOD.format(pick=_pick(axles, runs)), functions, variant=variant,
                          words=("needs_road = True",))

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        axles = ("front", "rear") if any(name.startswith("front") for name in found.values) else ("",)
        each_m, radius = 2 * np.pi * found.values["turn_radius_m"], say("turn_radius_m")
        if draft.variant.endswith(EACH):
            sizes = " and ".join(f"{_size(found, axle):.2g} kg m{f' at the {axle}' * bool(axle)}" for axle in axles)
            parts = f"(mean of the runs) by {sizes}{BEGINS}"
        else:
            parts = "(cosine and sine part) by " + " and ".join(
                f"{say(_name(axle, 'cos'))} and {say(_name(axle, 'sin'))}{f' at the {axle}' * bool(axle)}"
                for axle in axles)
        return (f"a force that repeats every {each_m:.2f} m of road, as a wheel of {radius} turns, and grows with the "
                f"square of the speed: out of balance {parts}")


def _name(axle: str, part: str, run: str = "") -> str:
    return "_".join(filter(None, (axle, part, run, "kg_m")))


def _size(found: Chosen, axle: str) -> float:
    parts = [value for name, value in found.values.items() if name.startswith(axle) and name.endswith("_kg_m")]
    return float(np.linalg.norm(parts) / np.sqrt(0.5 * len(parts)))


def _of_run(part: str, runs: Sequence[str]) -> str:
    """The strength of the run that is looked at, of the last one in what comes after it."""
    terms = [f"p.{_name('', part, run)} * (seen.run {'>=' if place == len(runs) - 1 else '=='} {place})"
             for place, run in enumerate(runs)]
    if len(runs) == 1:
        return f"p.{_name('', part, runs[0])}"
    return "(\n        " + "\n        + ".join(terms) + "\n    )"


def _pick(axles: Sequence[str], runs: Sequence[str]) -> str:
    """The lines that choose the numbers of an axle."""
    names = [_name("", part, run) for run in runs for part in ("cos", "sin")]

    def own(axle: str) -> str:
        lines = [f"        {name}=p.{f'{axle}_' * bool(axle)}{name},\n" for name in names]
        return f"SimpleNamespace(\n{''.join(lines)}        turn_radius_m=p.turn_radius_m)"

    if len(axles) == 1:
        return f"    own = {own(axles[0])}"
    rear = own("rear").replace("\n", "\n    ")
    return f"    own = {own('front')}\n    if laws.rear:\n        own = {rear}"


FAMILY = WheelTurns()
