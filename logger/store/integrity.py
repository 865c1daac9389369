"""Is what lies on the disk what was written? Checks of segment logs and recorded dumps.

Problem. A card or a copy may have damaged a file anywhere, or cut it; a file may be open while it is looked at.
Solution. Every record is read the way every other reader reads it. A row that does not fit its check value is corrupt,
a last one without its end is torn. Rows that are missing show as a gap: segment numbers count up by one through a
session, from file to file, and times never go back. The sidecar of a finished log says how many rows it had, so that a
file cut neatly between two rows shows too. A part, of a log or of a recording, that ends in a torn row is simply open.
A stick that logs were exported to is compared with the manifest that lies beside them, and has to have one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from drivers.disk import open_regular
from drivers.dump import ACCELEROMETERS, LINE_BYTES, intact_bytes, open_dump
from drivers.errors import DumpError
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.store.export import manifest
from logger.store.export.directory_handle import DirectoryHandle
from logger.store.export.manifest import is_of_export, read_manifest
from logger.store.log.log_name import finished_path, inside_of, log_name, name_before, open_path
from logger.store.log.log_reader import other_recordings
from logger.store.log.row_format import Row, scan
from logger.store.log.sidecar import SETTINGS_LOST, Hole, are_in_holes, read_sidecar, repairs_of
from logger.units import US_PER_S

DUMP_ENDINGS = (".dump", ".dump.gz")
OPEN_DUMP_ENDINGS = (".dump.part", ".dump.gz.part")
SILENCE_US = US_PER_S
"""An accelerometer that says nothing for longer has left a gap in a dump: reported, and no damage of the file."""

SHOWN_PROBLEMS = 20  # Most problems that are kept in words for one file; all are counted
_DUMP_START = b"# ridelog-dump "


@dataclass
class FileCheck:
    """What was found in one file.

    kind               ``log``, ``dump`` or ``manifest``
    state              ``finished``, ``open`` (a part: the service may be writing to it), ``dump`` or ``manifest``
    records_good       rows or events that are as they were written
    records_torn       1 when the file ends in the middle of one
    records_corrupt    lines that are damaged; a dump is read up to the first
    gaps               places where records are missing or time goes back; where an accelerometer said nothing
    problems           the first ``SHOWN_PROBLEMS`` of what is wrong, in words, each with its line
    notes              what is not wrong and should be known, as many at most
    ok                 nothing is wrong
    """

    path: Path
    kind: str
    state: str
    records_good: int = 0
    records_torn: int = 0
    records_corrupt: int = 0
    gaps: int = 0
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        return not self.problems

    def wrong(self, problem: str) -> None:
        if len(self.problems) < SHOWN_PROBLEMS:
            self.problems += (problem,)

    def note(self, words: str) -> None:
        if len(self.notes) < SHOWN_PROBLEMS:
            self.notes += (words,)


@dataclass
class _Log:
    """What is found in one log, the records at its ends, damaged lines beyond them, holes that a repair left."""

    check: FileCheck
    first: WindowRecord | None = None
    last: WindowRecord | None = None
    damaged_before_first: int = 0
    damaged_since_last: int = 0
    holes: tuple[Hole, ...] = ()


def verify(paths: Iterable[Path]) -> list[FileCheck]:
    """Check files, and the logs, dumps and manifests inside folders (at any depth), in order of their names.

    A service may write to a folder meanwhile: what it finishes is checked as what it has become, what it removes to
    make room is left out, and what it begins is too new. Raises ``BadInput`` for a path that is not there, a file that
    is none of these, or a folder without any.
    """
    paths = list(paths)
    found = dict.fromkeys(file for path in paths for file in _files_of(path))
    logs: dict[Path, _Log] = {}
    checks: dict[Path, FileCheck] = {}
    for path in found:
        _check(path, logs, checks)
    newest = max((place for path in found if (place := _place(path))), default=(0, 0))
    now = dict.fromkeys(file for path in paths for file in _files_of(path))
    for path in now:
        if path not in found and (open_path(path) in found or ((place := _place(path)) and place <= newest)):
            _check(path, logs, checks)
    for path in logs.keys() - now.keys():
        del logs[path]
    _compare_neighbours(logs)
    checks |= {path: one.check for path, one in logs.items()}
    return [checks[path] for path in now if path in checks]


def _check(path: Path, logs: dict[Path, _Log], checks: dict[Path, FileCheck]) -> None:
    """Check one file; nothing for one that is not there any more."""
    try:
        if path.name == manifest.NAME:
            checks[path] = _check_manifest(path)
        elif _is_dump(path):
            checks[path] = _check_dump(path)
        else:
            logs[path] = _check_log(path)
    except FileNotFoundError:
        return
    except OSError as error:
        raise BadInput(f"{path}: expected a readable file, but: {error.strerror}") from error


def _place(path: Path) -> tuple[int, int] | None:
    """Where a log stands among those of its folder."""
    name = log_name(path)
    return (name.session, name.part) if name else None


def _files_of(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    if (finished := finished_path(path)).is_file():
        return [finished]
    if not path.is_dir():
        raise BadInput(f"{path}: expected a log, a dump or a folder of them; there is no such file")
    inside = [path, *inside_of(path)]
    files = {file for file in inside if file.is_file() and (log_name(file) or file.name == manifest.NAME
                                                            or file.name.endswith((*DUMP_ENDINGS, *OPEN_DUMP_ENDINGS)))}
    files |= set(other_recordings(inside))
    # An export without its manifest cannot be checked: one that is not there is looked for all the same.
    files |= {folder / manifest.NAME for folder in inside if folder.is_dir() and is_of_export(folder.resolve())}
    if not files:
        raise BadInput(f"{path}: expected logs or dumps in this folder, found none")
    return sorted(files)


def _is_part(path: Path) -> bool:
    return path.suffix == ".part"


def _is_dump(path: Path) -> bool:
    if (name_before(path.name) or path.name).endswith((*DUMP_ENDINGS, *OPEN_DUMP_ENDINGS)):
        return True
    with open_regular(path) as file:
        return file.read(len(_DUMP_START)) == _DUMP_START


def _check_log(path: Path) -> _Log:
    findings = FileCheck(path, "log", "open" if _is_part(path) else "finished")
    lines = 0
    sidecar = None if _is_part(path) else _load_sidecar(path, findings)
    log = _Log(findings, holes=repairs_of(sidecar).holes if sidecar else ())
    with open_regular(path) as file:
        for row in scan(file):
            lines += 1
            _take_row(log, row, _is_part(path))
    empty = not path.stat().st_size
    if not findings.records_good and not log_name(path) and (lines or empty):
        raise BadInput(f"{path}:1: expected a segment log or a recorded dump, found no row of one")
    if (before := name_before(path.name)) is not None:
        findings.note(f"an export renamed it from {before}, as another log had that name: it is a different drive")
    if not _is_part(path):
        if empty:
            findings.wrong("line 1: torn: expected the header line of a segment log")
        if sidecar is not None:
            _compare_with_sidecar(sidecar, findings)
    return log


def _take_row(log: _Log, row: Row, is_open: bool) -> None:
    """Count one row; in an open file a torn one is as it should be."""
    findings = log.check
    if row.record is None:
        log.damaged_since_last += 1
        if row.torn:
            findings.records_torn += 1
        else:
            findings.records_corrupt += 1
        if not (row.torn and is_open):
            findings.wrong(f"line {row.number}: {'torn' if row.torn else 'corrupt'}: {row.problem}")
        return
    if row.torn and not is_open:
        findings.wrong(f"line {row.number}: torn: expected a newline at the end of a finished log")
    findings.records_good += 1
    if log.last is None:
        log.first = row.record
        log.damaged_before_first = log.damaged_since_last
    else:
        _compare(findings, log.last, row.record, log.damaged_since_last, f"line {row.number}", log.holes)
    log.last = row.record
    log.damaged_since_last = 0


def _compare(findings: FileCheck, before: WindowRecord, after: WindowRecord, damaged: int, place: str,
             holes: Sequence[Hole]) -> None:
    """Note a gap between two records that should follow each other, but for as many damaged lines between them and for
    the holes that repairs have left."""
    follows = 1 <= after.segment - before.segment <= damaged + 1
    missing = before.segment + 1, after.segment - 1
    is_hole = not follows and missing[0] <= missing[1] and are_in_holes(*missing, holes)
    if is_hole:
        findings.note(f"{place}: segments {missing[0]} to {missing[1]} were damaged: a repair has left them out")
    if not (follows or is_hole):
        findings.gaps += 1
        findings.wrong(f"{place}: gap: expected segment {before.segment + 1}, found {after.segment}")
    elif after.t_us < before.t_us:
        findings.gaps += 1
        findings.wrong(f"{place}: gap: expected a time not before {before.t_us / US_PER_S:.6f} s, "
                       f"found {after.t_us / US_PER_S:.6f} s")


def _load_sidecar(path: Path, findings: FileCheck) -> dict[str, Any] | None:
    try:
        sidecar = read_sidecar(path)
    except ValueError as error:
        findings.wrong(f"sidecar: {error}")
        return None
    except OSError as error:
        findings.wrong(f"sidecar: expected a readable file ({error.strerror})")
        return None
    if sidecar is None:
        if log_name(path):
            findings.wrong(f"sidecar: expected {path.with_suffix('.json').name} beside it; it is missing")
        return None
    if sidecar.get(SETTINGS_LOST) is True:
        findings.note("sidecar: settings and clock were lost before a repair")
    return sidecar


def _compare_with_sidecar(sidecar: dict[str, Any], findings: FileCheck) -> None:
    said = sidecar.get("log")
    rows = said.get("rows") if isinstance(said, dict) else None
    if not isinstance(rows, int):
        findings.wrong("sidecar: expected the number of rows of a finished log")
    elif not 0 <= rows - findings.records_good <= findings.records_corrupt + findings.records_torn:
        findings.gaps += 1
        findings.wrong(f"gap: expected the {rows} rows that the sidecar lists, found {findings.records_good}")


def _compare_neighbours(logs: dict[Path, _Log]) -> None:
    """Note rows and files that are missing between the parts of a session; a part without a row may hold a hole."""
    named = sorted((path.parent, name.session, name.part, name.is_open, path)
                   for path in logs if (name := log_name(path)))
    for _, session in groupby(named, key=lambda entry: entry[:2]):
        before: tuple[int, Path] | None = None
        holes: list[Hole] = []
        for *_, part, _, path in session:
            log = logs[path]
            holes += log.holes
            if log.last is None or log.first is None:
                continue
            if before is not None and before[0] != part:
                earlier = logs[before[1]]
                damaged = earlier.damaged_since_last + log.damaged_before_first
                assert earlier.last is not None
                _compare(log.check, earlier.last, log.first, damaged, f"after {before[1].name}", holes)
            before, holes = (part, path), list(log.holes)


def _check_dump(path: Path) -> FileCheck:
    findings = FileCheck(path, "dump", "open" if _is_part(path) else "dump")
    if not _is_part(path) or _has_begun(path):
        _take_events(findings, path)
    else:
        findings.records_torn = 1 if path.stat().st_size else 0  # its first block is not whole yet
    return findings


def _has_begun(path: Path) -> bool:
    """Tell whether the first block of an open recording, or the first line of one that is not packed, is whole."""
    if path.name.endswith(".gz.part"):
        return intact_bytes(path) > 0
    with open_regular(path) as file:
        return file.readline(LINE_BYTES + 1).endswith(b"\n")


def _take_events(findings: FileCheck, path: Path) -> None:
    """Count the events of a dump; in an open one a torn end is as it should be."""
    heard_us: int | None = None
    try:
        with open_dump(path) as reader:
            for event in reader:
                findings.records_good += 1
                if event.source not in ACCELEROMETERS:
                    continue
                if heard_us is not None and event.t_us - heard_us > SILENCE_US:
                    findings.gaps += 1
                    findings.note(f"gap: nothing from the accelerometer between {heard_us / US_PER_S:.6f} s "
                                  f"and {event.t_us / US_PER_S:.6f} s")
                heard_us = event.t_us
            if reader.torn_tail:
                findings.records_torn = 1
            if reader.torn_tail and not _is_part(path):
                findings.wrong("torn: the recording ends in the middle of a line or of its compressed data")
    except DumpError as error:
        findings.records_corrupt = 1
        findings.wrong(f"corrupt: {str(error).removeprefix(f'{path}:')}")


def _check_manifest(path: Path) -> FileCheck:
    """Compare the files beside a manifest with it: as listed, changed (corrupt), missing or not listed (gaps)."""
    findings = FileCheck(path, "manifest", "manifest")
    with DirectoryHandle.at(path.parent) as folder:
        try:
            with folder.open(manifest.NAME) as file:
                listed = read_manifest(file.blocks()).files
        except OSError as error:
            findings.gaps = 1
            findings.wrong(f"expected a list of what was exported ({error.strerror}); export again")
            return findings
        except ValueError as error:
            findings.records_corrupt = 1
            findings.wrong(f"corrupt: {error}")
            return findings
        present = {name for name in folder.each_name() if name in listed or log_name(Path(name))
                   or name.endswith(DUMP_ENDINGS)}
        for name, digest in listed.items():
            _compare_with_manifest(findings, folder, name, digest, name in present)
    for name in sorted(present - set(listed)):
        findings.gaps += 1
        findings.wrong(f"{name}: expected in the manifest; the export was cut short, export again")
    return findings


def _compare_with_manifest(findings: FileCheck, folder: DirectoryHandle, name: str, digest: str, present: bool) -> None:
    if not present:
        findings.gaps += 1
        findings.wrong(f"{name}: missing")
        return
    try:
        found = folder.sha256(name)
    except OSError as error:
        found = str(error.strerror)
    if found == digest:
        findings.records_good += 1
    else:
        findings.records_corrupt += 1
        findings.wrong(f"{name}: corrupt: expected SHA-256 {digest}, found {found}")
