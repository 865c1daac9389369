"""A service's life on disk, cut at any instant: what was promised, and whether it was held.

``Life`` drives the real storage of the service (log, sidecars, session counter, raw dump) with rows and bytes of its
own and notes at each instant what had been promised by then. ``crash`` ends it after some change of the disk, lets the
next start repair what is found, and compares. ``outage`` lets the disk refuse for a while and come back.
"""

from __future__ import annotations

import errno
import random
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

from drivers.dump import DumpHeader, Event, open_dump
from drivers.errors import DumpError
from logger.records import WindowRecord
from logger.service.storage import Storage
from logger.store.integrity import verify
from logger.store.log.disk_quota import QuotaLimits, repair_recordings
from logger.store.log.log_name import next_session
from logger.store.log.recovery import repair
from logger.store.log.row_format import format_row, parse_row, read_log
from logger.store.log.sidecar import ClockMap, read_sidecar

from .disk_models import CrashModel, RecordingFiles, RefusingFiles, RefusingJournal
from .trials import Found, Hazard

FACTS = {"ridelog_version": "test", "sensor": {"driver": "bma220", "verified": True}}
HEADER = DumpHeader(None, {"driver": "bma220", "range_g": 2}, {"baud": 9600}, "rav4-2009")
OFFSET_US = 1_783_160_000_000_000
ERRORS = (errno.ENOSPC, errno.EIO, errno.EROFS)
KINDS = ("create", "write", "sync", "close", "rename", "remove", "sync_directory")
WHOLE_DISK = QuotaLimits(floor_bytes=0)
OUTAGE_STEPS = 60
LIFE_STEPS = 30


def window(segment: int, utc: bool) -> WindowRecord:
    """A row whose text is its own."""
    t_us = 20_000_000 + segment * 500_000
    return WindowRecord(
        segment=segment, drive=1, t_us=t_us, utc_us=t_us + OFFSET_US if utc else None, duration_s=0.5,
        distance_start_m=7.62 * segment, distance_end_m=7.62 * (segment + 1), lat_deg=50 + segment * 1e-5, lon_deg=14.0,
        speed_mps=15.24, iri_m_per_km=2.0, iri_std_m_per_km=0.5, iri_rms_m_per_km=2.0, a_w_mps2=0.4, mtvv_mps2=0.5,
        vdv_mps175=0.6, crest_factor=3.0, comfort="a_little_uncomfortable", iri_class="A", accel_rms_mps2=0.5,
        samples=50, clipped_samples=0, flags=() if utc else ("time_unset",),
    )


@dataclass(frozen=True)
class Promised:
    """At one instant: rows and events handed over, and how many of them must survive a cut of the power."""

    rows: int = 0
    rows_safe: int = 0
    events: int = 0
    events_flushed: int = 0
    clock_safe: bool = False


class Life:
    """The storage of one session, from its start to its end, at random: rows, syncs, files ending, UTC coming late."""

    def __init__(self, folder: Path, seed: int, steps: int, max_file_bytes: int = 2500) -> None:
        self.files = RecordingFiles(folder)
        self.files.note = lambda: self.promised
        self.promised = Promised()
        self.utc_from = NEVER
        rng = random.Random(seed)
        storage = Storage(folder, FACTS, max_file_bytes, HEADER, WHOLE_DISK, lambda: 0, self.files)
        self.session = storage.log.session
        clock_at = rng.randrange(steps)
        for step in range(steps):
            for _ in range(rng.randrange(4)):
                self._record(storage, rng)
            if step == clock_at:
                self.utc_from = self.promised.rows + 1
                storage.log.set_clock_map(ClockMap(OFFSET_US))
                self.promised = replace(self.promised, clock_safe=True)
            self._append(storage)
            if rng.random() < 0.4:
                storage.sync()
                self.promised = replace(self.promised, rows_safe=self.promised.rows,
                                        events_flushed=self.promised.events)
            if rng.random() < 0.08:
                storage.log.rotate()
        storage.close()
        self.promised = replace(self.promised, rows_safe=self.promised.rows, events_flushed=self.promised.events)

    def _append(self, storage: Storage) -> None:
        segment = self.promised.rows + 1
        storage.log.append(window(segment, utc=segment >= self.utc_from))
        self.promised = replace(self.promised, rows=segment)

    def _record(self, storage: Storage, rng: random.Random) -> None:
        storage.record(event_of(self.promised.events))
        self.promised = replace(self.promised, events=self.promised.events + 1)


class TroubledLife(Life):
    """A session in the middle of which the disk refuses changes of a kind for some rounds, and comes back."""

    def __init__(self, folder: Path, seed: int, steps: int) -> None:
        rng = random.Random(seed)
        self.files = RefusingJournal(folder)
        self.files.note = lambda: self.promised
        self.promised = Promised()
        self.utc_from = NEVER
        now_us = 0
        storage = Storage(folder, FACTS, 2500, None, WHOLE_DISK, lambda: now_us, self.files)
        self.session = storage.log.session
        kinds = rng.choice((("write",), ("sync",), ("rename",), ("remove",), ("sync_directory",), KINDS))
        begin, length, clock_at = rng.randrange(3, steps // 2), rng.randrange(1, steps // 2), rng.randrange(steps)
        for step in range(steps):
            now_us += rng.choice((500_000, 20_000_000))
            self.files.refuses = lambda kind, bad=begin <= step < begin + length: bad and kind in kinds
            if step == clock_at:
                self.utc_from = self.promised.rows + 1
                storage.log.set_clock_map(ClockMap(OFFSET_US))
                self.promised = replace(self.promised, clock_safe=not storage.log.trouble)
            self._append(storage)
            storage.sync()
            self._note_what_is_safe(storage)
            storage.tend()
            self._note_what_is_safe(storage)
        self.files.refuses = lambda kind: False
        storage.close()
        self.promised = replace(self.promised, rows_safe=self.promised.rows)

    def _note_what_is_safe(self, storage: Storage) -> None:
        if not storage.log.trouble:
            assert storage.log.waiting == 0
            self.promised = replace(self.promised, rows_safe=self.promised.rows)


NEVER = 10**9


def event_of(number: int) -> Event:
    """The events of a dump: each tells its number."""
    return Event(10_000 * number, "nmea", b"%06d" % number * 10)


@dataclass
class Outcome:
    """What a trial found, in numbers; ``wrong`` is empty when every promise was held."""

    rows_promised: int = 0
    rows_found: int = 0
    events_promised: int = 0
    events_found: int = 0
    rows_lost: int = 0
    damaged_accepted: int = 0
    torn_or_damaged: int = 0
    reported: bool = False
    wrong: str = ""


def crash(life: Life, count: int, power: bool, rng: random.Random, folder: Path, again: float = 0.3) -> Outcome:
    """End the life after ``count`` changes, restart (with the share ``again`` of restarts cut off as well), compare.

    ``folder`` is a name that is free.
    """
    before = life.files.journal[count].note if count < len(life.files.journal) else life.promised
    assert isinstance(before, Promised)
    model = CrashModel.after(life.files, count)
    image = model.powerless(rng) if power else model.killed()
    lossy = power
    while rng.random() < again:
        _lay_out(folder, image)
        files = RecordingFiles(folder, None if lossy else model)
        _restart(folder, files)
        shutil.rmtree(folder)
        model = CrashModel.after(files, rng.randint(0, len(files.journal)))
        lossy = rng.random() < 0.7
        power = power or lossy
        image = model.powerless(rng) if lossy else model.killed()
    _lay_out(folder, image)
    outcome = Outcome(before.rows_safe if power else before.rows, 0, before.events_flushed, 0)
    try:
        outcome.torn_or_damaged = sum(read_log(path).damaged_lines for path in folder.glob("*.csv.part"))
        number = _restart(folder, RecordingFiles(folder))
        _compare(folder, life, before, number, outcome)
    except (Broken, DumpError, ValueError) as broken:
        outcome.wrong = str(broken)
    shutil.rmtree(folder)
    return outcome


class Broken(AssertionError):
    """A promise was not held."""


def _hold(true: bool, promise: str) -> None:
    if not true:
        raise Broken(promise)


def _lay_out(folder: Path, image: dict[str, bytes]) -> None:
    folder.mkdir()
    for name, data in image.items():
        (folder / name).write_bytes(data)


def _restart(folder: Path, files: RecordingFiles) -> int:
    problems = [repaired.problem for repaired in repair(folder, files)]
    _hold(not any(problems), f"repair: {problems}")
    repair_recordings(folder, files)
    return next_session(folder, files)


def _compare(folder: Path, life: Life, before: Promised, number: int, outcome: Outcome) -> None:
    logs = sorted(folder.glob("*.csv"))
    dumps = sorted(folder.glob("*.dump.gz"))
    expected = {"last-session", *(f"{log.stem}.{end}" for log in logs for end in ("csv", "json")),
                *(dump.name for dump in dumps)}
    _hold({path.name for path in folder.iterdir()} == expected, f"only finished files: {sorted(folder.iterdir())}")
    if before.rows:
        _hold(life.session is not None and number > life.session, f"session {number} was given twice")
    contents = [read_log(log) for log in logs]
    records = [record for content in contents for record in content.records]
    outcome.rows_found = len(records)
    _hold(not any(content.damaged_lines for content in contents), "a damaged line in a finished file")
    segments = [record.segment for record in records]
    promised = range(1, outcome.rows_promised + 1)
    outcome.rows_lost = len(set(promised) - set(segments))
    outcome.damaged_accepted = sum(not _is_as_written(record) for record in records)
    _hold(segments[:len(promised)] == list(promised), "every promised row, once, in order")
    _hold(not outcome.damaged_accepted, "every row is as it was written")
    _hold(segments == sorted(set(segments)), "the rows that came later once, in order")
    _hold(not segments or segments[-1] <= before.rows + 1, "no row that was not written")
    for record in records:
        _hold(record.utc_us is not None or not before.clock_safe, f"row {record.segment} has its UTC")
    for log, content in zip(logs, contents, strict=True):
        sidecar = read_sidecar(log)
        _hold(sidecar is not None and sidecar["sensor"] == FACTS["sensor"], f"sidecar of {log.name}")
        _hold(sidecar["log"]["rows"] == len(content.records), f"rows in the sidecar of {log.name}")
    recorded = events(folder)
    outcome.events_found = len(recorded)
    _hold(recorded == list(range(len(recorded))), "events from the first on, without a gap")
    _hold(len(recorded) >= before.events_flushed, "as many events as were promised")
    if logs or dumps:
        bad = problems(folder)
        _hold(not bad, f"ridelog verify: {bad}")


def _is_as_written(record: WindowRecord) -> bool:
    return record == parse_row(format_row(window(record.segment, utc=record.utc_us is not None)))


class Service:
    """The storage of a running service, with a clock of its own: a row and two events each half second."""

    def __init__(self, folder: Path, files: RefusingFiles, limits: QuotaLimits = WHOLE_DISK,
                 max_file_bytes: int = 2500) -> None:
        folder.mkdir(exist_ok=True)
        self.folder = folder
        self.now_us = 0
        self.rows = 0
        self.events = 0
        self.storage = Storage(folder, FACTS, max_file_bytes, HEADER, limits, lambda: self.now_us, files)

    def step(self) -> None:
        """One round of the main loop."""
        self.now_us += 500_000
        for _ in range(2):
            self.storage.record(event_of(self.events))
            self.events += 1
        self.rows += 1
        self.storage.log.append(window(self.rows, utc=False))
        if self.rows % 2:
            self.storage.sync()
        self.storage.tend()

    def wait(self) -> None:
        """Nothing happens for longer than anything is waited for."""
        for _ in range(3):
            self.now_us += 61_000_000
            self.storage.sync()
            self.storage.tend()


def outage(folder: Path, error: int, kinds: tuple[str, ...], begin: int, length: int) -> Outcome:
    """A drive during which the disk refuses changes of these kinds for ``length`` rounds from round ``begin`` on."""
    files = RefusingFiles()
    files.error = error
    service = Service(folder, files)
    outcome = Outcome(rows_promised=OUTAGE_STEPS, events_promised=2 * begin - 4)
    for step in range(OUTAGE_STEPS):
        if step == 20:
            service.storage.log.set_clock_map(ClockMap(OFFSET_US))
        files.refuses = lambda kind, bad=begin <= step < begin + length: bad and kind in kinds
        service.step()
        outcome.reported |= bool(service.storage.status().trouble)
    service.wait()
    is_well = service.storage.status().trouble == "" and service.storage.log.waiting == 0
    service.storage.close()
    lost = service.storage.status().rows_lost
    restart(folder)  # finishes what the failing disk did not let be finished
    records = [record for path in sorted(folder.glob("*.csv")) for record in read_log(path).records]
    outcome.rows_found = len(records)
    try:
        _hold(is_well and not lost, "all is well after the outage")
        _hold([record.segment for record in records] == list(range(1, OUTAGE_STEPS + 1)), "every row, once, in order")
        _hold(all(record.utc_us == record.t_us + OFFSET_US for record in records), "every row has its UTC")
        _hold(not list(folder.glob("*.part")), "only finished files")
        _hold(problems(folder) == [], f"ridelog verify: {problems(folder)}")
        recorded = events(folder)
        outcome.events_found = len(recorded)
        _hold(recorded == sorted(set(recorded)), "events once, in order")
        _hold(len(recorded) >= outcome.events_promised, "every event before the outage")
    except (Broken, DumpError, ValueError) as broken:
        outcome.wrong = str(broken)
    return outcome


def restart(folder: Path) -> None:
    """Start and stop again on a disk that is well."""
    Storage(folder, FACTS, 2500, None, WHOLE_DISK, lambda: 0, RefusingFiles()).close()


def problems(folder: Path) -> list[str]:
    """What ``ridelog verify`` says is wrong."""
    return [problem for check in verify([folder]) for problem in check.problems]


def segments(folder: Path, pattern: str = "*.csv") -> list[int]:
    """Segments of the intact rows in these files."""
    return [record.segment for path in sorted(folder.glob(pattern)) for record in read_log(path).records]


def events(folder: Path) -> list[int]:
    """Numbers of the events in all dumps, in order of their names. Raises Broken for one that ends in the middle."""
    numbers = []
    for path in sorted(folder.glob("*.dump.gz"), key=lambda path: path.name.split(".")[0]):
        with open_dump(path) as reader:
            found = list(reader)
            _hold(all(event == event_of(event.t_us // 10_000) for event in found), "events as they were recorded")
            numbers += [event.t_us // 10_000 for event in found]
            _hold(not reader.torn_tail, f"{path.name} ends well")
    return numbers


def _cut_everywhere(folder: Path, seed: int, power: bool, kind: type[Life] = Life) -> Found:
    """A life that ends after each change of the disk; without power twice, for each time something else is left."""
    (folder / "life").mkdir()
    life = kind(folder / "life", seed, LIFE_STEPS)
    rng = random.Random(seed)
    outcomes = [crash(life, count, power, rng, folder / "after")
                for count in range(len(life.files.journal) + 1) for _ in range(2 if power else 1)]
    figures = {name: float(sum(getattr(outcome, name) for outcome in outcomes)) for name in (
        "rows_promised", "rows_lost", "damaged_accepted", "torn_or_damaged", "events_promised", "events_found")}
    return Found(len(outcomes), figures, wrong=tuple(outcome.wrong for outcome in outcomes if outcome.wrong))


def killed_at_every_change(folder: Path, seed: int) -> Found:
    return _cut_everywhere(folder, seed, power=False)


def power_cut_at_every_change(folder: Path, seed: int) -> Found:
    return _cut_everywhere(folder, seed, power=True)


def power_cut_around_an_outage(folder: Path, seed: int) -> Found:
    return _cut_everywhere(folder, seed, power=True, kind=TroubledLife)


_REPAIRED = ("; the next start leaves only finished files that pass `ridelog verify`, and no session number is "
             "used twice")
_COUNTED = ("{rows_promised.total:.0f} rows promised, {rows_lost.total:.0f} lost; {torn_or_damaged.total:.0f} damaged "
            "lines seen, {damaged_accepted.total:.0f} accepted")
HAZARDS = (
    Hazard("process killed", "the storage of a drive at random (rows, syncs, files that end, UTC that comes late, a "
           "raw dump) is cut after every change of the disk; of the repairs, three in ten are cut as well",
           "no row that was written is lost" + _REPAIRED, _COUNTED, killed_at_every_change, range(12), 1),
    Hazard("power cut", "the same; what was not synced is dropped, torn at sectors of 512 bytes, reordered, zeros, "
           "garbage or other digits, and new names come early, late or never",
           "no row that was synced is lost, no damaged row is accepted" + _REPAIRED, _COUNTED,
           power_cut_at_every_change, range(12), 1),
    Hazard("power cut before, in and after a disk's outage", "the same, and for a while the disk refuses changes of a "
           "kind, or all (EIO), with half of each refused write done",
           "no row that was synced is lost, no damaged row is accepted" + _REPAIRED, _COUNTED,
           power_cut_around_an_outage, range(24), 2),
)
