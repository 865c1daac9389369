"""Laws of force of springs, dampers and tires, and how compiled code calls them.

The laws of a corner: what a spring, a damper and a tire answer to how far and how fast they are moved.

Signs: a suspension's travel and rate are those of its extension, negative in compression; a force is what it answers
against that, positive in extension (it pulls body and wheel together), as k x and c x' are. A tire's deflection is the
wheel's height over the road from rest, negative when it is pressed.

Laws are elementwise functions of arrays. A simulation tabulates them, so they may be asked far outside what a car does.
Effects wrap them; none of them knows whose car it is in. What no table holds, a force by anything else that moves, by
place or time, or with a memory, is a ``MotionLaw``: a simulation compiles it and asks it number by number.

A law that is written in Python, asked number by number from a compiled loop.

Problem: a force by whatever moves at a wheel, with states of its own, fits in no table, and the loop that steps a car
is compiled once and kept on disk, before anybody wrote that law. Solution: each law is compiled by itself, once, to
machine code with one and the same signature; the loop knows it by its address. Without numba the address is a number
in a list, and the law runs as it stands.

A law's functions are distinguished by their code, so they get all that they need as ``p`` and hold nothing else.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Law = Callable[[Array], Array]
Law2 = Callable[[Array, Array], Array]


class Between(Enum):
    """The two ends that a force acts on. It is positive where it pulls body and wheel together, or the wheel, or the
    body's end of the suspension, down."""

    BODY_AND_WHEEL = 0
    WHEEL_AND_GROUND = 1
    BODY_AND_GROUND = 2


class Seen(NamedTuple):
    """What a ``MotionLaw`` sees at a wheel, at one instant: numbers in a simulation, arrays of one shape elsewhere.

    travel_m, rate_mps              of the suspension, and its rate
    deflection_m, deflection_mps    of the tire, and its rate
    wheel_mps, body_mps             how fast the wheel, and the body's end of the suspension, rise against the ground
    distance_m                      where this wheel stands along the road
    time_s                          since the record's first sample
    speed_mps                       of the car along the road
    run                             which one it is of the runs that are looked at together, from 0 on
    memory                          the law's own states
    """

    travel_m: Any
    rate_mps: Any
    deflection_m: Any
    deflection_mps: Any
    wheel_mps: Any
    body_mps: Any
    distance_m: Any
    time_s: Any
    speed_mps: Any
    run: Any
    memory: tuple[Any, ...]


MOST_MEMORY = 2
"""States that a law may have."""


@dataclass(frozen=True)
class MotionLaw:
    """A force by all that moves at a wheel, maybe with states of its own.

    between    what it acts on
    force      (p, seen) -> force [N]
    p          its numbers
    rates      (p, seen) -> how fast each state grows [1/s], a tuple; None: it has no states
    memory     its states at rest
    """

    between: Between
    force: Callable[[Any, Seen], Any]
    p: SimpleNamespace
    rates: Callable[[Any, Seen], tuple[Any, ...]] | None = None
    memory: tuple[float, ...] = ()


@dataclass(frozen=True)
class CornerLaws:
    """One suspension and its tire.

    damping_n_s_per_m       of the linear damper
    damper                  the damper's force by its own rate: rate [m/s] -> force [N]; grows with the rate
    mount_n_per_m           stiffness of a mount in series with the damper; infinite: none
    springs                 forces by travel beyond the linear spring: travel [m] -> force [N]
    dry_friction_n          Coulomb friction parallel to the damper: this force against any motion, up to it at rest
    friction_transition_mps this times tanh(rate / transition) instead, unless 0
    wheel_friction_n        Coulomb friction of the wheel against a guide that stands on the ground, as on a test rig
    body_friction_n         the same of the body's end of the suspension
    guide_transition_mps    as friction_transition_mps, of these two
    others                  further forces: (travel, rate) -> force
    motions                 and by anything that moves
    tire_damping_n_s_per_m  of the tire
    tires                   forces by deflection beyond the linear tire: deflection [m] -> force [N]
    tire_pulls              whether the tire holds on to the road, as the linear model has it
    rear                    whether it is a corner of the rear axle, for laws that the two axles do not share
    """

    damping_n_s_per_m: float
    damper: Law
    mount_n_per_m: float = np.inf
    springs: tuple[Law, ...] = ()
    dry_friction_n: float = 0.0
    friction_transition_mps: float = 0.0
    wheel_friction_n: float = 0.0
    body_friction_n: float = 0.0
    guide_transition_mps: float = 0.0
    others: tuple[Law2, ...] = ()
    motions: tuple[MotionLaw, ...] = ()
    tire_damping_n_s_per_m: float = 0.0
    tires: tuple[Law, ...] = ()
    tire_pulls: bool = True
    rear: bool = False

    @property
    def rubs(self) -> bool:
        """Whether there is dry friction in it."""
        return self.dry_friction_n > 0 or self.wheel_friction_n > 0 or self.body_friction_n > 0

    def with_spring(self, law: Law) -> CornerLaws:
        """With one more force by travel."""
        return replace(self, springs=(*self.springs, law))

    def with_force(self, law: Law2) -> CornerLaws:
        """With one more force by travel and rate."""
        return replace(self, others=(*self.others, law))

    def with_law(self, between: Between, force: Callable[[Any, Seen], Any], p: SimpleNamespace,
                 rates: Callable[[Any, Seen], tuple[Any, ...]] | None = None,
                 memory: tuple[float, ...] = ()) -> CornerLaws:
        """With one more force by all that moves; see ``MotionLaw``."""
        return replace(self, motions=(*self.motions, MotionLaw(between, force, p, rates, memory)))

    def with_tire(self, law: Law) -> CornerLaws:
        """With one more force by the tire's deflection."""
        return replace(self, tires=(*self.tires, law))


def linear(damping_n_s_per_m: float, rear: bool = False) -> CornerLaws:
    """The laws of the linear car, which its matrices hold already."""
    return CornerLaws(damping_n_s_per_m, lambda rate: damping_n_s_per_m * rate, rear=rear)


try:
    import numba
except ImportError:
    COMPILED = False
else:
    COMPILED = True

MEMORY_AT = len(Seen._fields) - 1
"""Where a law's states stand in what it feels: after all else that it sees."""
FELT = MEMORY_AT + MOST_MEMORY
"""Numbers that a law may feel."""
ANSWERS = 1 + MOST_MEMORY
"""Numbers that it answers with: the force, then how fast its states grow."""

_KNOWN: list[Callable[[Array, Array, Array], None]] = []
_KEPT: list[Any] = []  # compiled functions, which live as long as their addresses are known


def address_of(law: MotionLaw) -> int:
    """How the loop knows a law. ValueError as ``functions_of``, and for one that cannot be compiled."""
    functions = functions_of(law)
    _FUNCTIONS.update((one.__code__, one) for one in functions)
    return _address(tuple(one.__code__ for one in functions), tuple(sorted(vars(law.p))), len(law.memory))


def functions_of(law: MotionLaw) -> list[Any]:
    """Its force, and its rates if it has states. ValueError for what is no function of (p, seen) and nothing else."""
    functions: list[Any] = [law.force] if law.rates is None else [law.force, law.rates]
    for word, one in zip(("force", "rates"), functions, strict=False):
        if not isinstance(one, FunctionType) or one.__closure__ or one.__defaults__ or one.__code__.co_argcount != 2:
            raise ValueError(f"expected {word} to be a function of (p, seen) at the top of the file, or a "
                             "@staticmethod, that knows its numbers by p alone")
    return functions


def numbers_in_order(law: MotionLaw) -> list[float]:
    """Its numbers in the order in which the loop hands them on."""
    return [value for _, value in sorted(vars(law.p).items())]


_FUNCTIONS: dict[CodeType, Any] = {}


@cache
def _address(codes: tuple[CodeType, ...], names: tuple[str, ...], memory: int) -> int:
    """Of a law with these functions, numbers and states."""
    force, *others = (_FUNCTIONS[code] for code in codes)
    numbers = namedtuple("numbers", names)  # type: ignore[misc]  # names are known only now
    if not COMPILED:
        _KNOWN.append(_plain(force, others[0] if others else None, numbers, memory))
        return len(_KNOWN) - 1
    compiled = _machine_code(force, others[0] if others else None, numbers, memory)
    _KEPT.append(compiled)
    return int(compiled.address)


def _plain(force: Any, rates: Any, numbers: Any, memory: int) -> Callable[[Array, Array, Array], None]:
    def answer(given: Array, felt: Array, answers: Array) -> None:
        p = numbers(*given[: len(numbers._fields)])
        seen = Seen._make([*felt[:MEMORY_AT], tuple(felt[MEMORY_AT : MEMORY_AT + memory])])
        answers[0] = force(p, seen)
        if rates is not None:
            answers[1 : 1 + memory] = rates(p, seen)

    return answer


def _machine_code(force: Any, rates: Any, numbers: Any, memory: int) -> Any:
    from numba.np.unsafe import ndarray

    count, first = len(numbers._fields), MEMORY_AT
    compiled: Any = numba.njit(error_model="numpy")
    own_force, own_rates = compiled(force), compiled(rates if rates is not None else force)
    pointer = numba.types.CPointer(numba.types.float64)
    of_array: Any = ndarray.to_fixed_tuple
    all_seen: Any = Seen

    @compiled
    def arguments(given: Any, felt: Any) -> Any:
        p = numbers(*of_array(numba.carray(given, (count,)), count))
        felt = numba.carray(felt, (FELT,))
        return p, all_seen(*of_array(felt[:first], first), of_array(felt[first : first + memory], memory))

    def force_alone(given: Any, felt: Any, answers: Any) -> None:
        p, seen = arguments(given, felt)
        answers[0] = own_force(p, seen)

    def force_and_rates(given: Any, felt: Any, answers: Any) -> None:
        p, seen = arguments(given, felt)
        answers[0] = own_force(p, seen)
        found = own_rates(p, seen)
        for index in range(memory):
            answers[1 + index] = found[index]

    try:
        return numba.cfunc(numba.types.void(pointer, pointer, pointer))(
            force_alone if rates is None else force_and_rates)
    except numba.core.errors.NumbaError as error:
        why = next(line for line in str(error).splitlines() if line.strip() and not line.startswith("Failed in"))
        raise ValueError("expected force and rates to be plain arithmetic and numpy functions of numbers, which can be "
                         f"compiled: {why}") from None


def _code(_context: Any, address: Any, given: Any, first: Any, felt: Any, answers: Any) -> Any:
    """Machine code that calls what lies at an address with pointers to the numbers from ``first`` on, and to the other
    two arrays."""
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        double = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [double] * 3).as_pointer()

        def data(index: int) -> Any:
            return context.make_array(signature.args[index])(context, builder, arguments[index]).data

        builder.call(builder.inttoptr(arguments[0], function),
                     [builder.gep(data(1), [arguments[2]]), data(3), data(4)])
        return context.get_dummy_value()

    return numba.types.void(numba.types.intp, given, numba.types.intp, felt, answers), code


if COMPILED:
    from numba.extending import intrinsic

    _call: Any = intrinsic(_code)
else:
    def _call(address: int, given: Array, first: int, felt: Array, answers: Array) -> None:
        _KNOWN[address](given[first:], felt, answers)


def ask(address: int, given: Array, first: int, felt: Array, answers: Array) -> None:
    """Fill in a law's answers.

    given    numbers of all laws, its own from ``first`` on
    felt     (FELT,) what it sees; answers (ANSWERS,)
    """
    _call(address, given, first, felt, answers)


if COMPILED:
    ask = numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(ask)
