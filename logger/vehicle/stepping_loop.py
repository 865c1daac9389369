"""The loop that steps a car with its laws, compiled where numba is there, and how it asks laws in Python.

It is plain numbers and arrays, so that it can be compiled (the ``lab`` extra), at its first use, and kept on disk; else
it runs as it stands. What the laws ask of a car, the travel and rate of each suspension and the deflection of each tire
and its rate (the ``seen``), is carried through a step beside the state. So the forces at the end of a step are tried on
these few numbers, and the state is taken on once. Matrices stand transposed and are as wide as the processor likes it.

Problem: a force by whatever moves at a wheel, with states of its own (``MotionLaw``), fits in no table, and the loop is
compiled before anybody wrote that law. Solution: each law is compiled by itself, once, to machine code with one and the
same signature, kept on disk too; the loop knows it by its address. Without numba the address is a number in a list.
Functions of one code and the same constants beside it are one: what differs from car to car they get as ``p``. Their
states are stepped by an exponential midpoint rule, each with its own decay, the motion at the mean of both ends of the
step: exact for a state that decays towards something, however quickly (M. Hochbruck, A. Ostermann, Exponential
integrators, Acta Numerica 19, 2010, 2.3). One that grows is stepped by the midpoint rule itself.
"""

import math
from collections import namedtuple
from collections.abc import Callable
from contextlib import suppress
from dis import get_instructions
from functools import cache
from hashlib import sha256
from itertools import count
from types import CodeType, FunctionType
from typing import Any

import numpy as np

from logger.arrays import Array, Whole
from logger.vehicle.laws import MOST_MEMORY, MotionLaw, Seen

try:
    import numba
    from numba.core.bytecode import FunctionIdentity
    from numba.core.caching import FunctionCache, IndexDataCacheFile
    from numba.core.ccallback import CFunc
    from numba.core.compiler_lock import global_compiler_lock
except ImportError:
    COMPILED = False
else:
    COMPILED = True

MEMORY_AT = len(Seen._fields) - 1
"""Where a law's states stand in what it feels: after all else that it sees."""
FELT = MEMORY_AT + MOST_MEMORY
"""Numbers that a law may feel: 14. Machine code holds it, and is kept on disk for as long as this file's text stays the
same: whoever changes ``MOST_MEMORY`` changes the number here."""
ANSWERS = MOST_MEMORY
"""Numbers that it answers with: the force, or how fast its states grow."""

_KNOWN: list[Callable[[Array, Array, Array], None]] = []
_KEPT: list[Any] = []  # compiled functions, which live as long as their addresses are known


def addresses_of(law: MotionLaw) -> list[int]:
    """How the loop knows a law's force, and its rates (0: none). ValueError as ``functions_of``, and for one that
    cannot be compiled."""
    names, memory, found = tuple(sorted(vars(law.p))), len(law.memory), []
    for one in functions_of(law):
        _FUNCTIONS[key := _identity(one)] = one
        found.append(_address(key, names, memory, one is law.rates))
    return [*found, 0][:2]


def functions_of(law: MotionLaw) -> list[Any]:
    """Its force, and its rates if it has states. ValueError for what is no function of (p, seen) and nothing else."""
    functions: list[Any] = [law.force] if law.rates is None else [law.force, law.rates]
    for word, one in zip(("force", "rates"), functions, strict=False):
        if not isinstance(one, FunctionType) or one.__closure__ or one.__defaults__ or one.__code__.co_argcount != 2:
            raise ValueError(f"expected {word} to be a function of (p, seen) at the top of the file, or a "
                             "@staticmethod, that gets its parameters by p alone")
    return functions


def numbers_in_order(law: MotionLaw) -> list[float]:
    """Its numbers in the order in which the loop hands them on."""
    return [value for _, value in sorted(vars(law.p).items())]


_Identity = tuple[CodeType, tuple[tuple[str, float], ...]]
_FUNCTIONS: dict[_Identity, Any] = {}


@cache
def _codes_and_globals(code: CodeType) -> tuple[list[CodeType], list[str]]:
    """The code with that of all functions in it, and names that they read of their module."""
    codes = [code]
    for each in codes:
        codes += [one for one in each.co_consts if isinstance(one, CodeType)]
    asked = (one for each in codes for one in get_instructions(each) if one.opname == "LOAD_GLOBAL")
    return codes, sorted({one.argval for one in asked})


def _read_beside(function: FunctionType) -> dict[str, Any]:
    """What a function reads of its module, by name."""
    _, names = _codes_and_globals(function.__code__)
    return {name: function.__globals__[name] for name in names if name in function.__globals__}


def _identity(function: FunctionType) -> _Identity:
    """A function's code, and what that reads beside it: numbers by their value, other things by which they are."""
    return function.__code__, tuple((name, one if isinstance(one, float | int) else id(one))
                                    for name, one in _read_beside(function).items())


@cache
def _address(key: _Identity, names: tuple[str, ...], memory: int, rates: bool) -> int:
    """Of a function of a law with these numbers and states: of its rates, or of its force."""
    numbers = namedtuple("numbers", names)  # type: ignore[misc]  # names are known only now
    if not COMPILED:
        _KNOWN.append(_plain(_FUNCTIONS[key], numbers, memory, rates))
        return len(_KNOWN) - 1
    compiled = _machine_code(_FUNCTIONS[key], numbers, memory, rates)
    _KEPT.append(compiled)
    return int(compiled.address)


def _plain(function: Any, numbers: Any, memory: int, rates: bool) -> Callable[[Array, Array, Array], None]:
    def answer(given: Array, felt: Array, answers: Array) -> None:
        p = numbers(*given[: len(numbers._fields)])
        seen = Seen._make([*felt[:MEMORY_AT], tuple(felt[MEMORY_AT : MEMORY_AT + memory])])
        answers[: memory if rates else 1] = function(p, seen)

    return answer


def _machine_code(function: Any, numbers: Any, memory: int, rates: bool = False) -> Any:
    from numba.np.unsafe import ndarray

    size, first = len(numbers._fields), MEMORY_AT
    # Compiled code alone calls these: ways in from Python and C would take half of the time.
    inside: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(**inside)
    law = FunctionType(function.__code__, function.__globals__)
    law.__module__ = __name__  # which a later process finds when it reads machine code; a learned law is in none
    own = compiled(law)
    pointer = numba.types.CPointer(numba.types.float64)
    of_array: Any = ndarray.to_fixed_tuple
    all_seen: Any = Seen

    @compiled
    def found(given: Any, felt: Any) -> Any:
        p = numbers(*of_array(numba.carray(given, (size,)), size))
        felt = numba.carray(felt, (FELT,))
        return own(p, all_seen(*of_array(felt[:first], first), of_array(felt[first : first + memory], memory)))

    def force(given: Any, felt: Any, answers: Any) -> None:
        answers[0] = found(given, felt)

    def growth(given: Any, felt: Any, answers: Any) -> None:
        grown = found(given, felt)
        for index in range(memory):
            answers[index] = grown[index]

    answer: Any = CFunc(growth if rates else force,
                        numba.core.sigutils.normalize_signature(numba.types.void(pointer, pointer, pointer)), {}, {})
    said = all_said(function)
    with global_compiler_lock:
        usual = FunctionIdentity._unique_ids
        try:
            if said is not None:
                digest = sha256(repr((said, numbers._fields, memory, rates, Seen._fields)).encode()).hexdigest()[:32]
                answer._cache = _LawCache(answer._pyfunc, "law-" + digest)
                # Numba counts from 1 on in each process what it compiles, and of two with one name takes either.
                FunctionIdentity._unique_ids = count(int(digest, 16))
            answer.compile()
        except numba.core.errors.NumbaError as error:
            why = next(line for line in str(error).splitlines() if line.strip() and not line.startswith("Failed in"))
            raise ValueError("expected force and rates to be plain arithmetic and numpy functions of numbers, which "
                             f"can be compiled: {why}") from None
        finally:
            FunctionIdentity._unique_ids = usual
    return answer


def all_said(function: FunctionType) -> str | None:
    """All that decides what a function does, where that is its own code, plain numbers and functions of NumPy."""
    codes, _ = _codes_and_globals(function.__code__)
    beside = _read_beside(function)
    if not all(isinstance(one, float | int) or one is np or one is math for one in beside.values()):
        return None
    return repr((beside, [(code.co_code, [one for one in code.co_consts if not isinstance(one, CodeType)],
                          code.co_names, code.co_varnames) for code in codes]))


if COMPILED:
    class _LawCache(FunctionCache):
        """Keeps machine code in a file of this name, beside that of the loops and like it for this processor alone."""

        def __init__(self, function: Any, name: str) -> None:
            super().__init__(function)
            self._cache_file = IndexDataCacheFile(self.cache_path, name, self._impl.locator.get_source_stamp())

        def _index_key(self, sig: Any, codegen: Any) -> Any:
            return sig, codegen.magic_tuple()

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            with suppress(Exception):  # whatever reading a file that was cut short ends with
                return super().load_overload(sig, target_context)
            with suppress(OSError):
                self.flush()
            return None

        def save_overload(self, sig: Any, data: Any) -> None:
            with suppress(OSError):  # a full disk
                super().save_overload(sig, data)


def _code(_context: Any, address: Any, given: Any, first: Any, felt: Any, answers: Any) -> Any:
    """Machine code that calls what lies at an address with pointers to the numbers from ``first`` on, and to the other
    two arrays."""
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        double = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [double] * 3).as_pointer()

        def data(index: int) -> Any:
            return context.make_array(signature.args[index])(context, builder, arguments[index]).data

        builder.call(builder.inttoptr(arguments[0], function), [builder.gep(data(1), [arguments[2]]), data(3), data(4)])
        return context.get_dummy_value()

    return numba.types.void(numba.types.intp, given, numba.types.intp, felt, answers), code


if COMPILED:
    from numba.extending import intrinsic

    _call: Any = intrinsic(_code)
else:
    def _call(address: int, given: Array, first: int, felt: Array, answers: Array) -> None:
        _KNOWN[address](given[first:], felt, answers)


def ask(address: int, given: Array, first: int, felt: Array, answers: Array) -> None:
    """Fill in a law's answers: its force, or its rates.

    given    numbers of all laws, its own from ``first`` on
    felt     (FELT,) what it sees; answers (ANSWERS,)
    """
    _call(address, given, first, felt, answers)


def _njit(function: Any, **options: Any) -> Any:
    """Machine code that is kept on disk, where there is a place for it."""
    options |= {"nogil": True, "error_model": "numpy"}
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # Numba found none
        return numba.njit(**options)(function)


if COMPILED:
    ask = _njit(ask, forceinline=True)


Asked = tuple[Whole, Array, Array, Array, Array, Array, Array, Array, Array]
"""L laws by all that moves: whole numbers (L, 6); their own numbers, one after the other; what they felt at the
beginning of a step (L, FELT); their states (L, MOST_MEMORY), those of rest at first; room for what one feels (FELT,),
feels in the middle of a step and how fast its states grow there (FELT + MOST_MEMORY,), and answers (ANSWERS,); the
places of the wheels (M, w) and the times (M,)."""


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """What runs in the loop and makes no arrays: it need not count who holds which, which would take most of its time.
    """
    inside = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # as laws are, above
    return _njit(function, forceinline=True, **inside) if COMPILED else function


def _compiled_with_arrays(function: Callable[..., Any]) -> Callable[..., Any]:
    return _njit(function) if COMPILED else function


TRAVEL_M, RATE_MPS = 0.4, 8.0
"""Tables of one variable reach from minus to plus this [m, m/s], and go on straight beyond."""
UNIT_M, UNIT_MPS = 0.01, 0.02
"""Tables of two variables are even in arsinh of travel and rate over these."""
LANES = 4
"""Numbers that are summed side by side."""
_PASSES = 2
_NEWTON_STEPS, _NEAR, _HARDLY = 4, 1e-3, 1e-9
_SWEEPS = 4  # a wheel that rubs on suspension and guide is so light that each friction changes what the other has to be
_SLIDES = 8.0  # tanh is 1 from there on, but for some ten-millionths
_SMALL_SHARE, _SMALL = 1e-6, 1e-9  # by so much of itself, and so much, a law's state is moved to see how it decays
_SLOW_DECAY = 1e-5


# Rows of the tables of one variable.
SPRING, DAMPER, MOUNT, TIRE = range(4)
# Columns of the numbers of a corner: whether it has these tables and one of two variables, and then
(PAIR, MOUNT_N_PER_M, MOUNT_LOW, MOUNT_PER_UNIT, DAMPING, TIRE_N_PER_M, TIRE_DAMPING, MOST_PULL_N,
 MOUNT_PLAY_M) = range(4, 13)
# Of what rubs: its force, how it grows with the rate, and at which share of a step it looks at it; and whole numbers,
# where its rate stands in the motion and at which suspension and tire it is recorded (-1: at none).
FRICTION_N, FRICTION_MPS, FRICTION_AT, STATIC_RATIO, STRIBECK_MPS = range(5)
RATE_ROW, ON_SUSPENSION, ON_TIRE = range(3)
# Whole numbers of a law: addresses of its force and rates, its wheel, what it acts on, where its numbers begin, and how
# many states it has.
FORCE, RATES, WHEEL, BETWEEN, FIRST, STATES = range(6)
BODY_AND_WHEEL, WHEEL_AND_GROUND = 0, 1


@_compiled
def _sum(result: Array, first: int, start: Array, by: Array, count: int, rows: Array) -> None:
    """Let the result, from ``first`` on, be the start and ``count`` rows, each times its number in ``by``."""
    for r in range(first, len(result)):
        result[r] = start[r]
    whole = count // LANES * LANES
    for c in range(0, whole, LANES):  # one by one, each would wait for the one before it to be stored
        p, q, s, u = by[c], by[c + 1], by[c + 2], by[c + 3]
        if p != 0.0 or q != 0.0 or s != 0.0 or u != 0.0:  # forces of laws that a car does not have
            for r in range(first, len(result)):
                result[r] += (p * rows[c, r] + q * rows[c + 1, r]) + (s * rows[c + 2, r] + u * rows[c + 3, r])
    for c in range(whole, count):
        number = by[c]
        if number != 0.0:
            for r in range(first, len(result)):
                result[r] += number * rows[c, r]


@_compiled
def _read(tables: Array, kind: int, i: int, low: float, per_unit: float, at: float) -> float:
    """The value of a table of corner i, on a straight line between its points and beyond them."""
    place = (at - low) * per_unit
    cell = min(max(int(place), 0), tables.shape[2] - 2)
    share = place - cell
    return tables[kind, i, cell] + share * (tables[kind, i, cell + 1] - tables[kind, i, cell])


@_compiled
def _read_pair(pairs: Array, i: int, travel: float, rate: float) -> float:
    """The value of a table of two variables, held at its edges."""
    _, rows, columns = pairs.shape
    row = (np.arcsinh(travel / UNIT_M) / np.arcsinh(TRAVEL_M / UNIT_M) + 1) * 0.5 * (rows - 1)
    column = (np.arcsinh(rate / UNIT_MPS) / np.arcsinh(RATE_MPS / UNIT_MPS) + 1) * 0.5 * (columns - 1)
    top = min(max(int(row), 0), rows - 2)
    left = min(max(int(column), 0), columns - 2)
    x = min(max(row - top, 0.0), 1.0)
    y = min(max(column - left, 0.0), 1.0)
    low = pairs[i, top, left] + y * (pairs[i, top, left + 1] - pairs[i, top, left])
    high = pairs[i, top + 1, left] + y * (pairs[i, top + 1, left + 1] - pairs[i, top + 1, left])
    return low + x * (high - low)


@_compiled
def _suspension(
    i: int, tables: Array, pairs: Array, numbers: Array, travel: float, rate: float, mounts: Array, step_s: float
) -> float:
    """What the laws of suspension i add to the linear ones, but for dry friction [N].

    mounts    (w, 3) of the mounts: compression and half a step of its rate, at the beginning of the step; compression
              and the dampers' own rates at its end, which are written here
    """
    per_unit = 0.5 * (tables.shape[2] - 1)
    force = 0.0
    if numbers[i, SPRING]:
        force += _read(tables, SPRING, i, -TRAVEL_M, per_unit / TRAVEL_M, travel)
    if numbers[i, PAIR]:
        force += _read_pair(pairs, i, travel, rate)
    if numbers[i, MOUNT]:
        stiffness, play = numbers[i, MOUNT_N_PER_M], numbers[i, MOUNT_PLAY_M]
        carried = mounts[i, 0] + 0.5 * step_s * rate
        # Within its play the damper stands still, and what it does beyond leaves the mount on that side.
        pressed = carried - min(max(carried, -play), play)
        mounts[i, 2] = _read(tables, MOUNT, i, numbers[i, MOUNT_LOW], numbers[i, MOUNT_PER_UNIT], stiffness * pressed)
        mounts[i, 1] = carried - 0.5 * step_s * mounts[i, 2]
        force += stiffness * (mounts[i, 1] - min(max(mounts[i, 1], -play), play)) - numbers[i, DAMPING] * rate
    elif numbers[i, DAMPER]:
        force += _read(tables, DAMPER, i, -RATE_MPS, per_unit / RATE_MPS, rate)
    return force


@_compiled
def _tire(i: int, tables: Array, numbers: Array, deflection: float, rate: float) -> float:
    """What the laws of tire i add to its linear spring [N]."""
    force = numbers[i, TIRE_DAMPING] * rate
    if numbers[i, TIRE]:
        force += _read(tables, TIRE, i, -TRAVEL_M, 0.5 / TRAVEL_M * (tables.shape[2] - 1), deflection)
    # A tire that cannot pull: the force on the road, static - k d - force, is at least 0.
    return min(force, numbers[i, MOST_PULL_N] - numbers[i, TIRE_N_PER_M] * deflection)


@_compiled
def _friction(free: float, ease: float, most: float, transition: float) -> float:
    """The friction F at a rate v = free - ease F: what stops it, up to ``most``; or most tanh(v / transition).

    Newton's steps from below the root of a rising, concave function come to it without passing it.
    """
    if transition <= 0.0:
        return min(max(free / ease, -most), most)
    size, pull = abs(free), ease * most
    if pull < _HARDLY * transition:  # it changes next to nothing of the rate
        return most * np.tanh(free / transition)
    if size - pull > _SLIDES * transition:
        return most if free > 0.0 else -most
    rate = max(size / (1.0 + pull / transition), size - pull)
    for _ in range(_NEWTON_STEPS):
        grown = 1.0 - 2.0 / (np.exp(2.0 * rate / transition) + 1.0)  # tanh, in half its time
        short = (size - rate - pull * grown) / (1.0 + pull / transition * (1.0 - grown * grown))
        rate += short
        if short < _NEAR * transition:
            break
    force = (size - rate) / ease
    return force if free > 0.0 else -force


@_compiled
def _rub(
    motion: Array, m: int, forces: Array, w: int, rubs: Array, rubs_at: Whole, by_force: Array, earlier: Array,
    sweeps: int,
) -> None:
    """Find the dry friction at the rates that each pair has a little after the middle of the step, and add what it does
    to what is seen. What the others do to a suspension's rate is so little that theirs of before serves for those that
    come after it; where a wheel rubs on its guide too, they are gone through in some ``sweeps``, until none changes.

    earlier    (f,) the rates at the beginning, as they count for that instant
    """
    count = len(rubs)
    for _ in range(sweeps):
        settled = True
        for i in range(count):
            row = rubs_at[i, RATE_ROW]
            free = motion[row] + earlier[i]
            for j in range(count):
                if j != i:
                    free += by_force[2 * w + j, row] * forces[2 * w + j]
            ease, most, at = -by_force[2 * w + i, row], rubs[i, FRICTION_N], rubs[i, FRICTION_AT]
            more, transition = most * (rubs[i, STATIC_RATIO] - 1.0), rubs[i, FRICTION_MPS] / at
            force = _friction(free, ease, most + more, transition)
            if more > 0.0:  # what is more at rest falls so little over the rate that a friction takes away in a step
                for _ in range(_PASSES):
                    slides = at * (free - ease * force) / rubs[i, STRIBECK_MPS]
                    force = _friction(free, ease, most + more * np.exp(-slides * slides), transition)
            settled = settled and abs(force - forces[2 * w + i]) <= _HARDLY * most
            forces[2 * w + i] = force
        if settled:
            break
    for i in range(count):
        for r in range(m, len(motion)):
            motion[r] += by_force[2 * w + i, r] * forces[2 * w + i]


@_compiled
def _feel(felt: Array, motion: Array, m: int, w: int, i: int, road: Array, place: float, clock: Array) -> None:
    """Fill in what a law sees of wheel i, but for its states."""
    felt[0], felt[1] = motion[m + i], motion[m + w + i]
    felt[2], felt[3] = motion[m + 2 * w + i] - road[i], motion[m + 3 * w + i] - road[w + i]
    felt[4], felt[5] = motion[m + 3 * w + i], motion[m + w + i] + motion[m + 3 * w + i]
    felt[6], felt[7], felt[8], felt[9] = place, clock[0], clock[1], clock[2]


@_compiled
def _remember(law: Whole, one: int, given: Array, began: Array, memories: Array, felt: Array, middle: Array,
              answers: Array, step_s: float) -> None:
    """Step the states of a law.

    began       (L, FELT) what each law felt at the beginning of the step, its states too
    memories    (L, MOST_MEMORY) states at its end, as far as they are known; written here
    felt        (FELT,) what it sees at its end
    middle      (FELT + MOST_MEMORY,) for what it feels at the mean of both, and how fast its states grow there
    """
    count = law[one, STATES]
    for c in range(MEMORY_AT):
        middle[c] = 0.5 * (began[one, c] + felt[c])
    for c in range(count):
        middle[MEMORY_AT + c] = 0.5 * (began[one, MEMORY_AT + c] + memories[one, c])
    ask(law[one, RATES], given, law[one, FIRST], middle, answers)
    for c in range(count):
        middle[FELT + c] = answers[c]
    for c in range(count):
        here, rate, start = middle[MEMORY_AT + c], middle[FELT + c], began[one, MEMORY_AT + c]
        small = _SMALL_SHARE * abs(here) + _SMALL
        middle[MEMORY_AT + c] = here + small
        ask(law[one, RATES], given, law[one, FIRST], middle, answers)
        middle[MEMORY_AT + c] = here
        growth = (answers[c] - rate) / small
        whole = growth * step_s
        if whole > 0.0:  # what grows steeply at one place only, as a root does at 0, would be thrown e to the many far
            memories[one, c] = start + step_s * rate
            continue
        share = 1.0 + 0.5 * whole if whole > -_SLOW_DECAY else np.expm1(whole) / whole
        memories[one, c] = start + step_s * share * (rate - growth * (here - start))


@_compiled
def _begin(motion: Array, m: int, w: int, asked: Asked, road: Array, k: int) -> None:
    """Keep what laws by all that moves feel at the beginning of step k."""
    law, _, began, memories, _, _, _, places, clock = asked
    for one in range(len(law)):
        _feel(began[one], motion, m, w, law[one, WHEEL], road, places[k, law[one, WHEEL]], clock[k])
        for c in range(law[one, STATES]):
            began[one, MEMORY_AT + c] = memories[one, c]


@_compiled
def _push(forces: Array, w: int, law: Whole, one: int, given: Array, felt: Array, answers: Array) -> None:
    """Add the force of a law that feels this."""
    i, between = law[one, WHEEL], law[one, BETWEEN]
    ask(law[one, FORCE], given, law[one, FIRST], felt, answers)
    # What pulls the body's end down is a pull between body and wheel and one on the wheel alone.
    if between != WHEEL_AND_GROUND:
        forces[i] += answers[0]
    if between != BODY_AND_WHEEL:
        forces[w + i] += answers[0]


@_compiled
def _answer(forces: Array, motion: Array, m: int, w: int, asked: Asked, road: Array, k: int, step_s: float) -> None:
    """Add the forces of laws by all that moves at the end of step k, and step their states."""
    law, given, began, memories, felt, middle, answers, places, clock = asked
    for one in range(len(law)):
        i = law[one, WHEEL]
        _feel(felt, motion, m, w, i, road, places[k + 1, i], clock[k + 1])
        if law[one, STATES]:
            _remember(law, one, given, began, memories, felt, middle, answers, step_s)
            for c in range(law[one, STATES]):
                felt[MEMORY_AT + c] = memories[one, c]
        _push(forces, w, law, one, given, felt, answers)


@_compiled
def _settle(
    motion: Array, m: int, before: Array, forces: Array, by_force: Array, tables: Array, pairs: Array, numbers: Array,
    passes: int, rubs: Array, rubs_at: Whole, sweeps: int, road: Array, mounts: Array, step_s: float, earlier: Array,
    asked: Asked, k: int,
) -> None:
    """Find the forces at the end of step k (2 w + f) from those at its beginning, and the motion there.

    before    (R,) the motion without these forces
    passes    how often the laws are asked: not at all if friction is all there is
    road      (2 w) its heights under the wheels and their rates
    """
    w = len(numbers)
    seen = m // LANES * LANES
    for _ in range(passes):
        _sum(motion, seen, before, forces, 2 * w, by_force)
        _rub(motion, m, forces, w, rubs, rubs_at, by_force, earlier, sweeps)
        for i in range(w):
            forces[i] = _suspension(i, tables, pairs, numbers, motion[m + i], motion[m + w + i], mounts, step_s)
            forces[w + i] = _tire(i, tables, numbers, motion[m + 2 * w + i] - road[i],
                                  motion[m + 3 * w + i] - road[w + i])
        _answer(forces, motion, m, w, asked, road, k, step_s)
    if len(rubs):
        _sum(motion, seen, before, forces, 2 * w, by_force)
        _rub(motion, m, forces, w, rubs, rubs_at, by_force, earlier, sweeps)
    _sum(motion, 0, before, forces, len(forces), by_force)


@_compiled
def _walk(
    by_known: Array, by_force: Array, step_s: float, tables: Array, pairs: Array, numbers: Array, around: Array,
    elevation: Array, states: Array, recorded: Array, known: Array, before: Array, nothing: Array, motion: Array,
    forces: Array, road: Array, mounts: Array, earlier: Array, passes: int, rubs: Array, rubs_at: Whole, sweeps: int,
    asked: Asked,
) -> None:
    """Fill in the states and what is recorded, from the first state on; the arrays after these are for keeping what a
    step needs."""
    count, m, w, u = len(elevation), states.shape[1], len(numbers), elevation.shape[1]
    for k in range(count - 1):
        _begin(motion, m, w, asked, road, k)
        for i in range(u):
            known[m + 2 * w + i] = around[k + 1, i]
            known[m + 2 * w + u + i] = 0.25 * (around[k + 2, i] - around[k, i])
        for i in range(w):
            road[i] = elevation[k + 1, i]
            road[w + i] = (around[k + 2, i] - around[k + 1, i]) / step_s
            mounts[i, 0] = mounts[i, 1] + 0.5 * step_s * (motion[m + w + i] - mounts[i, 2])
        for i in range(len(rubs)):
            earlier[i] = (1 / rubs[i, FRICTION_AT] - 1) * motion[rubs_at[i, RATE_ROW]]
        _sum(before, 0, nothing, known, m + 2 * w + 2 * u, by_known)
        _settle(motion, m, before, forces, by_force, tables, pairs, numbers, passes, rubs, rubs_at, sweeps, road,
                mounts, step_s, earlier, asked, k)
        for r in range(m):
            known[r] = motion[r]
            states[k + 1, r] = motion[r]
        for i in range(2 * w):
            known[m + i] = forces[i]
            recorded[k + 1, i] += forces[i]
        # Dry friction is the mean over a step: at an instant it is half that of the step before, half of the next.
        for i in range(len(rubs)):
            for column in (rubs_at[i, ON_SUSPENSION], rubs_at[i, ON_TIRE]):
                if column >= 0:
                    recorded[k, column] += 0.5 * forces[2 * w + i]
                    recorded[k + 1, column] += 0.5 * forces[2 * w + i]


@_compiled_with_arrays
def steps(
    by_known: Array, by_force: Array, step_s: float, tables: Array, pairs: Array, numbers: Array, rubs: Array,
    rubs_at: Whole, asked: Asked, start: Array, m: int, around: Array, elevation: Array,
) -> tuple[Array, Array]:
    """States (M, 2 n) and forces of the laws (M, 2 w); see ``stepping.march``.

    The motion (R,) of the linear car is its state, what is seen (4 w: travels, rates, heights of the wheels, rates of
    these; where the body rubs on a guide, w rates of its ends too), and 0 up to the next number of whole ``LANES``.

    by_known     (2 n + 2 w + 2 u, R) the motion at the end of a step by the state and the laws' forces at its
                 beginning, and the mean of each input (the road's heights first, then forces) and how far it rises
                 from the middle of the step to its end
    by_force     (2 w + f, R) the same by the laws' forces at the end, then by dry friction
    tables       (4, w, points) laws of one variable; pairs (w, travels, rates) of two; numbers (w, 12)
    rubs         (f, 3) numbers of what rubs; rubs_at (f, 3) its places
    asked        laws by all that moves
    start        (R,) the first motion, of which m make the state
    around       (M + 1, u) means of the inputs before, in and after the steps
    elevation    (M, u) inputs at the instants
    """
    count, w = len(elevation), len(numbers)
    states, recorded = np.zeros((count, m)), np.zeros((count, 2 * w))
    states[0] = start[:m]
    known, before = np.zeros(len(by_known)), np.zeros(by_known.shape[1])
    known[:m] = start[:m]
    road = np.concatenate((elevation[0, :w], (around[1, :w] - around[0, :w]) / step_s))
    acts = (numbers[:, : PAIR + 1].any() or numbers[:, TIRE_DAMPING].any() or len(asked[0]) > 0
            or not np.isinf(numbers[:, MOST_PULL_N]).all())
    passes = _PASSES if acts else 0
    sweeps = 1 if len(rubs) < 2 or (rubs_at[:, ON_TIRE] < 0).all() else _SWEEPS
    mounts = np.zeros((w, 3))
    if passes:  # what the laws do in the state that it begins in, to a mount that is at rest
        begun = np.zeros(2 * w)
        for i in range(w):
            begun[i] = _suspension(i, tables, pairs, numbers, start[m + i], start[m + w + i], mounts, 0.0)
            begun[w + i] = _tire(i, tables, numbers, start[m + 2 * w + i] - road[i], start[m + 3 * w + i] - road[w + i])
        law, given, began, _, _, _, answers, _, _ = asked
        _begin(start, m, w, asked, road, 0)
        for one in range(len(law)):
            _push(begun, w, law, one, given, began[one], answers)
        known[m : m + 2 * w] = begun
        recorded[0] = begun
    _walk(by_known, by_force, step_s, tables, pairs, numbers, around, elevation, states, recorded, known, before,
          np.zeros_like(before), start.copy(), np.zeros(len(by_force)), road, mounts, np.zeros(len(rubs)),
          passes, rubs, rubs_at, sweeps, asked)
    return states, recorded
