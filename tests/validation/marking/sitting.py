"""One case put before the lab, and all that it said.

Problem: what is examined is what a user gets, not what a function returns. Solution: the case is written to a folder,
``ridelog diagnose`` is asked, the effects that it names are added with ``ridelog add-effect``, and what both print goes
into one record beside the truth, with the time and the memory they took.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import Any

import yaml

from ..cases.case_files import write_case
from ..cases.random_case import Case, case
from ..cases.visibility import remainders

Record = dict[str, Any]

PACKAGE = Path(__file__).resolve().parents[3] / "logger"
LONGEST_S = 900.0
_KEPT = 6


@dataclass(frozen=True, order=True)
class Question:
    """Which case."""

    kind: str
    seed: int


class NoAnswer(Exception):
    """The command failed; the text is what it said."""


def sit(question: Question, in_process: bool = False) -> Record:
    """Make a case, put it before the lab, and record what was said.

    in_process    call the command's function instead of starting it: quicker by a second, without its memory
    """
    made = case(question.kind, question.seed)
    return {**vars(question), "left": remainders(made), **examined(made, in_process)}


def examined(made: Case, in_process: bool) -> Record:
    """What the lab says of a case."""
    source = fingerprint()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record: Record = {"truth": write_case(made, folder), "source": source, "said": None, "added": None,
                          "failed": None}
        runs = [str(folder / f"run{number}") for number in range(1, len(made.recordings) + 1)]
        try:
            said, record["diagnosing"] = asked(
                ["diagnose", "--json", "--vehicle", str(folder / "vehicle.yaml"), *runs], in_process)
            record["said"] = kept_of(said)
            record["added"] = added(folder, runs, said, in_process)
        except NoAnswer as error:
            record["failed"] = str(error)
    return record


def fingerprint() -> str:
    """Of the package's source text, so that a report can tell whether all cases met the same program."""
    found = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        found.update(path.read_bytes())
    return found.hexdigest()[:10]


def kept_of(said: Record) -> Record:
    """The part of a diagnosis that is judged or reported."""
    candidates = [{key: one[key] for key in ("effect", "parameters", "error", "p_value", "confused_with")}
                  for one in said["candidates"][:_KEPT]]
    return {key: said[key] for key in ("baseline_error", "noise_floor_error", "verdict", "unexplained")} | {
        "candidates": candidates}


def added(folder: Path, runs: Sequence[str], said: Record, in_process: bool) -> Record | None:
    """The vehicle after the effects of a verdict were added one after the other, from the values that were found."""
    before, after = folder / "vehicle.yaml", None
    seconds = 0.0
    found = {one["effect"]: one["parameters"] for one in said["candidates"]}
    for number, name in enumerate(said["verdict"]):
        values = ",".join(f"{key}={value!r}" for key, value in found[name].items())
        out = folder / f"with-{number}.yaml"
        after, cost = asked(["add-effect", f"{name}:{values}" if values else name, "--json", "--vehicle", str(before),
                              "--out", str(out), *runs], in_process)
        before, seconds = out, seconds + cost["cpu_s"]
    if after is None:
        return None
    effects = yaml.safe_load(before.read_text("utf-8"))["effects"]
    return {"error_after": after["error_after"], "cpu_s": seconds, "effects": effects}


# --- asking ---------------------------------------------------------------------------------------------------------

def asked(arguments: list[str], in_process: bool) -> tuple[Record, dict[str, float]]:
    """What a command printed as JSON, and what it took. NoAnswer where it failed."""
    return _called(arguments) if in_process else _started(arguments)


def _started(arguments: list[str]) -> tuple[Record, dict[str, float]]:
    """What a command printed as JSON, and what it took."""
    command = [str(Path(sys.executable).with_name("ridelog")), *arguments]
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        begun = time.monotonic()
        process = subprocess.Popen(command, stdout=out, stderr=err)
        timer = Timer(LONGEST_S, process.kill)
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        wall_s = time.monotonic() - begun
        for file in (out, err):
            file.seek(0)
        if process.returncode != 0:
            words = err.read().decode("utf-8", "replace").strip().splitlines()
            raise NoAnswer(f"{arguments[0]} ended with {process.returncode}: {words[-1] if words else 'no word'}")
        return json.loads(out.read()), {"wall_s": wall_s, "cpu_s": usage.ru_utime + usage.ru_stime,
                                        "peak_mb": usage.ru_maxrss * 1024 / 1e6}


def _called(arguments: list[str]) -> tuple[Record, dict[str, float]]:
    """The same within this process."""
    from logger.commands.main import main
    from logger.errors import RidelogError

    out = io.StringIO()
    wall_s, cpu_s = time.monotonic(), time.process_time()
    try:
        with contextlib.redirect_stdout(out):
            main(arguments)
    except RidelogError as error:
        raise NoAnswer(f"{arguments[0]}: {error}") from None
    return json.loads(out.getvalue()), {"wall_s": time.monotonic() - wall_s, "cpu_s": time.process_time() - cpu_s}
