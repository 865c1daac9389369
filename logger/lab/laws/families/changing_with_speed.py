"""Dampers, springs or tires that change with the driving speed: adaptive dampers that grow firm, air springs that
stiffen as they are lowered, tires that spin.

A stiffness k that was taken for fixed is k + d (v / v0 - 1) at the speed v, with v0 the mean speed of the runs. Dampers
change by a share of what each axle has, as a controller sets all of them alike: so that they have what the vehicle's
file says at v0, or at whatever speed that was measured. Beyond the speeds that the runs had it stays what it was at
their ends, for nothing is known there. Adaptive dampers: S. M. Savaresi et al., Semi-Active Suspension Control Design
for Vehicles (2010), chapter 2; a tire that spins: H. B. Pacejka, Tire and Vehicle Dynamics (2012), chapter 9.
"""

import numpy as np

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, handed_on, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_STIFFNESS = """
def changed(p, seen):
    speed_mps = np.minimum(np.maximum(seen.speed_mps, {slowest!r}), {fastest!r})
    return p.changed_n_per_m * (speed_mps / {mean!r} - 1.0) * seen.{motion}
"""
_DAMPING = """
def changed(p, seen):
    faster = np.minimum(np.maximum((seen.speed_mps - {slowest!r}) / ({fastest!r} - {slowest!r}), 0.0), 1.0)
    return (p.slowest_n_s_per_m * (1.0 - faster) + p.fastest_n_s_per_m * faster) * seen.rate_mps
"""
_DAMPING_METHOD = """def laws(self, p, laws):
    own = SimpleNamespace(slowest_n_s_per_m={slowest} * laws.damping_n_s_per_m,
                          fastest_n_s_per_m={fastest} * laws.damping_n_s_per_m)
    return laws.with_law(Between.BODY_AND_WHEEL, changed, own)
"""
_TRIED = 0.2  # of the damping or stiffness, at twice the mean speed or at an end of the speeds
_MOST_LOST = 0.9  # of it, at either end of the speeds
_OF = {"springs": ("suspension_stiffness_n_per_m", "travel_m", "BODY_AND_WHEEL"),
       "tires": ("tire_stiffness_n_per_m", "deflection_m", "WHEEL_AND_GROUND")}
_DAMPERS = "dampers whose damping changes with the driving speed"


class ChangingWithSpeed(Family):
    title = "damping or stiffness that changes with driving speed"
    signature = "runs at different speeds need different parameters of one car"
    shown_by = "drive one road slowly and fast"

    def drafts(self, context: LawContext) -> list[Draft]:
        if not context.is_driven:
            return []
        speed_mps = np.concatenate([run.speed_mps[run.first:] for run in context.runs])
        ends_and_mean = speed_mps.min(), speed_mps.mean(), speed_mps.max()
        slowest, mean, fastest = (rounded(float(one), digits=3) for one in ends_and_mean)
        if not slowest < mean < fastest:
            return []
        axles = [one for one in (context.vehicle.front, context.vehicle.rear) if one is not None]
        stiffnesses = [self._stiffness(of, min(getattr(axle, _OF[of][0]) for axle in axles), (slowest, mean, fastest))
                       for of in _OF]
        return [self._dampers((slowest, mean, fastest)), self._dampers_at_ends((slowest, mean, fastest)), *stiffnesses]

    def _dampers(self, speeds_mps: tuple[float, float, float]) -> Draft:
        slowest, mean, fastest = speeds_mps
        low, high = _ends(speeds_mps)
        share = Parameter("changed_ratio", _TRIED, rounded(low), rounded(high), 0.0, Scale.LINEAR, (_TRIED, -_TRIED),
                          f"share by which the damping is larger at {2 * mean:g} m/s than at {mean:g} m/s", step=0.02)
        at_slowest, at_fastest = (f"p.changed_ratio * {rounded(one / mean - 1, digits=4)!r}"
                                  for one in (slowest, fastest))
        return self._draft(_DAMPERS, "dampers", (share,), _DAMPING.format(slowest=slowest, fastest=fastest),
                           _DAMPING_METHOD.format(slowest=at_slowest, fastest=at_fastest))

    def _dampers_at_ends(self, speeds_mps: tuple[float, float, float]) -> Draft:
        """Dampers that have what the file says at a speed that nobody knows."""
        slowest, _, fastest = speeds_mps
        shares = tuple(
            Parameter(name, _TRIED, -_MOST_LOST, 9.0, 0.0, Scale.LINEAR, (_TRIED,),
                      f"share by which the damping is larger at {there:g} m/s than the vehicle's file says", step=0.02)
            for name, there in (("slowest_ratio", slowest), ("fastest_ratio", fastest)))
        return self._draft(_DAMPERS, "dampers at both ends", shares, _DAMPING.format(slowest=slowest, fastest=fastest),
                           _DAMPING_METHOD.format(slowest="p.slowest_ratio", fastest="p.fastest_ratio"),
                           places=(slowest, fastest))

    def _stiffness(self, of: str, softer: float, speeds_mps: tuple[float, float, float]) -> Draft:
        """Of what the softer axle has: no axle may be left without it at any speed."""
        _, motion, between = _OF[of]
        slowest, mean, fastest = speeds_mps
        size = rounded(_TRIED * softer)
        low, high = (softer * one for one in _ends(speeds_mps))
        parameter = Parameter("changed_n_per_m", size, rounded(low), rounded(high), 0.0, Scale.LINEAR, (size, -size),
                              f"by which the stiffness of the {of} is larger at {2 * mean:g} m/s than at {mean:g} m/s",
                              step=rounded(0.1 * size))
        return self._draft(f"{of} whose stiffness changes with the driving speed", of, (parameter,),
                           _STIFFNESS.format(slowest=slowest, mean=mean, fastest=fastest, motion=motion),
                           handed_on("changed", between))

    def _draft(self, title: str, variant: str, parameters: tuple[Parameter, ...], functions: str, method: str,
               places: tuple[float, ...] = ()) -> Draft:
        source = ("S. M. Savaresi et al., Semi-Active Suspension Control Design for Vehicles (2010), chapter 2"
                  if title is _DAMPERS else "H. B. Pacejka, Tire and Vehicle Dynamics (2012), chapter 9")
        return self.draft(parameters, method, functions, title=title, variant=variant, source=source, places=places,
                          words=("needs_road = True",))

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.places:
            shares = " and ".join(f"{say(name, 100.0, '%')} at {there:g} m/s" for name, there in zip(
                draft.strengths, draft.places, strict=True))
            return f"{draft.title}, by {shares}"
        if draft.title is _DAMPERS:
            return f"{draft.title}, by {say('changed_ratio', 100.0, '%')} from the mean speed to twice that"
        return f"{draft.title}, by {say('changed_n_per_m')} from the mean speed to twice that"


def _ends(speeds_mps: tuple[float, float, float]) -> tuple[float, float]:
    """The shares, from the mean speed to twice that, with which most of it is lost at the fastest and at the slowest
    speed."""
    slowest, mean, fastest = speeds_mps
    return -_MOST_LOST / (fastest / mean - 1), _MOST_LOST / (1 - slowest / mean)


FAMILY = ChangingWithSpeed()
