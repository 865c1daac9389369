"""A disk that fills while a command writes: the complaint names the file (``/dev/full`` is the kernel's own full disk).

What the lab's commands say is judged beside them.
"""

import errno
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.store.formats.record_file import TIME, VERTICAL

FULL = "/dev/full"


def drive(folder: Path) -> str:
    main(["simulate", "--vehicle", "rav4-2009", "--profile", road(folder), "--speed", "15", "--noise", "0.05", "--out",
          str(folder / "drive.csv")])
    return str(folder / "drive.csv")


def run(folder: Path) -> str:
    drive(folder)
    return str(folder)


def road(folder: Path) -> str:
    main(["road", "generate", "--class", "B", "--length", "150", "--out", str(folder / "profile.csv")])
    return str(folder / "profile.csv")


def shaken(folder: Path) -> str:
    time_s = np.arange(3000) / 100
    lines = [f"{TIME},{VERTICAL}", *(f"{t:.2f},{a:.5f}" for t, a in zip(
        time_s, np.random.default_rng(1).standard_normal(len(time_s)), strict=True))]
    (folder / "shaken.csv").write_text("\n".join(lines))
    return str(folder / "shaken.csv")


def headers(folder: Path) -> str:
    (folder / "ridelog_wk.h").symlink_to(FULL)
    return str(folder)


WRITERS: dict[str, Callable[[Path], list[str]]] = {
    "a road": lambda folder: ["road", "generate", "--class", "B", "--length", "100", "--out", FULL],
    "a spectrum": lambda folder: ["road", "classify", road(folder), "--psd", FULL],
    "a drive": lambda folder: ["simulate", "--vehicle", "rav4-2009", "--profile", road(folder), "--speed", "15",
                               "--out", FULL],
    "relations": lambda folder: ["calibrate", "--vehicle", "rav4-2009", "--out", FULL],
    "a diagram": lambda folder: ["modes", shaken(folder), "--method", "ssi", "--diagram", FULL],
    "windows": lambda folder: ["estimate", drive(folder), "--vehicle", "rav4-2009", "--out", FULL],
    "a road that was found": lambda folder: ["estimate", drive(folder), "--vehicle", "rav4-2009", "--profile-out",
                                             FULL],
    "a vehicle": lambda folder: ["identify", "--vehicle", "rav4-2009", "--free", "sprung_mass_kg", run(folder),
                                 "--out", FULL],
    "a study": lambda folder: ["study", "table-4-3", "--quick", "--out", FULL],
}


@pytest.mark.parametrize("what", WRITERS)
def test_the_file_is_named(what: str, tmp_path: Path) -> None:
    with pytest.raises(OSError) as full:
        main(WRITERS[what](tmp_path))
    assert (full.value.errno, full.value.filename) == (errno.ENOSPC, FULL)


def test_the_header_is_named(tmp_path: Path) -> None:
    with pytest.raises(OSError) as full:
        main(["fixed-point", "--out", headers(tmp_path)])
    assert (full.value.errno, full.value.filename) == (errno.ENOSPC, str(tmp_path / "ridelog_wk.h"))
