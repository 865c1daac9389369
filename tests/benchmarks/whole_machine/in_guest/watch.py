"""Runs in the guest: writes down, five times a second, what the service has promised so far.

One line a look, into a file of the shared folder, which outlives a power cut: the seconds since boot, the rows that
the service says it has written, and the new lines of the open log, as JSON. The clock is the guest's own, so a look
that never came is later than the last that did. Started as
``watch.py OUT NAME ...``: these names were there before, and logs of their sessions are left out.
"""

import json
import sys
import time
from pathlib import Path

LOGS = Path("/var/lib/ridelog")
STATUS = Path("/run/ridelog/status.json")
LOOK_S = 0.2


def main(out: Path, old: set[str]) -> None:
    """Look for ever."""
    read: dict[Path, int] = {}
    with out.open("a") as file:
        while True:
            looked_s = time.monotonic()
            logs = sorted(path for path in LOGS.glob("*.csv*") if path.name.split("-")[0] not in old)
            new = {path.name: text for path in logs if (text := new_lines(path, read))}
            print(json.dumps({"t_s": looked_s, "rows_written": rows_written(), "lines": new}), file=file, flush=True)
            time.sleep(LOOK_S)


def new_lines(path: Path, read: dict[Path, int]) -> str:
    """Whole lines since the last look."""
    try:
        with path.open("rb") as file:
            file.seek(read.get(path, 0))
            data = file.read()
    except OSError:
        return ""
    whole = data[: data.rfind(b"\n") + 1]
    read[path] = read.get(path, 0) + len(whole)
    return whole.decode()


def rows_written() -> int:
    """Rows since the service's start, as its status says; 0 while it says nothing."""
    try:
        return int(json.loads(STATUS.read_text())["rows_written"])
    except (OSError, ValueError, KeyError):
        return 0


if __name__ == "__main__":
    main(Path(sys.argv[1]), {name.split("-")[0] for name in sys.argv[2:]})
