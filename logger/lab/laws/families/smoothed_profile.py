"""A profile from which short waves are missing: the instrument, or whoever wrote it, took means along the way.

The wheels met the road itself. A mean leaves a share of each wave that depends on its length alone, so that the road is
the profile with every wave over that share (ASTM E950 and EN 13036-6 have profilers average over a base length). What a
mean left nothing of is in no profile: no wave is raised more than a hundred times, as profiles are written to the
micrometre, and their rounding would be a tenth of a millimetre beyond.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext
from logger.vehicle.effect import Chosen, Parameter, Scale

_METHOD = """def road(self, p, spacing_m, elevation_m):
    n = len(elevation_m)
    if n < 3:
        return elevation_m
    # From a straight line between its ends, and turned over beyond them, a profile comes round without a step.
    straight = np.linspace(elevation_m[0], elevation_m[-1], n)
    once = (elevation_m - straight)[1:-1]
    around = np.concatenate([[0.0], once, [0.0], -once[::-1]])
    left = share_left(p, np.fft.rfftfreq(len(around), spacing_m))
    raised = left / np.maximum(left**2, 1.0 / MOST**2)
    return straight + np.fft.irfft(np.fft.rfft(around) * raised, len(around))[:n]
"""
_FUNCTIONS = """
MOST = 100.0  # no wave is raised more often than so


def share_left(p, waves_per_m):
    return {share}
"""
_BELL = "np.exp(-0.5 * np.minimum(2 * np.pi * waves_per_m * p.spread_m, 30.0) ** 2)"
_MEAN = "np.sinc(waves_per_m * p.base_m)"
_SPREADS_M = (0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.45)
"""Standard deviations of the weights of a mean that are tried, closely: what is lost grows as the exponential of their
squares, so that no slope leads far."""


class SmoothedProfile(Family):
    title = "a profile that lacks short wavelengths"
    related_effects = ("tire_enveloping", "sensor_mount_resonance", "sensor_bandwidth")
    kind = "RoadEffect"
    source = "profilers average over a base length (ASTM E950; EN 13036-6)"
    signature = "the car shakes more than on its profile, most of all on short waves, at every speed"
    shown_by = "drive one road slowly and fast: what is missing stays at one wavelength"

    def drafts(self, context: LawContext) -> list[Draft]:
        if not context.is_driven:
            return []
        spread = _length("spread_m", 1.0, "standard deviation of the Gaussian that smoothed it")
        base = _length("base_m", 12**0.5, "base length of the moving average that smoothed it")
        return [self.draft((one,), _METHOD, _FUNCTIONS.format(share=share), variant=variant)
                for variant, one, share in (("bell", spread, _BELL), ("mean", base, _MEAN))]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        if draft.variant == "mean":
            return f"a profile that was smoothed by a moving average over {say('base_m')}"
        return f"a profile that was smoothed by a Gaussian with a standard deviation of {say('spread_m')}"


def _length(name: str, times: float, meaning: str) -> Parameter:
    """A length that is so many times the standard deviation of the weights of the mean."""
    tried = tuple(round(times * one, 3) for one in _SPREADS_M)
    return Parameter(name, tried[3], round(0.2 * tried[0], 4), round(2 * times, 3), None, Scale.LOG, tried, meaning)


FAMILY = SmoothedProfile()
