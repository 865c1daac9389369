"""The search for effects where numbers of the car are not known: from several starts, each effect at its usual size.

Problem: a missing effect moves the numbers of a car as far as nothing keeps them. A linear car that is fitted to one
that rubs has other springs and dampers, and a search that begins there does not find the friction: there it gains
nothing. Nor does the likelihood lead away from there: with a free noise level in each band (``whittle``) it gains in
one what it loses in all others, and has optima all over the place. Solution: cars are drawn around the file's and
around the fitted one, with the effect at its usual size; the best by squares, all bands weighed alike, are improved by
squares, and only from there the likelihood decides. The model without the effect is fitted in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any
from zlib import crc32

import numpy as np

from logger.arrays import Array
from logger.identification.time_scale import ringing_hz
from logger.lab.likelihood.by_squares import ROUNDS, BySquares
from logger.lab.likelihood.distance_error import signals_off
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, fit, fit_model
from logger.lab.likelihood.noise_floor import floor_error, sensor_noise_of
from logger.lab.likelihood.posterior import NotSimulated, Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.selection.candidate_fit import CandidateFit, fit_roughly
from logger.lab.selection.evidence import IMITATION, INDISTINGUISHABLE
from logger.lab.selection.holdout import most_of
from logger.lab.selection.screening import Baseline, Screened, Trial, effects_without
from logger.lab.selection.stepwise import MeasuredRoad, Search, SearchEffort, is_outside_data
from logger.printable import Notify
from logger.simulation.virtual_drive import SEARCH_HZ, SimulatedRuns
from logger.vehicle.effect import Chosen, Effect, Misalignment, Sought, chosen
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.named_parameters import WEAKEST

_Drawn = tuple[float, State]
"""A car with its deviance by squares."""
_Car = tuple[list[Chosen], Array]
"""A car's effects and numbers."""


@dataclass(frozen=True, eq=False)
class Started(Screened):
    """An effect that was screened on a model and in cars that were drawn.

    others           the best of these of each kind that are not improved yet, with their deviances
    ends             the first of each kind, improved; of kinds with refinements, if its plain form is the best so far
    gain_by_squares  of the best of them over the model, in minus twice the log of the likelihood under white noise
    known            deviance of the model with the effect in whose place it is tried
    """

    others: Sequence[_Drawn]
    ends: Sequence[_Drawn]
    gain_by_squares: float
    known: float

    @property
    def gain(self) -> float:
        """The larger gain of the two."""
        return max(self.trials[0].gain, self.gain_by_squares)


@dataclass(eq=False)
class UnknownNumbers(MeasuredRoad):
    """The likelihood of drives over a measured road, of a car whose numbers are not known.

    draws        cars that are drawn for each effect
    tried        so many of those around the file's car, the best of each form, are improved a little, and one of those
                 around the fitted one, which lie in its valley
    starts       so many of those without an effect, or where others have shown the car, are improved to the end
    most         work of simulations (``SimulatedRuns.work``) after which a search takes no further step: some three
                 minutes of a processor (a judgement: with a third of it a body's guide was taken for a wheel's, and
                 with two thirds the hardening of a leaf spring was not tried after its friction). A round draws cars
                 until ``Search.share`` of it is done or, where it is, a sixth more (a judgement)
    ends         of how many of these the fit of an effect ended at the best, by name
    not_tried    what a search stopped before
    """

    draws: int = 120
    tried: int = 3
    starts: int = 2
    most: float = 2e9
    ends: dict[str, tuple[int, int]] = field(default_factory=dict)
    not_tried: list[str] = field(default_factory=list)
    _runs: SimulatedRuns | None = None
    _begun: int = 0
    _squares: dict[int, tuple[Posterior, BySquares]] = field(default_factory=dict)
    _ended: dict[frozenset[str], Sequence[_Drawn]] = field(default_factory=dict)
    _reconsidered: tuple[Baseline, State] | None = None

    def stops_before(self, what: str, share: float = 1.0) -> bool:
        """Whether a search has simulated this share of what it may, and does not try something."""
        if stops := self._done() > share * self.most:
            self._leave_out(what)
        return stops

    def _leave_out(self, what: str) -> None:
        if what not in self.not_tried:
            self.not_tried.append(what)

    def _done(self) -> int:
        return 0 if self._runs is None else self._runs.work - self._begun

    def fitted(self, posterior: Posterior, present: Sequence[Chosen], near: State | None = None) -> Baseline:
        """The model with some effects, fitted from where it is or else from the file's car, and from cars that are
        drawn."""
        if self._runs is None:
            self._runs, self._begun = posterior.runs, posterior.runs.work
        by_squares = self._by_squares(posterior)
        near = align(posterior, posterior.start(present)).state if near is None else near
        return Baseline.of(self._likeliest(
            by_squares.of_all(self._anchor(by_squares, near, self.starts), near), posterior))

    def screened(self, base: Baseline, effects: Sequence[Effect], seen: Misalignment, near: Chosen | None,
                 pool: ThreadPoolExecutor, progress: Notify) -> list[Screened]:
        """Effects screened on the model, and by squares in cars that are drawn, one after the other: a car ends early
        where it cannot reach the best so far at its pace, and once an effect has shown the numbers of the car, the
        others are tried with these. In the place of an effect they begin with what the model with it has shown, and
        that effect itself is left out where it ends there again."""
        local = super().screened(base, effects, seen, near, pool, progress)
        # Were numbers far off, the car's resonances would be, and leave more than so little of one of the signals, or
        # a signal's gain would be, which had to make up for it.
        if ((base.explanation == 0 or base.hold_out.largest < UNEXPLAINED)
                and not base.posterior.prior.is_contradicted_by(base.state.logs)
                and not signals_off(base.posterior.record_errors, base.state.record)):
            return local
        by_squares = self._by_squares(base.posterior)
        anchor = self._anchor(by_squares, base.state, 1)
        least = without = by_squares.deviance(anchor)
        known, numbers = np.inf, None
        if near is not None and self._reconsidered is not None and self._reconsidered[0] is base:
            there = self._reconsidered[1]
            if (car_there := by_squares.at(there.effects, there.logs, there)) is not None:
                known, best = by_squares.improved(car_there[1])
                least = min(known, least)
                numbers = best.logs if self._shows_the_car(by_squares, anchor, best) else None
        found: list[Screened] = []
        enough, later = max(Search.share * self.most, self._done() + self.most / 6), list[str]()
        for one in local:
            if self._done() > enough:
                found.append(one)
                later.append(one.effect.name)
                continue
            drafted = one.effect.sought is Sought.NEVER  # by the motions of the records, as it begins
            drawn = [] if drafted else self._cars(by_squares, one.effect, anchor, one.trials, numbers)
            forms = [some for some in drawn if _is_plain(some[0])] or drawn
            ends, others = _improved(pool.map, by_squares, [each for some in forms for each in some], least)
            forms = [some for some in drawn if some not in forms]
            refined = [some[0] for some in forms]
            others += [each for some in forms for each in some[1 : self.starts]]
            if ends and ends[0][0] < least:
                ends += _improved(pool.map, by_squares, refined, _explaining_most(by_squares, _plain(ends)))[0]
                ends, refined = _with_plain(by_squares, ends), []
            if near is not None and one.effect is near.effect and ends and ends[0][0] > known - INDISTINGUISHABLE:
                continue
            # What leaves far more than the effect in whose place it is tried is fitted from its trial alone.
            worth = ends and _explaining_most(by_squares, ends[0][0]) < known
            found.append(Started(one.effect, one.trials, [*refined, *others] if self._done() < enough else [], ends,
                                 without - ends[0][0], known) if worth else one)
            shown = [end for end in ends if not is_outside_data(base.posterior, end[1].effects[-1])]
            if shown and shown[0][0] < least:
                least, best = shown[0]
                numbers = best.logs if self._shows_the_car(by_squares, anchor, best) else None
        if later:
            self._leave_out(f"other starting points of {', '.join(sorted(later))}")
        self._keep(*(one.ends for one in found if isinstance(one, Started)))
        return sorted(found, key=lambda one: -one.gain)

    @staticmethod
    def _shows_the_car(by_squares: BySquares, without: State, there: State) -> bool:
        """Whether a model leaves so little above the noise of what was measured that the numbers of its car are not far
        off, nor contradict what is known, and so little of what the one without its last effect leaves that others can
        only imitate it."""
        posterior = by_squares.posterior
        if posterior.prior.is_contradicted_by(there.logs):
            return False
        noise = floor_error(posterior, sensor_noise_of(posterior, there))**2
        left, before = (posterior.error(one)**2 - noise for one in (there, without))
        return left < min(UNEXPLAINED**2, IMITATION * before)

    def stripped(self, now: Baseline, name: str) -> None:  # type: ignore[override]
        """It is the fitted one."""

    def fitted_roughly(self, score: float, base: Baseline, one: Screened, least: float) -> list[CandidateFit]:
        """Fits from the best trial on the model, and from the best of the cars that were drawn: of the effect in its
        plain form, and with its refinements, where they explain most of what that leaves, or else they are not taken.
        Of each form cars are improved until two end alike at the best."""
        if not isinstance(one, Started):
            return fit_roughly(score, base, one, least)
        by_squares = self._by_squares(base.posterior)
        ends = [*one.ends]
        for other in one.others:
            alike = [deviance for deviance, end in ends if end.effects[-1].is_plain is _is_plain(other)]
            needed = np.inf if _is_plain(other) else _explaining_most(by_squares, _plain(ends))
            if len(alike) < 2 or (alike[1] > alike[0] + INDISTINGUISHABLE and alike[0] < needed):
                ends.append(by_squares.improved(other[1], to_reach=min([needed, one.known, *alike])))
                ends.sort(key=_by_deviance)
        if ends[0] is not one.ends[0]:
            ends = _with_plain(by_squares, ends)
        self._keep(ends)
        trials = {trial.one.is_plain: trial for trial in reversed(one.trials)}
        needed = _explaining_most(by_squares, _plain(ends))
        best = {_is_plain(end): end[1] for end in reversed(ends) if _is_plain(end) or end[0] < needed}
        found = fit_roughly(score, base, replace(one, trials=tuple(trials.values())))
        enough = SearchEffort.round_share * base.explanation
        found += [CandidateFit.of(score, self._likeliest(by_squares.of_all(state, base.state), base.posterior, enough))
                  for state in best.values()]
        found.sort(key=lambda one: -one.gain)
        alike = [deviance for deviance, state in ends if state.effects[-1].is_plain == found[0].chosen.is_plain]
        alike = alike or [deviance for deviance, _ in ends]  # no drawn car of that form could be simulated
        self.ends[one.effect.name] = sum(each < alike[0] + INDISTINGUISHABLE for each in alike), len(alike)
        return found

    def without(self, now: Baseline, name: str) -> Baseline:
        """The model without an effect, fitted from where it is and from several starts."""
        rest, state = effects_without(now.state, name), now.state
        found = self.fitted(now.posterior, rest, now.posterior.state_at(rest, state.logs, state.record, state.size))
        self._reconsidered = found, state
        return found

    @staticmethod
    def _likeliest(start: State, posterior: Posterior, enough: float = 0.0) -> LinearModel:
        """The model fitted by the likelihood from a state until a round gains less than enough; there, where that leads
        away: the likelihood of a model that lacks something may have its maximum at a car that moves quite
        differently."""
        begun = LinearModel(posterior, start, posterior.number_slopes(start, posterior.prior.steps))
        try:
            with np.errstate(all="ignore"):
                found = fit(begun, begun.numbers, min_gain=enough, at_most=12)
        except NotSimulated:
            return begun
        leads_away = posterior.error(found.state) > (1 + UNEXPLAINED) * posterior.error(start)
        return begun if leads_away else found

    def _by_squares(self, posterior: Posterior) -> BySquares:
        if id(posterior) not in self._squares:
            self._squares[id(posterior)] = posterior, BySquares.of(posterior)  # kept, so that its id stays its own
        return self._squares[id(posterior)][1]

    def _anchor(self, by_squares: BySquares, near: State, count: int) -> State:
        """The best car by squares with the effects of a state: from there, and from cars that are drawn."""
        here = by_squares.at(near.effects, near.logs, near)
        begun = dict([] if here is None else [here])
        begun |= dict(one for some in self._cars(by_squares, None, near) for one in some[:count])
        ends, _ = _improved(map, by_squares, [*begun.items()], np.inf)
        self._keep(ends)
        return ends[0][1]

    def _keep(self, *ends: Sequence[_Drawn]) -> None:
        """Ends of starts, each of one model, where later rounds begin."""
        self._ended |= {frozenset(one.effect.name for one in some[0][1].effects): some for some in ends}

    def _cars(self, by_squares: BySquares, effect: Effect | None, near: State, trials: Sequence[Trial] = (),
              known: Array | None = None) -> list[list[_Drawn]]:
        """The best cars of each kind with the effects of a state and one more, the best first. Cars are drawn once for
        an effect, unless the car's numbers are ``known``; later rounds begin where these ended, and at its trials on
        the model."""
        cars, counts = self._known(effect, near, trials, known), [self.starts]
        if not cars:
            cars, counts = self._draw(effect, by_squares.posterior, near), [self.tried, 1] if effect else counts
        ranked = [{by_squares.rank(effects, logs, near): (effects, logs) for effects, logs in some} for some in cars]
        best = [[state for deviance in sorted(some)[: counts[place % len(counts)]]
                 if (state := by_squares.at(*some[deviance], near)) is not None] for place, some in enumerate(ranked)]
        return [some for some in best if some]

    def _known(self, effect: Effect | None, near: State, trials: Sequence[Trial], known: Array | None
               ) -> list[list[_Car]]:
        """Cars where starts of the same model ended, or of another with the effect, those with numbers that are known
        and the effect at its usual sizes, and those at its trials: with the effect in its plain form, and with its
        refinements. Empty: there are none."""
        names = [*(one.effect.name for one in near.effects), *([effect.name] if effect else [])]
        cars: list[_Car] = [([*near.effects, chosen(effect, values)], known) for values in effect.trials()
                            ] if effect and known is not None else []
        for having, ends in list(self._ended.items()):
            for _, end in ends if having == {*names} or (effect and effect.name in having) else ():
                by_name = {one.effect.name: one for one in (*near.effects, *end.effects)}
                cars += [([by_name[name] for name in names], logs) for logs in (near.logs, end.logs)]
        if not effect or not cars:
            return [cars] if cars else []
        cars += [([*near.effects, one.one], one.logs) for one in trials]
        forms = ([car for car in cars if car[0][-1].is_plain is plain] for plain in (True, False))
        return [some for some in forms if some]

    def _draw(self, effect: Effect | None, posterior: Posterior, near: State) -> list[list[_Car]]:
        """Cars that are drawn around the file's, and as many around a state; with the effect in its plain form, and as
        many with its refinements. A state without the effect is in a valley of its own, whose cars are the better ones
        before they are improved. What was let go rings at a mode, which may be too sharp to be drawn by chance: half of
        them have one there."""
        prior, rings_hz = posterior.prior, ringing_hz(posterior.runs.runs)
        spread = np.minimum(prior.deviations, WEAKEST * prior.steps / prior.steps.max())  # of lengths, which waves show
        rng = np.random.default_rng(crc32((effect.name if effect else "").encode()))
        trials = [chosen(effect, values) for values in effect.trials()] if effect else []
        forms = [some for plain in (True, False) if (some := [one for one in trials if one.is_plain is plain])]
        drawn: list[list[_Car]] = [[] for _ in range(2 * max(len(forms), 1))]
        for number in range(self.draws):
            logs = near.logs * (number % 2)
            if number > 1:
                logs = logs + spread * rng.standard_normal(len(logs))
                if rings_hz and number // 2 % 2:
                    logs = _tuned(posterior, logs, rings_hz[number // 4 % len(rings_hz)])
            effects = [_resized(one, rng, WEAKEST) for one in near.effects]
            pair, kind = divmod(number, len(drawn))
            if forms:
                some = forms[kind // 2]
                # Usual sizes follow the vehicle's by powers of ten (``sized``).
                effects.append(_resized(some[pair % len(some)], rng, float(np.log(10.0)) / 2))
            drawn[kind].append((effects, logs))
        return drawn


def _tuned(posterior: Posterior, logs: Array, hz: float) -> Array:
    """A car's numbers (p,) with all springs that are not known scaled so that, were the others scaled too, its nearest
    mode would be at a frequency."""
    prior = posterior.prior
    springs = [name.endswith("stiffness_n_per_m") for name in prior.names] & (prior.deviations > Tolerance().numbers)
    modes_hz = undamped_frequencies_hz(structure_of(prior.vehicle(posterior.vehicle, logs)))
    off = np.log(hz / modes_hz[modes_hz > 0])
    return logs + 2 * off[np.abs(off).argmin()] * springs if len(off) else logs


def needs_starts(posterior: Posterior) -> bool:
    """Whether a fit may end in a wrong valley of the car's numbers: where they are not known, but for a part that its
    bench moves, whose force is linear in them."""
    return posterior.prior.is_vague and not posterior.vehicle.is_part


def fitted_from_starts(posterior: Posterior, present: Sequence[Chosen]) -> LinearModel:
    """The model with some effects, fitted; where the car's numbers are not known, from where a search's starts end."""
    if not needs_starts(posterior):
        return fit_model(posterior, posterior.start(present))
    found = UnknownNumbers().fitted(posterior.simulated(SEARCH_HZ), present).linear
    state = found.state
    return fit_model(posterior, posterior.state_at(state.effects, state.logs, state.record, state.size), found.numbers)


def _by_deviance(one: tuple[float, *tuple[Any, ...]]) -> float:
    return one[0]


def _is_plain(one: _Drawn) -> bool:
    """Whether the last effect of a car has its plain form."""
    return one[1].effects[-1].is_plain


def _plain(ends: Sequence[_Drawn]) -> float:
    """The least deviance of cars whose last effect has its plain form."""
    return min((end[0] for end in ends if _is_plain(end)), default=np.inf)


def _with_plain(by_squares: BySquares, ends: Sequence[_Drawn]) -> list[_Drawn]:
    """Ends, and where the plain form of the best one ends that begins there, if that has refinements: the car to which
    they led may do without."""
    found, best = sorted(ends, key=_by_deviance), min(ends, key=_by_deviance)[1]
    *others, last = best.effects
    if not last.is_plain:
        usual = {name: last.effect.usual[name] for name in last.effect.refinements}
        if (begun := by_squares.at([*others, replace(last, values={**last.values, **usual})], best.logs, best)
            ) is not None:
            found.append(by_squares.improved(begun[1], to_reach=_plain(ends)))
    return sorted(found, key=_by_deviance)


def _explaining_most(by_squares: BySquares, deviance: float) -> float:
    """The deviance of a car that explains most of what one with a deviance leaves."""
    return deviance + by_squares.posterior.freedom * float(np.log(most_of(1.0)))


def _improved(over: Callable[..., Iterable[_Drawn]], by_squares: BySquares, begun: Sequence[_Drawn], to_reach: float
              ) -> tuple[list[_Drawn], list[_Drawn]]:
    """Cars improved as long as they may reach a deviance, and the two best of those that were left behind; the best
    first. Which of many lie in the valley shows after some rounds, not before (measured: of a rig whose body rubs on
    its guide the car that led to it was the third, and then the first): all are improved a little, the better half as
    much again, until two are left, which go to the end (successive halving: K. Jamieson and A. Talwalkar, AISTATS
    2016)."""
    def further(some: Sequence[_Drawn], rounds: int, later: int) -> list[_Drawn]:
        improved = partial(by_squares.improved, rounds=rounds, later=later, to_reach=to_reach)
        return sorted(over(improved, [state for _, state in some]), key=_by_deviance)

    now, behind = list(begun), list[_Drawn]()
    while len(now) > 2:
        now = further(now, ROUNDS // 4, ROUNDS)
        half = max(2, len(now) // 2)
        now, behind = now[:half], behind + now[half:]
    return further(now, ROUNDS, 0), sorted(behind, key=_by_deviance)[:2]


def _resized(one: Chosen, rng: np.random.Generator, spread: float) -> Chosen:
    """An effect with its sizes drawn around those that it has, by a standard deviation of their logarithms."""
    values: dict[str, Any] = dict(one.values)
    for parameter in one.freed:
        if values[parameter.name]:
            value = values[parameter.name] * float(np.exp(spread * rng.standard_normal()))
            values[parameter.name] = min(max(value, parameter.low), parameter.high)
    return replace(one, values=values)
