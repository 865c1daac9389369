"""A profile from which short waves are missing: the instrument, or whoever wrote it, took means along the way.

A car over the road itself is shaken more than one over such a profile, by a factor that depends on the wave's number
alone, whatever the speed: one over what the mean left of the wave (ASTM E950 and EN 13036-6 have profilers take means
over a base). The record is taken along the way, in finer steps, and each of its waves is raised.
"""

from __future__ import annotations

from typing import Any

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def record(self, p, recording):
    n, accel = len(recording.time_s), recording.accel_z_mps2
    way_m = np.maximum.accumulate(recording.distance_m) + 1e-6 * (recording.time_s - recording.time_s[0])
    at_m = np.linspace(way_m[0], way_m[-1], 8 * n)
    finer_s = np.arange(8 * n) / 8
    finer = 8 * np.fft.irfft(np.fft.rfft(accel), 8 * n)
    along = np.interp(np.interp(at_m, way_m, np.arange(n)), finer_s, finer)
    waves_per_m = np.fft.rfftfreq(8 * n, at_m[1] - at_m[0])
    left = share_left(p, waves_per_m)
    # A wave of which less than a thirtieth is left is no longer in the profile, and not raised further.
    lost = np.fft.irfft(np.fft.rfft(along) * (left / np.maximum(left**2, 1 / 30**2) - 1.0), 8 * n)
    return accel + np.interp(way_m, at_m, lost)
"""
_BELL = """
def share_left(p, waves_per_m):
    return np.exp(-0.5 * np.minimum(2 * np.pi * waves_per_m * p.spread_m, 30.0) ** 2)
"""
_MEAN = """
def share_left(p, waves_per_m):
    return np.sinc(waves_per_m * p.base_m)
"""


class SmoothedProfile(Family):
    name = "smoothed_profile"
    title = "a profile that lacks short waves"
    related_effects = ("tire_enveloping", "sensor_mount_resonance", "sensor_bandwidth")
    shown_by = "drive one road slowly and fast: what is missing stays at one length of wave"

    def drafts(self, context: LawContext) -> list[Draft]:
        if not context.is_driven:
            return []
        common: dict[str, Any] = {
            "family": self.name, "kind": "RecordEffect", "title": self.title, "shown_by": self.shown_by,
            "method": _METHOD, "words": ("needs_road = True",),
            "source": "profilers take means over a base (ASTM E950; EN 13036-6)",
            "signature": "the car is shaken more than by its profile, by short waves the more, at any speed alike"}
        return [Draft(parameters=(_number("spread_m", 1.0, "standard deviation of the bell that smooths it"),),
                      functions=_BELL, variant="bell", **common),
                Draft(parameters=(_number("base_m", 12**0.5, "base of the mean that smooths it"),), functions=_MEAN,
                      variant="mean", **common)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.variant == "mean":
            return f"a profile that was smoothed by a mean over {say('base_m')}"
        return f"a profile that was smoothed by a bell with a standard deviation of {say('spread_m')}"


def _number(name: str, times: float, meaning: str) -> Parameter:
    """A length that is so many times the standard deviation of the weights of the mean."""
    tried = tuple(round(times * one, 3) for one in (0.04, 0.1, 0.25))
    return Parameter(name, tried[1], 0.0, round(2 * times, 3), 0.0, Scale.LINEAR, tried, meaning, step=0.002)


FAMILY = SmoothedProfile()
