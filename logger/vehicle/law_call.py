"""A law that is written in Python, asked number by number from a compiled loop.

Problem: a force by whatever moves at a wheel, with states of its own, fits in no table, and the loop that steps a car
is compiled once and kept on disk, before anybody wrote that law. Solution: each law is compiled by itself, once, to
machine code with one and the same signature; the loop knows it by its address. Without numba the address is a number
in a list, and the law runs as it stands.

A law's functions are distinguished by their code, so they get all that they need as ``p`` and hold nothing else.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from functools import cache
from types import CodeType, FunctionType
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.vehicle.laws import MOST_MEMORY, MotionLaw, Seen

Array = npt.NDArray[np.float64]

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
