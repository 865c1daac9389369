"""A snapshot of the running service, for people and programs beside it.

Problem. Somebody at the car wants to know, in one look, whether it is recording and what to do if not; and a file
that merely exists may be that of a service that died.

Solution. The service fills a frozen ``ServiceStatus`` now and then and puts it, whole, into a small JSON file in
memory (renamed into place, so a reader never sees half of one). It carries the process and the monotonic time of
its making, by which ``trouble`` distinguishes a living service from a dead, hung or never started one.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from drivers.disk import open_regular
from logger.errors import BadInput
from logger.files import STATE_BYTES
from logger.records import WindowRecord

SensorState = Literal["ok", "absent", "retrying", "silent", "doubtful"]
ServiceState = Literal["starting", "standing", "recording", "stopping"]


@dataclass(frozen=True)
class SensorStatus:
    """One sensor as the service sees it.

    driver, place   what it is and where: ``bma220`` at ``/dev/i2c-1``
    state           ok: readings come; absent: it was never there; retrying: it was there, failed, and is tried
                    again; silent: it is open and says nothing; doubtful: it speaks, but what it says cannot be
                    read or cannot be true (``last_error`` says what)
    since_s         how long it has been in that state [s]
    last_error      text of the last fault, also after it recovered; None: there was none
    readings        samples or fixes so far
    counters        what its decoder counted: bad checksums, dropped bytes ...
    note            what a person should know of how it is read; empty: nothing
    """

    driver: str
    place: str
    state: SensorState = "absent"
    since_s: float = 0.0
    last_error: str | None = None
    readings: int = 0
    counters: Mapping[str, int] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class StorageStatus:
    """How the disk takes what the service writes.

    trouble             why no rows can be written at the moment; empty: all is well
    since_s             for how long [s]
    rows_waiting        rows kept in memory until they can be written
    rows_lost           rows that were given up, for more did not fit the memory
    failures            how often the disk refused
    recording_trouble   why no raw bytes are recorded though the settings want it
    room_bytes          what may still be written: up to the quota, down to the floor of free space
    exported_removed    files removed to make room, of which a stick holds a copy
    dumps_lost          dumps removed to make room for logs though they had not been exported
    notices             files in the folder of logs that cannot be read, removed or finished, or that were put aside
    """

    trouble: str = ""
    since_s: float = 0.0
    rows_waiting: int = 0
    rows_lost: int = 0
    failures: int = 0
    recording_trouble: str = ""
    room_bytes: int = 0
    exported_removed: int = 0
    dumps_lost: int = 0
    notices: tuple[str, ...] = ()


@dataclass(frozen=True)
class ServiceStatus:
    """All that ``ridelog status`` knows.

    state           starting; standing: it samples, the car does not move or there is no speed yet; recording:
                    windows come; stopping
    updated_t_us    monotonic time of this snapshot [us]
    fix_valid       the receiver vouches for its last fix; None: there was none yet
    utc_known       rows carry true time
    current_file    the open log file; None while none can be written
    rows_written    rows since the start of the service that are on the disk, in all files
    storage         how the disk takes them
    distance_m      travelled since the start of the service [m]
    free_bytes      room left where the logs are; None: not known
    last_window     the newest row; None before the first
    notices         what the settings allow and somebody should know all the same
    counters        what the pipeline and the store counted: late samples, gaps, write errors ...
    receiver_delay  how late fixes come, and how that is known; empty: not known; receiver_delay_s and
                    receiver_delay_std_s: as numbers, with the standard error [s]
    sensor_noise    of the accelerometer, and how that is known, likewise; sensor_noise_mps2 and
                    sensor_noise_std_mps2: as numbers where it was learned [m/s2]
    """

    state: ServiceState
    pid: int
    version: str
    uptime_s: float
    updated_t_us: int
    accelerometer: SensorStatus
    gps: SensorStatus
    fix_valid: bool | None = None
    satellites: int | None = None
    utc_known: bool = False
    log_directory: str = ""
    current_file: str | None = None
    rows_written: int = 0
    distance_m: float = 0.0
    free_bytes: int | None = None
    last_window: WindowRecord | None = None
    storage: StorageStatus = StorageStatus()
    notices: tuple[str, ...] = ()
    counters: Mapping[str, int] = field(default_factory=dict)
    receiver_delay: str = ""
    receiver_delay_s: float | None = None
    receiver_delay_std_s: float | None = None
    sensor_noise: str = ""
    sensor_noise_mps2: float | None = None
    sensor_noise_std_mps2: float | None = None


def write_status(path: Path, status: ServiceStatus) -> None:
    """Put the snapshot into place in one step; its folder too, where no unit made it. Raises OSError where that cannot
    be done.

    There is no fsync: the file lies in memory, and after a power cut nobody is there whom it could describe.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(path.name + ".new")
    new.write_text(json.dumps(asdict(status)) + "\n", encoding="utf-8")
    new.replace(path)


def read_status(path: Path) -> ServiceStatus | None:
    """Read the last snapshot; None where there is none. Raises BadInput for a file that is not one."""
    try:
        with open_regular(path) as file:
            fields = json.loads(file.read(STATE_BYTES))
        window = fields["last_window"]
        if window is not None:
            fields["last_window"] = WindowRecord(**{**window, "flags": tuple(window["flags"])})
        fields["accelerometer"] = _sensor(fields["accelerometer"])
        fields["gps"] = _sensor(fields["gps"])
        storage = fields["storage"]
        fields["storage"] = StorageStatus(**{**storage, "notices": tuple(map(str, storage["notices"]))})
        fields["notices"] = tuple(map(str, fields["notices"]))
        for words in ("receiver_delay", "sensor_noise"):
            fields[words] = str(fields.get(words, ""))
        status = ServiceStatus(**fields)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise BadInput(f"{path}: expected a status file that can be read ({error.strerror})") from None
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise BadInput(f"{path}: expected the status of a ridelog service of this version") from None
    if status.state not in get_args(ServiceState) or not isinstance(status.pid, int):
        raise BadInput(f"{path}: expected the status of a ridelog service of this version")
    return status


def _sensor(fields: Mapping[str, Any]) -> SensorStatus:
    sensor = SensorStatus(**fields)
    if sensor.state not in get_args(SensorState):
        raise ValueError(f"no sensor state {sensor.state!r}")
    return sensor


def process_exists(pid: int) -> bool:
    """Whether a process of this number runs, of any owner."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def trouble(status: ServiceStatus | None, now_t_us: int, pid_exists: bool) -> str | None:
    """Say why the service that made this snapshot is not running as it should; None when it is.

    now_t_us     monotonic time, of this machine since its last boot [us]
    pid_exists   whether the process of the snapshot runs (``process_exists``)
    """
    stale_s = 10.0  # A living service renews its status every second; one this old comes from a service that hangs.
    if status is None:
        return "ridelog is not running: it has left no status"
    age_s = (now_t_us - status.updated_t_us) / 1e6
    if age_s < 0:
        return "ridelog is not running: its last status is from before this boot"
    if not pid_exists:
        return f"ridelog is not running: process {status.pid} has ended, its last status is {age_s:.0f} s old"
    if age_s > stale_s:
        return f"ridelog hangs: process {status.pid} is there, but its last status is {age_s:.0f} s old"
    return None
