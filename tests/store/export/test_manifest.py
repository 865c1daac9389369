"""The list on the stick: read back as written, damaged anywhere not read at all, and known to another program."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.store.export.manifest import NAME, Manifest, manifest_blocks, read_manifest

DIGESTS = st.binary(max_size=4).map(lambda data: hashlib.sha256(data).hexdigest())
NAMES = st.from_regex(r"[0-9]{5}-[0-9]{3}\.(csv|json)|[0-9]{5}\.dump\.gz", fullmatch=True)
MANIFESTS = st.builds(Manifest, st.from_regex(r"[0-9a-f]{12}", fullmatch=True), st.dictionaries(NAMES, DIGESTS))


@settings(max_examples=100)
@given(MANIFESTS)
def test_what_was_written_is_read(manifest: Manifest) -> None:
    assert read_manifest([b"".join(manifest_blocks(manifest))]) == manifest


@pytest.mark.slow
@settings(max_examples=200)
@given(MANIFESTS, st.data())
def test_a_list_that_is_not_whole_is_refused(manifest: Manifest, data: st.DataObject) -> None:
    text = b"".join(manifest_blocks(manifest))
    place = data.draw(st.integers(0, len(text) - 1))
    change = data.draw(st.sampled_from(["cut", "flip", "drop", "double"]))
    damaged = {
        "cut": text[:place],
        "flip": text[:place] + bytes([text[place] ^ (1 << data.draw(st.integers(0, 7)))]) + text[place + 1:],
        "drop": text[:place] + text[place + 1:],
        "double": text[:place] + text[place:place + 1] + text[place:],
    }[change]
    try:
        assert read_manifest([damaged]) == manifest
    except ValueError as error:
        assert "expected" in str(error) or "does not match" in str(error)


@settings(max_examples=300)
@given(st.binary(max_size=300))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"expected|does not match"):
        read_manifest([data])


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", ".hidden", "a b", "00001\\x", "-rf", "0" * 65])
def test_a_list_cannot_name_anything_but_our_files(name: str) -> None:
    with pytest.raises(ValueError, match="line 2: expected"):
        read_manifest([b"".join(manifest_blocks(Manifest("0" * 12, {name: "0" * 64})))])


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="no sha256sum here")
def test_sha256sum_reads_it(tmp_path: Path) -> None:
    files = {"00001-001.csv": b"rows\n", "00001-001.json": b"{}\n"}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    listed = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    (tmp_path / NAME).write_bytes(b"".join(manifest_blocks(Manifest("0" * 12, listed))))
    check = ["sha256sum", "--check", "--strict", NAME]
    assert subprocess.run(check, cwd=tmp_path, capture_output=True).returncode == 0
    (tmp_path / "00001-001.csv").write_bytes(b"rowz\n")
    assert subprocess.run(check, cwd=tmp_path, capture_output=True).returncode == 1
