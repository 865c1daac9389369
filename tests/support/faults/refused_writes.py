"""A command line whose disk refuses one of its changes, or all from one on: each of them, with one error after the
other, tried from the same older files.

The command runs up to its first change; there a process is split off for each trial, so what it computes it computes
once. Run as a program in a process of its own: ``python -m tests.support.faults.refused_writes FOLDER WORD...``.
"""

from __future__ import annotations

import errno
import importlib
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import NoReturn

from .disk_models import RefusingFiles

ERRORS = (errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EROFS)
OLDER = b"\n# older\n"
"""What is appended to the files of a run before, so that they are not what is written again."""
HEAVY = {".png": "matplotlib.figure", ".pdf": "matplotlib.figure", ".parquet": "pyarrow.parquet",
         "fleet": "pyarrow.parquet", ".gpkg": "pyogrio"}
"""What words of a command line load late, each a second or so."""
ROOT = Path(__file__).parents[3]
Content = dict[str, bytes | None]


def trials(place: Path, words: list[str]) -> dict[str, int]:
    """Run a command line in a folder, its disk refusing; give how often each kind of change was refused. Raises
    AssertionError with what was wrong."""
    done = subprocess.run([sys.executable, "-m", "tests.support.faults.refused_writes", str(place), *words], cwd=ROOT,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    assert not found["wrong"], "\n".join(found["wrong"][:5])
    counts: dict[str, int] = found["refused"]
    return counts


def content(place: Path) -> Content:
    """All files by name, and folders (None)."""
    return {str(path.relative_to(place)): path.read_bytes() if path.is_file() else None
            for path in sorted(place.rglob("*"))}


def grown_older(place: Path, before: Content) -> None:
    """Every file that is not as it was before becomes another one."""
    for name, data in content(place).items():
        if data is not None and before.get(name) != data:
            with (place / name).open("ab") as file:
                file.write(OLDER)


class Trials(RefusingFiles):
    """The disk of a command; at its first change everything is tried."""

    def __init__(self, place: Path) -> None:
        self.place, self.scratch = place, place.with_name(f"{place.name}-streams")
        self.kinds: list[str] = []
        self.is_trial = False
        self.refuses = self._look

    def _look(self, kind: str) -> bool:
        if not self.is_trial:
            self._explore()
        self.kinds.append(kind)
        return self.wanted(len(self.kinds))

    def wanted(self, number: int) -> bool:
        return False

    def _explore(self) -> None:
        """Returns in the processes that are split off alone."""
        older = content(self.place)
        if self._split(lambda number: False, 0):
            return
        good, status = self._ended()
        made = content(self.place)
        kinds = (self.scratch / "kinds").read_text().split()
        kept = {name: data for name, data in older.items() if not name.startswith(".ridelog-")}  # begun, to be gone
        wrong = [] if status == 0 and made != older else [f"without an error: {status} {good}"]
        refused: Counter[str] = Counter()
        for at, lasting in product(range(1, len(kinds) + 1), (False, True)):
            error = ERRORS[(at + 2 * lasting) % len(ERRORS)]
            self._lay_out(older)
            if self._split(lambda number, at=at, lasting=lasting: number >= at if lasting else number == at, error):
                return
            said, status = self._ended()
            refused[kinds[at - 1]] += 1
            more = [line for line in said if line not in good]
            now = content(self.place)
            if now != kept or status != 2 or len(more) != 1 or os.strerror(error) not in more[0]:
                which = sorted(name for name in now.keys() | kept.keys() if now.get(name, 0) != kept.get(name, 0))
                wrong.append(f"{kinds[at - 1]} {at} of {len(kinds)}, {errno.errorcode[error]}, lasting {lasting}: "
                             f"status {status}, said {more}, not as before: {which}")
        os.write(1, json.dumps({"refused": refused, "wrong": wrong}).encode())
        os._exit(0)

    def _split(self, wanted: Callable[[int], bool], error: int) -> bool:
        """True in the process that goes on; the other waits for its end."""
        self.scratch.mkdir(exist_ok=True)
        child = os.fork()
        if child:
            self.status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            return False
        self.is_trial, self.wanted, self.error = True, wanted, error  # type: ignore[method-assign]
        for stream, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(self.scratch / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), stream)
        return True

    def _ended(self) -> tuple[list[str], int]:
        return (self.scratch / "err").read_text().splitlines(), self.status

    def _lay_out(self, files: Content) -> None:
        for path in self.place.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        for name, data in files.items():
            if data is None:
                (self.place / name).mkdir()
            else:
                (self.place / name).write_bytes(data)


def _main(place: Path, words: list[str]) -> NoReturn:
    for ending, heavy in HEAVY.items():  # once, not in each trial
        if any(ending in word for word in words):
            importlib.import_module(heavy)
    from logger import files
    from logger.commands import main
    from logger.fleet import dataset

    os.chdir(place)
    disk = Trials(place)
    files.DISK = dataset.DISK = disk
    sys.argv = ["ridelog", *words]
    try:
        main.run()
    except SystemExit as leaving:
        (disk.scratch / "kinds").write_text(" ".join(disk.kinds))
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(int(leaving.code or 0))
    raise AssertionError


if __name__ == "__main__":
    _main(Path(sys.argv[1]), sys.argv[2:])
