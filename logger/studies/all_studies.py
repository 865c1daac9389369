"""Many studies at once, on all cores; one that fails is reported, and the others still run.

Each process has one study at a time and one thread of linear algebra, so that the cores are neither idle nor fought
over.
"""

import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from time import perf_counter

from logger.errors import RidelogError
from logger.studies.study import Result, Study, Workload, studies

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Carried:
    """A study that was carried out: its result, or None with what went wrong; how long it took [s]."""

    result: Result | None
    failure: str
    seconds: float


def carry_out(name: str, share: float) -> Carried:
    """One study, by the name that people write, with a share of the full effort (``Workload.share``)."""
    began = perf_counter()
    study = studies()[name]
    result = study.run(Workload(share))
    return Carried(result, study.differs(result), perf_counter() - began)


def carry_out_all(chosen: Sequence[Study], share: float) -> Iterator[tuple[Study, Carried]]:
    """Each study and what became of it, as they finish."""
    kept = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read by numpy when a process begins
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        with ProcessPoolExecutor(max(1, min(cores, len(chosen))), get_context("spawn"), _ends_when_interrupted) as pool:
            by_future = {pool.submit(carry_out, one.called, share): one for one in chosen}
            for future in as_completed(by_future):
                error = future.exception()
                yield by_future[future], Carried(None, _said(error), 0.0) if error else future.result()
    finally:
        for name, value in kept.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _ends_when_interrupted() -> None:
    """A process that catches an interrupt would go on with the next study."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _said(error: BaseException) -> str:
    """What a person reads: of an error of ours its sentence, of any other its kind, too."""
    return str(error) if isinstance(error, RidelogError) else f"{type(error).__name__}: {error}"
