"""Files that ship with ridelog in an archive, written where a person may work on them."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from zipfile import ZipFile

from logger.errors import BadInput
from logger.files import make_folder, together, write_file


def unpacked(archive: str, out: Path) -> list[Path]:
    """Write the files of an archive of this folder below ``out``, where they may be already; their paths.

    Raises BadInput, and writes nothing, where something else of one of their names is there; OSError as ``open``.
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out {out}: expected a folder")
    with resources.as_file(resources.files("logger.demo") / archive) as file, ZipFile(file) as kept:
        contents = {out / name: kept.read(name) for name in kept.namelist()}
    for path, content in contents.items():
        if path.parent.exists() and not path.parent.is_dir():
            raise BadInput(f"{path.parent}: expected a folder, or nothing; choose another folder with --out")
        if path.exists() and not (path.is_file() and path.read_bytes() == content):
            raise BadInput(f"{path}: expected nothing there, or the demo's own file, found something else; choose "
                           "another folder with --out")
    with together():
        for path, content in contents.items():
            make_folder(path.parent)
            write_file(path, [content])
    return list(contents)
