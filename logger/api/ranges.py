"""Ranges of what may be asked, at a terminal and in Python alike."""

from __future__ import annotations

from typing import Any, NamedTuple

from logger.errors import BadInput


class Range(NamedTuple):
    """What a number may be, ends included; ``high`` infinite: no end."""

    low: float
    high: float
    unit: str = ""

    @property
    def is_half_open(self) -> bool:
        """Whether it has no end."""
        return self.high == float("inf")

    @property
    def words(self) -> str:
        """Both ends, with the unit."""
        low, high = (str(one) if isinstance(one, int) else format(one, ".15g") for one in self[:2])
        return f"{low} or more" if self.is_half_open else f"{low} to {high} {self.unit}".rstrip()

    def fault(self, value: Any) -> str:
        """What follows the name of a number that lies outside; empty: it does not."""
        if self.low <= value <= self.high:
            return ""
        return f" {value if isinstance(value, int) else format(value, 'g')}: expected {self.words}"

    def check(self, name: str, value: float) -> None:
        """BadInput for a value outside; ``name``: of what it is."""
        if words := self.fault(value):
            raise BadInput(f"{name}{words}")


class Limit(Range):
    """An IRI from which on a road is to be called rough [m/km]; one that no road has is refused."""

    @property
    def words(self) -> str:
        """Said by the complaint alone, as the highest is known by what is not loaded before."""
        return ""

    def fault(self, value: Any) -> str:
        """As of ``Range``."""
        from logger.roads.plausible import HIGHEST_LIMIT_M_PER_KM, limit_hint

        found = Range(self.low, HIGHEST_LIMIT_M_PER_KM, self.unit).fault(value)
        hint = limit_hint(value) if found else ""
        return f"{found}{hint}" + f" (at a terminal write {value:g}in/mi)" * bool(hint)


LIMIT = Limit(0.01, float("inf"), "m/km")


TOLERANCE = Range(0.001, 0.5)
USUAL_TOLERANCE = 0.2
"""How far off a car's masses, springs and dampers may well be, as a share."""
SPEED, RATE, ADDED = Range(0.1, 100.0, "m/s"), Range(10.0, 10_000.0, "Hz"), Range(0.0, 100.0, "m/s2")
"""Of a simulated drive; what its sensor adds, noise or steps. An estimate's steps likewise."""
NOISE, WINDOW = Range(1e-4, 100.0, "m/s2"), Range(1.0, 1000.0, "m")
"""Of an estimate: noise of a reading, length of a window."""
AUTO = "auto"
"""Of a noise: learnt."""
LENGTH, SPACING = Range(11.0, 1e6, "m"), Range(0.001, 0.3, "m")
"""Of a random road; a shorter one has no IRI."""
ROUGHNESS, IRI, ROAD_WAVINESS = Range(1e-3, 1e7, "cm3"), Range(0.01, 1000, "m/km"), Range(1.5, 3.0)
MOST_ROAD_SAMPLES = 20_000_000
TRIES, WAVINESS = Range(0, 1000), Range(1.0, 3.5)
"""Of an identification: further starts, waviness of a road that was not measured."""
NOISE_MODELS = ("auto", "white", "ar", "road")
MODAL_METHODS = ("era", "ssi", "n4sid", "decrement")
MODAL_METHODS_GONE = {"ar": "ssi", "ssi-cov": "ssi", "fft": "ssi", "arx": "n4sid", "armax": "n4sid"}
"""Of modes: the methods, and for those that are no longer offered the one to use."""
RESPONSES = ("decay", "random")
COMMON_IRI, COMMON_SPEED_MPS = 2.5, 15.0
"""Road [m/km] and speed on which laws that are not linear are looked at, where nothing else is said."""
PASSENGERS, MASS_FACTOR, SEED = Range(0, 60), Range(0.2, 10.0), Range(0, 2**63)
LOW_PASS = Range(1.0, 45.0, "Hz")
"""Of a calibration: people more in the car, times the body's mass, and the recorder's low pass."""
DAILY_HOURS = Range(0.001, 24.0, "hours")
"""Of riding, for values of health."""
