"""The command as it is installed, called without a process of its own: what is tested is what it answers."""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stderr, redirect_stdout
from subprocess import CompletedProcess
from unittest.mock import patch

from logger.commands import main


def called(*words: object) -> CompletedProcess[str]:
    """Status, stdout and stderr of ``ridelog`` with these words. What would be a traceback is raised here."""
    out, complaints = (io.TextIOWrapper(io.BytesIO(), "utf-8", newline="") for _ in range(2))
    arguments = ["ridelog", *map(str, words)]
    with patch.object(sys, "argv", arguments), redirect_stdout(out), redirect_stderr(complaints):
        try:
            main.run()
        except SystemExit as leaving:
            status = leaving.code
    texts = []
    for stream in (out, complaints):
        stream.flush()
        texts.append(stream.buffer.getvalue().decode())  # type: ignore[attr-defined]  # BytesIO
    return CompletedProcess(arguments, status, *texts)  # type: ignore[arg-type]  # run always leaves with a number
