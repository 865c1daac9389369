"""Drafts of laws that are curves: a power of what moves, or a smooth curve through points.

A power has two numbers, and holds what physics books have: the square of a damper's rate, the cube of a spring's
travel. The curve is free. Its smoothness is its prior: it goes through few points, at rest and where the runs' motions
lie, monotone between them (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984), and each of them counts.
Beyond the motions of the runs curves stay what they are there: nothing is known of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import rounded
from logger.vehicle.effect import Parameter, Scale

_HANDED_ON = {"rate": "with_force(lambda travel_m, rate_mps: force_n(p, rate_mps))",
              "travel": "with_spring(lambda travel_m: force_n(p, travel_m))",
              "deflection": "with_tire(lambda deflection_m: force_n(p, deflection_m))"}
_STRONGEST = 100.0
_SLOPE_STEP = 0.02


def _strength(name: str, size_n: float, meaning: str, trials: Sequence[float] = (0.1, -0.1)) -> Parameter:
    size_n = rounded(size_n)
    return Parameter(name, trials[0] * size_n, -_STRONGEST * size_n, _STRONGEST * size_n, 0.0, Scale.LINEAR,
                     tuple(one * size_n for one in trials), meaning, step=_SLOPE_STEP * size_n)


def _draft(at: str, parameters: Sequence[Parameter], functions: str, title: str, variant: str, reference: float,
           imports: tuple[str, ...] = (), **common: Any) -> Draft:
    return Draft(kind="ForceEffect", title=title, parameters=tuple(parameters), at=at, functions=functions,
                 method=f"def laws(self, p, laws):\n    return laws.{_HANDED_ON[at]}", imports=imports,
                 variant=variant, reference=reference, **common)


def power_curve(unit: str, reference: float, reach: float, size_n: float, powers: Sequence[float],
                ends: tuple[float, float], *, at: str, **common: Any) -> Draft:
    """A force that grows with a power of what moves, alike both ways.

    reference    where the force is what its number says; ``reach``: beyond it stays as it is there
    size_n       of the usual force there
    powers       to be tried; ``ends``: what they may be
    """
    functions = f"""
def force_n(p, at):
    size = np.minimum(np.abs(at), {rounded(reach)!r}) / {reference!r}
    return p.force_n * np.sign(at) * size**p.power_ratio
"""
    parameters = [_strength("force_n", size_n, f"at {reference:g} {_UNITS[unit]}"),
                  Parameter("power_ratio", powers[0], *ends, None, Scale.LOG, tuple(powers), "exponent")]
    return _draft(at, parameters, functions, f"a force that grows with a power of the {_NAMES[at]}", "power", reference,
                  **common)


def free_curve(unit: str, knots: Sequence[float], size_n: float, *, at: str, **common: Any) -> Draft:
    """A force that follows a smooth curve through points on either side of rest.

    knots     where these points are, on either side
    size_n    of the usual force
    """
    places = sorted({sign * rounded(one) for one in knots for sign in (-1, 1)})
    names = [f"force_{number}_n" for number in range(1, len(places) + 1)]
    functions = f"""
AT = np.array([{', '.join(repr(one) for one in _with_rest(places))}])


def force_n(p, at):
    through = np.array([{', '.join(f'p.{name}' if name else '0.0' for name in _with_rest_named(places, names))}])
    return PchipInterpolator(AT, through)(np.clip(at, AT[0], AT[-1]))
"""
    parameters = [_strength(name, size_n, f"at {one:g} {_UNITS[unit]}", (0.1,))
                  for one, name in zip(places, names, strict=True)]
    return _draft(at, parameters, functions, f"a force that follows a curve of the {_NAMES[at]}", "curve", places[-1],
                  ("from scipy.interpolate import PchipInterpolator",), **common)


def _with_rest(places: Sequence[float]) -> list[float]:
    return sorted([*places, 0.0])


def _with_rest_named(places: Sequence[float], names: Sequence[str]) -> list[str]:
    named = dict(zip(places, names, strict=True))
    return [named.get(one, "") for one in _with_rest(places)]


_UNITS = {"mps": "m/s", "m": "m"}
_NAMES = {"rate": "rate", "travel": "travel", "deflection": "tire's deflection"}
