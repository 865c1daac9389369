"""Hostile input: how valid examples are damaged, and what every reader owes its users.

A reader is run in the process on one input at a time. It must end in time, in little memory, and either accept the
input or refuse it with an error of its own family, in one line that names the file. What it accepted must be in the
bytes; how that is known differs from reader to reader (``targets``).

Guidance without instrumentation: every refusal has a place in the sources (the lines of its traceback), every
acceptance a shape. An input that ends somewhere new is kept and damaged further, so the search walks from check to
check into the reader.
"""

from __future__ import annotations

import logging
import random
import re
import resource
import signal
import time
import warnings
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from drivers.errors import DriverError
from logger.errors import BadInput

LIMIT_S = 2.0  # of work of the processor, so that a busy machine makes no difference
MEMORY_BYTES = 500 << 20  # more than the process has when it begins
LARGEST_BYTES = 60_000
LONGEST_COMPLAINT = 600
KEPT = 2000
COMMON_TOKENS = (
    b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n", b"\r\n", b"\x1a", b"\x7f", b"\t", b",", b";", b":", b"|", b"*",
    b"$", b"#", b'"', b"'", b"-", b"+", b".", b"..", b"e", b"0", b"-0", b"-1", b"1", b"1e308", b"1e-320", b"1e999",
    b"-1e999", b"nan", b"inf", b"-inf", b"NaN", b"None", b"null", b"0x7fffffff", b"2147483648", b"9223372036854775808",
    b"18446744073709551616", b"9" * 40, b"9" * 400, b"9" * 5000, b"0" * 300, b"1_0", "²".encode(), "١".encode(),
    "Ω".encode(), "\u2028".encode(), "\U0001f697".encode(), b"\xed\xa0\x80", b"\xc0\x80", b"A" * 300, b"A" * 5000,
    b"../" * 20, b"/dev/zero", b"%s%n", b"[", b"]", b"{", b"}", b"[" * 200, b"{" * 200,
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")
_LINE = re.compile(r"(\S+) +(\d+) inputs +(\d+) accepted +(\d+) refused +(\d+) ends +slowest (\S+) s +"
                   r"memory \+(\S+) MB +(\d+)/s +(\d+) broken")


class ViolationError(AssertionError):
    """A reader broke a promise."""


class TooSlowError(BaseException):
    """The time limit of one input; no reader catches it."""


@dataclass(frozen=True)
class Target:
    """One reader.

    examples    valid inputs
    read        takes the input and a source of chance; gives the shape of what was accepted; raises an error of the
                declared families, or ``ViolationError``
    tokens      words of the format
    mend        makes check values right again, where the format has some
    file        the name that complaints must begin with; "" when there are no complaints with names
    damage      of one valid example, where it knows the format (``fields``); None: of bytes, anywhere
    limit_s     of work for one input [s]
    """

    name: str
    examples: Sequence[bytes]
    read: Callable[[bytes, random.Random], Hashable]
    tokens: Sequence[bytes] = ()
    mend: Callable[[bytes], bytes] | None = None
    file: str = ""
    damage: Callable[[random.Random, bytes], bytes] | None = None
    limit_s: float = LIMIT_S


@dataclass
class Tally:
    """What came of some inputs."""

    inputs: int = 0
    accepted: int = 0
    refused: int = 0
    places: int = 0
    slowest_s: float = 0.0
    memory_mb: float = 0.0
    failures: list[tuple[str, bytes]] = field(default_factory=list)
    without_line: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class Counts:
    """What runs of one reader have counted. ``ends``, ``slowest_s`` and ``memory_mb`` are those of the largest."""

    inputs: int = 0
    accepted: int = 0
    refused: int = 0
    ends: int = 0
    slowest_s: float = 0.0
    memory_mb: float = 0.0
    seconds: float = 0.0
    broken: int = 0

    @classmethod
    def of(cls, tally: Tally, seconds: float) -> Counts:
        """Those of one run."""
        return cls(tally.inputs, tally.accepted, tally.refused, tally.places, tally.slowest_s, tally.memory_mb, seconds,
                   len(tally.failures))

    def plus(self, other: Counts) -> Counts:
        """Both runs together."""
        return Counts(self.inputs + other.inputs, self.accepted + other.accepted, self.refused + other.refused,
                      max(self.ends, other.ends), max(self.slowest_s, other.slowest_s),
                      max(self.memory_mb, other.memory_mb), self.seconds + other.seconds, self.broken + other.broken)

    def line(self, name: str) -> str:
        """For people, and for ``read_counts``."""
        return (f"{name:20} {self.inputs:8} inputs {self.accepted:8} accepted {self.refused:8} refused "
                f"{self.ends:4} ends  slowest {self.slowest_s:.2f} s  memory +{self.memory_mb:.0f} MB  "
                f"{self.inputs / max(self.seconds, 1e-3):.0f}/s  {self.broken} broken")


def read_counts(text: str) -> dict[str, Counts]:
    """Sums by reader, in order of their first lines."""
    sums: dict[str, Counts] = {}
    for name, inputs, accepted, refused, ends, slowest_s, memory_mb, rate, broken in _LINE.findall(text):
        one = Counts(int(inputs), int(accepted), int(refused), int(ends), float(slowest_s), float(memory_mb),
                     int(inputs) / max(int(rate), 1), int(broken))
        sums[name] = sums.get(name, Counts()).plus(one)
    return sums


def fuzz(target: Target, seed: int, inputs: int, until_s: float = float("inf")) -> Tally:
    """Run a reader on so many damaged inputs, or until a monotonic time."""
    rng = random.Random(f"{target.name} {seed}")
    corpus = list(target.examples)
    seen: set[Hashable] = set()
    tally = Tally()
    for data in target.examples:  # what is loaded once is not the input's memory
        _one(target, data, rng, Tally())
    begun_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    earlier = signal.signal(signal.SIGPROF, _too_slow)
    with warnings.catch_warnings(), _bounded_memory(), _without_logging():
        warnings.simplefilter("error")
        try:
            for number in range(inputs):
                if time.monotonic() >= until_s:
                    break
                data = target.examples[number] if number < len(target.examples) else damaged(rng, corpus, target)
                place = _one(target, data, rng, tally)
                if place not in seen:
                    seen.add(place)
                    if len(corpus) < KEPT and len(data) <= LARGEST_BYTES // 4:
                        corpus.append(data)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.signal(signal.SIGPROF, earlier)
    tally.places = len(seen)
    tally.memory_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - begun_kb) / 1024
    return tally


def _one(target: Target, data: bytes, rng: random.Random, tally: Tally) -> Hashable:
    """Run one input; give the place in the sources where it ended."""
    tally.inputs += 1
    began_s = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, target.limit_s)
    place: Hashable
    try:
        place = ("accepted", target.read(data, rng))
        tally.accepted += 1
    except (BadInput, DriverError) as error:
        tally.refused += 1
        place = _lines(error)
        fault = _bad_complaint(str(error), target.file)
        if fault:
            tally.failures.append((f"{fault}: {str(error)[:300]!r}", data))
        elif target.file and not re.match(rf"{re.escape(target.file)}:\d+: ", str(error)):
            tally.without_line.add(re.sub(r"\d+", "9", str(error))[:100])
    except (Exception, TooSlowError) as error:  # noqa: BLE001 - this is what is being looked for
        place = (type(error).__name__, _lines(error))
        if len(tally.failures) < 200:
            tally.failures.append((f"{type(error).__name__}: {str(error)[:300]} at {_lines(error)[-1:]}", data))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    tally.slowest_s = max(tally.slowest_s, time.process_time() - began_s)
    return place


@contextmanager
def _bounded_memory() -> Iterator[None]:
    """Let the process ask for ``MEMORY_BYTES`` more than it has, and for no byte beyond."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    has = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (has + MEMORY_BYTES, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@contextmanager
def _without_logging() -> Iterator[None]:
    """What a service says of a damaged file goes into its log; here it would be a million lines."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _too_slow(number: int, frame: FrameType | None) -> None:
    raise TooSlowError("not done in time")


def _lines(error: BaseException) -> tuple[tuple[str, int], ...]:
    """Where it was raised: files and lines of the traceback, the innermost last."""
    found = []
    trace = error.__traceback__
    while trace is not None:
        found.append((trace.tb_frame.f_code.co_filename.rsplit("/", 1)[-1], trace.tb_lineno))
        trace = trace.tb_next
    return tuple(found[1:])


def _bad_complaint(text: str, file: str) -> str:
    """What is wrong with a complaint; "" when it is one clear line that begins with the file."""
    if not text.startswith(file):
        return "does not begin with the file"
    if not text.isprintable():
        return "holds line ends or characters that cannot be shown"
    return "is too long" if len(text) > LONGEST_COMPLAINT else ""


def damaged(rng: random.Random, corpus: Sequence[bytes], target: Target) -> bytes:
    """A valid or an already damaged example with some more damage; half of the time its check values are mended."""
    if target.damage is not None:
        data = target.damage(rng, rng.choice(target.examples))
        return target.mend(data) if target.mend is not None and rng.random() < 0.9 else data
    newest = len(corpus) - 1 - min(int(rng.expovariate(0.1)), len(corpus) - 1)
    data = corpus[newest if rng.random() < 0.3 else rng.randrange(len(corpus))]
    for _ in range(1 + min(int(rng.expovariate(0.7)), 8)):
        data = rng.choice(_DAMAGES)(rng, data, corpus, target)[:LARGEST_BYTES]
    return target.mend(data) if target.mend is not None and rng.random() < 0.5 else data


def _token(rng: random.Random, target: Target) -> bytes:
    return rng.choice(target.tokens) if target.tokens and rng.random() < 0.6 else rng.choice(COMMON_TOKENS)


def _span(rng: random.Random, size: int) -> tuple[int, int]:
    start = rng.randrange(size + 1)
    return start, min(size, start + min(int(rng.expovariate(0.08)), size))


def _flip_bits(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    out = bytearray(data or b"\0")
    for _ in range(min(1 + int(rng.expovariate(1.0)), len(out))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _set_bytes(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    start, end = _span(rng, len(data))
    return data[:start] + rng.randbytes(end - start) + data[end:]


def _cut_out(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    start, end = _span(rng, len(data))
    return data[:start] + data[end:]


def _truncate(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _insert(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + _token(rng, target) + data[at:]


def _overwrite(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    start, end = _span(rng, len(data))
    return data[:start] + _token(rng, target) + data[end:]


def _repeat(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    start, end = _span(rng, len(data))
    times = rng.choice((2, 2, 3, 10, 100)) if rng.random() < 0.97 else 5000
    return data[:start] + data[start:end] * times + data[end:]


def _splice(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    other = rng.choice(corpus)
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def _another_number(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    numbers = list(_NUMBER.finditer(data))
    if not numbers:
        return data
    number = rng.choice(numbers)
    wild = f"{rng.uniform(1, 10):.3g}e{rng.randrange(-330, 330)}".encode()
    choices = (_token(rng, target), str(rng.randrange(-10, 300)).encode(), wild, b"-" + number[0], number[0] + b"0",
               number[0][1:])
    return data[: number.start()] + rng.choice(choices) + data[number.end() :]


def _another_line(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, rng.choice(lines))
        case 2:
            lines[at] = _token(rng, target)
        case _:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
    return b"\n".join(lines)


def _another_field(rng: random.Random, data: bytes, corpus: Sequence[bytes], target: Target) -> bytes:
    fields = re.split(rb"([,: \n])", data)
    at = rng.randrange(0, len(fields), 2)
    fields[at] = rng.choice((b"", _token(rng, target), rng.choice(fields[::2])))
    return b"".join(fields)


_DAMAGES = (
    _flip_bits, _set_bytes, _cut_out, _truncate, _insert, _overwrite, _repeat, _splice, _another_number,
    _another_number, _another_line, _another_field, _another_field,
)
