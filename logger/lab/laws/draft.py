"""A law as the text of its file, the effect that this text makes, and the interface of a family of laws.

Problem: what is learned is written for people to read, and whatever reads it afterwards has to find the very law that
was fitted. Solution: a law is drafted as the Python text of an own effect (``docs/own-effect.md``), and what is fitted
is the effect that this text makes when it is run. What is written in the end is the same text, its numbers where the
fit found them.

A family is one file that offers ``FAMILY``: in the field's words what it is, the laws to be tried (``drafts``), given
what the runs show of the car's motions, and the sentence with numbers for one that was found.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from re import findall
from textwrap import fill, indent
from typing import Any

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.posterior import Posterior, State
from logger.runs import Run
from logger.vehicle.compose import Response
from logger.vehicle.effect import AXLE, Chosen, Effect, ForceEffect, Parameter, Sought, Values
from logger.vehicle.laws import linear
from logger.vehicle.vehicle import Vehicle

LEARNED = "learned_"
"""What the names of learned effects begin with."""
_WIDTH = 118
_IMPORTED = {"PchipInterpolator": "scipy.interpolate", "SimpleNamespace": "types", "hung": "logger.vehicle.structure",
             "replace": "dataclasses"}
"""What a law may use besides numpy and its class, and where it is from."""


@dataclass(frozen=True)
class Draft:
    """A law before it is fitted.

    family       that it is of
    kind         name of the class of ``logger.vehicle.effect`` that it is made from
    title        in a few words
    parameters   its numbers
    source       where the law is from
    signature    what it leaves in a measurement
    shown_by     the drive that would show it best
    method       the function of its class, as its lines stand in the class without their indentation
    functions    what stands before the class: constants, and functions that the method hands on
    variant      distinguishes laws of one family
    at           what a picture draws its force over: "rate", "travel" or "deflection"; "loop": over the travel as it
                 goes to and fro; "": there is no picture
    reference    where a force is what its number says, if there is such a place
    places       of a curve's points, in the order of its numbers
    words        the other lines of its class (``needs_road = True``)
    """

    family: "Family"
    kind: str
    title: str
    parameters: tuple[Parameter, ...]
    source: str
    signature: str
    shown_by: str
    method: str
    functions: str = ""
    variant: str = ""
    at: str = ""
    reference: float = 0.0
    places: tuple[float, ...] = ()
    words: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the effect."""
        return LEARNED + self.family.name

    @property
    def key(self) -> tuple[str, str]:
        """Names of the family and of the law in it."""
        return self.family.name, self.variant

    @property
    def strengths(self) -> tuple[str, ...]:
        """Names of the numbers at whose null the law does nothing."""
        return tuple(one.name for one in self.parameters if one.is_free and one.null is not None)

    def text(self, values: Mapping[str, float] | None = None, said: Sequence[str] = ()) -> str:
        """The law's file.

        values    where fits and searches begin; None: as it was drafted
        said      paragraphs of what is known of it, for the head of the file
        """
        parameters = self.parameters if values is None else tuple(_at(one, values[one.name]) for one in self.parameters)
        head = "\n\n".join(fill(one, _WIDTH) for one in (f"{self.title[0].upper()}{self.title[1:]}.", *said))
        used = set(findall(r"\w+", self.functions + self.method))
        effects = sorted({self.kind, "Parameter", "Scale"} | (used & {"Between"}))
        lines = [f"from ridelog.effects import {', '.join(effects)}",
                 *(f"from {place} import {name}" for name, place in _IMPORTED.items() if name in used)]
        return "\n".join([
            f'"""{head}\n"""', "", "import numpy as np", "", *sorted(lines), "",
            *([self.functions.strip("\n"), ""] if self.functions else []), "",
            f"class Learned({self.kind}):", f"    name = {self.name!r}", f"    title = {self.title!r}",
            "    parameters = (", *(indent(_written(one), " " * 8) for one in parameters), "    )",
            *(f"    {name} = (\n{_long(getattr(self, name))})" for name in ("source", "signature", "shown_by")),
            *(f"    {one}" for one in self.words), "", indent(self.method.strip("\n"), "    "), "", "",
            "EFFECT = Learned()", ""])

    @cached_property
    def effect(self) -> Effect:
        """The effect that the text defines."""
        place = {"__name__": f"ridelog_{self.name}"}
        exec(compile(self.text(), f"<{self.name}>", "exec"), place)
        effect: object = place["EFFECT"]
        assert isinstance(effect, Effect)
        effect.sought = Sought.NEVER
        return effect

    def force_n(self, values: Mapping[str, float], at: Array, damping_n_s_per_m: float) -> Array:
        """Force of the law (n,) [N] at motions (n,) of the kind ``at`` [m, or m/s]."""
        assert isinstance(self.effect, ForceEffect)
        before = linear(damping_n_s_per_m)
        laws = self.effect.laws(Values(**values), before)
        if self.at == "rate":
            return laws.by_rate_n(at) - before.by_rate_n(at)
        if self.at == "deflection":
            return np.asarray(sum((one(at) for one in laws.tires), np.zeros_like(at)))
        return laws.by_travel_n(at)


def _at(one: Parameter, value: float) -> Parameter:
    """A parameter that was found: fits begin there, and nowhere else; within bounds that leave room around it."""
    return replace(one, start=value, trials=(value,), default=value, choices=(value,) if one.choices else ())


def _written(one: Parameter) -> str:
    """A parameter as it stands in the file."""
    null = 'float("inf")' if one.null == np.inf else repr(one.null)
    more = "".join(f", {name}={value!r}" for name in ("default", "step", "choices", "given", "may_end")
                   if (value := getattr(one, name)) != vars(Parameter)[name])
    return (f"Parameter({one.name!r}, start={one.start!r}, low={one.low!r}, high={one.high!r}, null={null},\n"
            f"          scale=Scale.{one.scale.name}, trials={one.trials!r}{more},\n"
            f"          meaning={one.meaning!r}),")


def _long(text: str) -> str:
    """A text in lines of the file's width, as it stands between brackets."""
    lines = fill(text, _WIDTH - 12).split("\n")
    return "\n".join(f"        {line + ' ' * (number < len(lines))!r}" for number, line in enumerate(lines, 1))


def handed_on(force: str = "force", between: str = "BODY_AND_WHEEL", states: int = 0) -> str:
    """The method of a force that gets the law's numbers as they are, between these ends, with states at rest at 0."""
    rest = f", rates, memory={(0.0,) * states!r}" if states else ""
    return f"def laws(self, p, laws):\n    return laws.with_law(Between.{between}, {force}, p{rest})"


_EXPONENT = "power_ratio"  # what laws that are powers call theirs
FormatNumber = Callable[..., str]
"""A number of the law in words, with its standard error and unit, by its name: ``say("yield_force_n")`` is "161 ± 4 N";
``say("yield_travel_m", 1000.0, "mm")`` the number in another unit."""


@dataclass(frozen=True, eq=False)
class LawContext:
    """The fitted model without a law, from which laws are drafted.

    posterior    of the runs
    state        the fitted model
    """

    posterior: Posterior
    state: State

    @property
    def vehicle(self) -> Vehicle:
        """The fitted car."""
        return self.posterior.prior.vehicle(self.posterior.vehicle, self.state.logs)

    @property
    def runs(self) -> Sequence[Run]:
        """The measured runs."""
        return self.posterior.runs.runs

    @cached_property
    def residuals(self) -> list[Array]:
        """Measured minus predicted acceleration (n,), per run, whole [m/s2]."""
        return [run.measured_mps2 - run.main(one) for run, one in zip(self.runs, self.state.predictions, strict=True)]

    @cached_property
    def responses(self) -> list[Response]:
        """Motions of the suspensions and tires in each run."""
        return self.posterior.runs.respond(self.posterior.car(self.state.effects, self.state.logs),
                                           self.posterior.distance_error_m(self.state.record))

    def reach(self, what: str, share: float) -> float:
        """Quantile of the size of a motion of all wheels (``travel_m``, ``rate_mps`` or ``deflection_m``) for a share
        of the time, rounded to two digits, as it stands in a file."""
        size = np.concatenate([np.abs(getattr(one, what)[run.first:]).ravel()
                               for run, one in zip(self.runs, self.responses, strict=True)])
        return rounded(float(np.quantile(size, share)))

    @property
    def axles(self) -> tuple[str, ...]:
        """Axles that a law may act on alone."""
        return () if self.vehicle.rear is None else ("front", "rear")

    @property
    def is_driven(self) -> bool:
        """Whether all runs are of a road, with a speed and a distance."""
        return not any(run.timed for run in self.runs)


class Family(ABC):
    """A family of laws.

    name               of those that come with ridelog the file's
    title              in a few words
    related_effects    names of effects of the list that one of its laws may nearly be
    kind, source, signature    of its laws, as ``Draft`` has them, unless these say something else
    shown_by           the drive that shows it best, as an instruction
    straight_at        the exponent at which its laws are straight lines, which are numbers of the car; None: at none
    by_axle            whether its forces may act at one axle alone
    holds              names of effects of the list that its laws hold, which are not sought on top of them
    stands_out         whether its laws are loud at few frequencies and drafted only where those stand out of the noise:
                       a whole residual may be no louder than the noise for all that
    """

    name: str
    title: str
    related_effects: tuple[str, ...] = ()
    holds: tuple[str, ...] = ()
    kind: str = "ForceEffect"
    source: str = ""
    signature: str = ""
    shown_by: str
    straight_at: float | None = None
    by_axle: bool = True
    stands_out: bool = False

    def __init_subclass__(cls) -> None:
        folder, _, file = cls.__module__.rpartition(".")
        if folder == "logger.lab.laws.families" and "name" not in vars(cls):
            cls.name = file

    @abstractmethod
    def drafts(self, context: LawContext) -> list[Draft]:
        """Laws to be tried, simple ones first; none where such a law cannot be there."""

    def draft(self, parameters: tuple[Parameter, ...], method: str, functions: str = "", **more: Any) -> Draft:
        """A law of this family; ``more`` as of ``Draft``, what is not said is the family's."""
        said = {name: getattr(self, name) for name in ("kind", "title", "source", "signature", "shown_by")}
        if more.pop("by_axle", self.by_axle) and more.get("kind", self.kind) == "ForceEffect":
            parameters = (*parameters, AXLE)
        return Draft(family=self, parameters=parameters, method=method, functions=functions, **{**said, **more})

    def is_straight(self, draft: Draft, found: Chosen, sigma: float) -> bool:
        """Whether a law that was found is a straight line, within so many standard errors."""
        if self.straight_at is None or _EXPONENT not in found.values:
            return False
        error = found.standard_errors.get(_EXPONENT, np.inf)
        return abs(found.values[_EXPONENT] - self.straight_at) < sigma * error

    @abstractmethod
    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        """The law in words, with numbers and their standard errors: "friction with memory, 161 ± 4 N over 4.0 ± 0.2
        mm". The axle is added by the caller."""


def through_points(function: str, names: Mapping[float, str], places: str = "AT", zeros: Sequence[float] = (0.0,),
                   more: str = "") -> str:
    """Text of a function of the parameters and of where it is: a smooth curve through points, of which parameters have
    these ``names`` by place, and 0 at rest, or at ``zeros``; beyond the points it stays what it is there, or goes on as
    straight as between the last two, by no less than what it takes further (``more``)."""
    at = sorted([*names, *zeros])
    straight = f"""
    inside = np.clip(at, {places}[0], {places}[-1])
    first, last = (np.maximum((through[i + 1] - through[i]) / ({places}[i + 1] - {places}[i]), {more}) for i in (0, -2))
    return PchipInterpolator({places}, through)(inside) + np.where(at > inside, last, first) * (at - inside)
"""
    still = f"""
    return PchipInterpolator({places}, through)(np.clip(at, {places}[0], {places}[-1]))
"""
    return f"""
{places} = np.array([{', '.join(repr(one) for one in at)}])


def {function}(p, at{', ' * bool(more) + more}):
    through = np.array([
        {', '.join(f'p.{names[one]}' if one in names else '0.0' for one in at)}]){straight if more else still}"""


def rounded(value: float, digits: int = 2) -> float:
    """A number rounded to so many significant digits."""
    return float(f"{value:.{digits}g}")
