"""Commands of the host, with what they said when they fail."""

from __future__ import annotations

import subprocess


class CommandFailed(Exception):
    """A command of the host ended with an error; the text holds what it printed."""


def run(*command: object, timeout_s: float = 600) -> str:
    """What the command printed on stdout. Raises CommandFailed."""
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, timeout=timeout_s, check=False)
    if done.returncode != 0:
        raise CommandFailed(f"{' '.join(words)}: status {done.returncode}\n{done.stderr[-2000:]}{done.stdout[-1000:]}")
    return done.stdout
