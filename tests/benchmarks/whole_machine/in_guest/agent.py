"""Runs in the guest: carries out what the host puts into the shared folder as shell scripts, each in a thread.

``in/NAME.sh`` is run by bash; what it prints goes to ``out/NAME.out``, its exit status, last, to ``out/NAME.rc``.
Needs nothing but Python's own library, for it starts before anything else.
"""

import subprocess
import sys
import threading
import time
from pathlib import Path

POLL_S = 0.05


def main(share: Path) -> None:
    """Watch the folder for ever."""
    (share / "up").write_text(Path("/proc/uptime").read_text())
    done: set[str] = set()
    while True:
        for script in sorted((share / "in").glob("*.sh")):
            if script.stem not in done:
                done.add(script.stem)
                threading.Thread(target=carry_out, args=(share, script), daemon=True).start()
        time.sleep(POLL_S)


def carry_out(share: Path, script: Path) -> None:
    """Run one script, and say how it ended."""
    out = share / "out" / f"{script.stem}.out"
    text = script.read_text()
    script.unlink()
    with out.open("wb") as file:
        rc = subprocess.run(["bash", "-c", text], stdin=subprocess.DEVNULL, stdout=file, stderr=file,
                            check=False).returncode
    temporary = out.with_suffix(".tmp")
    temporary.write_text(f"{rc}\n")
    temporary.rename(out.with_suffix(".rc"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
