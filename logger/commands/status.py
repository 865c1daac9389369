"""``ridelog status``: what the service is doing, and what to do about what is wrong."""

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from drivers.accelerometers import accelerometers
from drivers.hardware import port_advice
from drivers.sources import serial_advice
from logger.printable import printable, span_words
from logger.question import Checked, Option, Question, Verb
from logger.service.config import find_config, load_config
from logger.service.status import SensorStatus, ServiceStatus, StorageStatus, process_exists, read_status, trouble
from logger.store.export.sticks import FOLDER, StickNote, read_notes
from logger.store.log.atomic_file import READ_ONLY

_START = "Start it: sudo systemctl start ridelog (not installed yet: sudo ridelog install; in a terminal: ridelog run)"
_JOURNAL = "See why: journalctl -u ridelog -n 50"
_LITTLE_ROOM_BYTES = 200_000_000


@dataclass(frozen=True, kw_only=True)
class StatusQuestion(Question):
    """Say what the running service is doing, and what to do next.

      ridelog status
      ridelog status --json

    Exit status 1 when it is not running, or hangs.
    """

    config: Annotated[Path | None, Option("settings of the service (default: those of 'run')", metavar="FILE",
                                          read=Path)] = None


VERB = Verb(StatusQuestion, "logger.commands.status:answered")


def answered(asked: StatusQuestion) -> Checked:
    """What the service says of itself, with what is wrong with it."""
    status = read_status(load_config(find_config(asked.config)).status_file)
    fault = trouble(status, time.monotonic_ns() // 1000, status is not None and process_exists(status.pid))
    notes = read_notes(FOLDER)
    said = {"running": fault is None, "trouble": fault, "sticks": [asdict(note) for note in notes],
            **({} if status is None else asdict(status))}
    return Checked("\n".join([*stick_lines(notes), *screen(status, fault)]), said, fault is None)


def stick_lines(notes: list[StickNote]) -> list[str]:
    """What each stick that is plugged in is doing, and whether it may be pulled."""
    return [printable(f"stick {note.stick}: {'' if note.ok else 'WRONG, '}{note.text}"
                      f"{'' if note.state == 'ready' else '; leave it in'}") for note in notes]


def screen(status: ServiceStatus | None, fault: str | None) -> list[str]:
    """The lines a person sees. ``fault`` is what ``trouble`` said."""
    if status is None or fault is not None:
        return [fault or "", "", "What to do", *(f"  {line}" for line in (_START, _JOURNAL))]
    stands = "the receiver's data are doubtful" if status.gps.state == "doubtful" else "the car stands"
    words = {"starting": "is starting", "standing": f"is ready; {stands}", "recording": "is recording",
             "stopping": "is stopping"}
    writes = f", but writes NOTHING: {status.storage.trouble}" if status.storage.trouble else ""
    lines = [
        f"ridelog {words[status.state]}{writes}, up {span_words(status.uptime_s)}",
        "",
        _sensor_line("accelerometer", status.accelerometer, "samples"),
        _sensor_line("GPS", status.gps, _fix_words(status)),
        f"  log             {status.current_file or 'no file open'}; {status.rows_written} rows, "
        f"{status.distance_m / 1000:.1f} km since the start",
    ]
    if status.receiver_delay:
        lines.append(f"  receiver delay  {printable(status.receiver_delay)}")
    if status.sensor_noise:
        lines.append(f"  sensor noise    {printable(status.sensor_noise)}")
    if status.last_window is not None:
        lines.append(f"  last window     {_window_words(status)}")
    lines += ["", "What to do", *(f"  {line}" for line in advice(status))]
    return lines


def advice(status: ServiceStatus) -> list[str]:
    """What a person can do about what is wrong, most urgent first; one line that all is well when nothing is."""
    steps = [
        *_storage_advice(status.storage),
        *_sensor_advice("accelerometer", status.accelerometer),
        *_sensor_advice("GPS", status.gps),
        *_settings_advice(status.accelerometer),
    ]
    if status.gps.state == "ok" and not status.fix_valid:
        steps.append("GPS: no fix. Give the antenna a free view of the sky; the first fix can take some minutes.")
    if status.free_bytes is not None and status.free_bytes < _LITTLE_ROOM_BYTES:
        steps.append(f"Disk: {status.free_bytes / 1e6:.0f} MB left in {status.log_directory}. Copy the finished logs "
                     "away and delete them.")
    steps += status.notices
    return steps or ["Nothing: all is well."]


def _storage_advice(storage: StorageStatus) -> list[str]:
    steps = []
    if storage.trouble:
        cure = ("Copy the logs away (plug in the USB stick, or ridelog export) and delete the copied ones; if this "
                "happens again, the card is dying: replace it")
        if storage.trouble.startswith(READ_ONLY):
            # a service that was started on it sees it through a mount of its own, which stays read-only
            cure = ("Mount it writable (sudo mount -o remount,rw /); if this persists: sudo systemctl restart ridelog. "
                    "If it happens again, copy the logs away (plug in the USB stick): the card is dying, replace it")
        steps.append(f"Log: not written for {span_words(storage.since_s)}: {storage.trouble}. {storage.rows_waiting} "
                     f"rows wait in memory and are lost if the power goes. {cure}.")
    if storage.rows_lost:
        steps.append(f"Log: {storage.rows_lost} rows were lost while they could not be written.")
    if storage.recording_trouble:
        steps.append(f"Raw bytes: not recorded: {storage.recording_trouble}. Export the dumps and delete them, or set "
                     "record_dump: false.")
    if storage.dumps_lost:
        steps.append(f"Raw bytes: ridelog removed {storage.dumps_lost} dumps before their export, to make room for "
                     "logs. Export more often, or set record_dump: false.")
    if storage.notices:
        steps += [f"Log folder: {words}." for words in storage.notices]
        steps.append("Log folder: copy the logs away, look at the files that end in .aside and delete them; if more "
                     "appear, the card is dying: replace it.")
    return steps


def _sensor_advice(name: str, sensor: SensorStatus) -> list[str]:
    if sensor.state == "ok":
        return [f"{name}: {sensor.note} (at {sensor.place})."] if sensor.note else []
    if sensor.state == "doubtful":
        return [f"{name}: {sensor.last_error} (at {sensor.place})."]
    said = sensor.last_error.removeprefix(f"{sensor.place}: ") if sensor.last_error else ""
    error = f" Last error: {said}{'' if said.endswith(('?', '.')) else '.'}" if said else ""
    kind = accelerometers().get(sensor.driver)
    check = serial_advice(sensor.state) if kind is None else kind.advice(sensor.state)
    board = f" {port_advice(sensor.place)}".rstrip()
    return [f"{name}: {sensor.state} for {span_words(sensor.since_s)} at {sensor.place}; {check}.{board}"
            f"{'.' * bool(board)}{error}"]


def _settings_advice(sensor: SensorStatus) -> list[str]:
    lost = sensor.counters.get("settings_lost", 0)
    if not lost:
        return []
    times = "once" if lost == 1 else f"{lost} times"
    return [f"accelerometer: it lost its settings {times} since the start and was restarted; its readings of that "
            "time are left out. Its supply dips: check its 3.3 V and ground wires, and the Pi's own supply."]


def _sensor_line(name: str, sensor: SensorStatus, words: str) -> str:
    return f"  {name:15} {sensor.state:9} {sensor.driver} at {sensor.place}, {sensor.readings} {words}"


def _fix_words(status: ServiceStatus) -> str:
    fix = "position known" if status.fix_valid else "no position"
    satellites = "" if status.satellites is None else f" ({status.satellites} satellites)"
    return f"fixes, {fix}{satellites}, {'time known' if status.utc_known else 'time not known yet'}"


def _window_words(status: ServiceStatus) -> str:
    window = status.last_window
    if window is None:
        return ""
    values = [
        "speed unknown" if window.speed_mps is None else f"{window.speed_mps * 3.6:.0f} km/h",
        "IRI unknown" if window.iri_m_per_km is None else f"IRI {window.iri_m_per_km:.1f} m/km",
        window.comfort.replace("_", " "),
        " ".join(window.flags),
    ]
    return ", ".join(value for value in values if value)
