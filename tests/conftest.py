"""Drives and the command, shared by the tests of the service and of the commands."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

# Small matrices: a second thread in the algebra library only waits for the first, badly so where tests run in parallel.
# Set before NumPy is imported, here and in every command that a test starts.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import pytest

if TYPE_CHECKING:
    from .support.drives.replay import Rows
    from .support.drives.simulated_drive import DemoDrive

# Byte code is kept, of the tests with their asserts and for the commands that they start: to make it again costs each
# worker 13 s of a processor and each command one.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_configure(config: pytest.Config) -> None:
    """A busy machine is no fault of an example; where slow tests are left out, 30 examples are enough of each rule."""
    few = "not slow" in config.option.markexpr
    hypothesis.settings.register_profile("any_machine", deadline=None, max_examples=30 if few else 100)
    hypothesis.settings.load_profile("any_machine")
    # No power fails while tests run: to wait for the disk costs 7 ms a file. What starts in a process of its own waits.
    os.fsync = lambda _descriptor: None


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests come first, so that at the end no processor waits for the last long one."""
    long = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in long)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """The tests themselves stay to the end: no search for garbage need go through them, nor while they are found."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


MANY_TESTS = 1000
"""So many together need the compiled loops for certain."""


@pytest.fixture(scope="session", autouse=True)
def machine_code(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> None:
    """The compiled loops are there before a worker's first test: to make both takes half a minute of a processor."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is not None and len(request.session.items) > MANY_TESTS:
        from .support.machine_code import make

        make(tmp_path_factory.getbasetemp().parent, int(worker.removeprefix("gw")))


@pytest.fixture
def folders_as_sticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder beside that of the logs counts as a stick, though it is on the same disk."""
    monkeypatch.setattr("logger.store.export.export.are_on_one_disk", lambda *_: False)


@pytest.fixture(scope="session")
def ridelog() -> Path:
    """The installed command."""
    return Path(sys.executable).with_name("ridelog")


@pytest.fixture(scope="session")
def short_drive() -> DemoDrive:
    """70 s: standing, a short loss of fix, a halt, a bump."""
    # Not above: the process that starts the workers needs none of it, and all of them wait for it.
    from .support.drives.short_drive import short

    return short()


@pytest.fixture(scope="session")
def short_rows(short_drive: DemoDrive) -> Rows:
    """What a service makes of it."""
    from .support.drives.replay import rows_of

    return rows_of(short_drive.header, short_drive.events)


@pytest.fixture(scope="session")
def short_dump(short_drive: DemoDrive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same drive as a recorded dump."""
    from .support.drives.simulated_drive import record

    path = tmp_path_factory.mktemp("drive") / "short.dump.gz"
    record(short_drive, path)
    return path
