"""``docs/notebook.md``: its lines run as they stand, and print what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from logger.store.formats.effect_file import shipped_effects

FEW = ("dry_friction", "frame_friction", "hysteresis", "damper_asymmetry", "sensor_gain", "time_offset")
"""Enough to choose among; all of them are tried on the page of the field."""
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "notebook.md").read_text("utf-8")
BLOCK = re.compile(r"^```(python|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\d+(?:\.\d+)?")


@pytest.mark.slow
def test_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    few = {name: one for name, one in shipped_effects().items() if name in FEW}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    printed = ""
    for kind, content in BLOCK.findall(PAGE):
        if kind == "python":
            exec(compile(content, "docs/notebook.md", "exec"), names)
            printed = capsys.readouterr().out
        else:
            assert NUMBER.sub("1", printed) == NUMBER.sub("1", content)
            shown, found = (list(map(float, NUMBER.findall(text))) for text in (content, printed))
            assert found == pytest.approx(shown, rel=0.1, abs=0.01)
    assert (tmp_path / "mycar.yaml").exists()
    assert sum(bool(line.strip()) for kind, code in BLOCK.findall(PAGE) if kind == "python"
               for line in code.splitlines()) <= 35
