"""``ridelog lab`` and ``ridelog demo --lab``: the loop with and without somebody to ask, its files and its page."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from html import escape
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_model
from logger.vehicle.effect import ForceEffect, chosen
from logger.vehicle.laws import CornerLaws

from ..support.command import called
from ..support.lab.runs_with_effects import FEW, named, write_runs


@pytest.fixture(autouse=True)
def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {name: shipped_effects()[name] for name in FEW}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return write_runs(tmp_path_factory.mktemp("offset"), named("sensor_offset", offset_m=0.4), lasts_s=8.0)


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Somebody at a terminal who gives these answers in turn; what they are asked is kept."""
    def these(*answers: str) -> list[str]:
        asked: list[str] = []
        left = iter(answers)

        def answer(question: str) -> str:
            asked.append(question)
            return next(left)

        terminal = StringIO()
        monkeypatch.setattr(terminal, "isatty", lambda: True, raising=False)
        monkeypatch.setattr("sys.stdin", terminal)
        monkeypatch.setattr("builtins.input", answer)
        return asked

    return these


def lab(runs: list[str], out: Path, *arguments: str) -> int:
    return main(["lab", "--vehicle", "rav4-2009", *runs, "--out", str(out), *arguments])


class _Whole(HTMLParser):
    """Tags that are open, and all that were."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.add(tag)
        if tag not in ("meta", "path", "rect", "circle"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in ("meta", "path", "rect", "circle"):
            assert self.open.pop() == tag


@pytest.mark.slow
def test_nobody_to_ask(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str],
                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", StringIO())
    assert lab(runs, tmp_path / "out") == 0
    reported = capsys.readouterr()
    assert reported.err.count("as with --yes") == 1 and "as with --yes" in reported.err
    order = [reported.out.index(f"=== {title} ===") for title in
             ("Compare", "Diagnose", "Add sensor_offset", "Compare again", "The end")]
    assert order == sorted(order)
    assert "Nothing more is missing" in reported.out
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["story.html", "vehicle-1.yaml"]
    assert [one.effect.name for one in read_model(tmp_path / "out" / "vehicle-1.yaml").effects] == ["sensor_offset"]
    html = (tmp_path / "out" / "story.html").read_text("utf-8")
    whole = _Whole()
    whole.feed(html)
    assert not whole.open and not {"script", "img", "link"} & whole.seen
    assert not re.search(r"\b(nan|inf)\b", html)
    for words in ("NRMSE, model by model", "with sensor_offset", "Before and after",
                  "What the missing effects had biased",
                  escape(shipped_effects()["sensor_offset"].source)):
        assert words in html


@pytest.mark.slow
def test_for_a_program_where_nothing_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert lab(write_runs(tmp_path / "runs", [], lasts_s=12.0), tmp_path / "out", "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["added"] == [] and reported["refused"] == [] and reported["unexplained"] is False
    assert [one["error"] for one in reported["errors"][:-1]] == [reported["error_before"], reported["error_after"]]
    assert reported["error_after"] == pytest.approx(reported["noise_floor_error"], rel=0.1)
    assert reported["vehicles"] == [] and Path(reported["story"]).read_text("utf-8").startswith("<!doctype html>")


@pytest.mark.slow
def test_somebody_who_says_no(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str],
                              answering: Callable[..., list[str]]) -> None:
    asked = answering("rust", "no")
    assert lab(runs, tmp_path) == 0
    assert len(asked) == 2 and "Add sensor_offset?" in asked[0]
    reported = capsys.readouterr().out
    assert "Expected yes, no, or one of " in reported
    assert "Missing, but you chose not to add: sensor_offset." in reported
    assert [path.name for path in tmp_path.iterdir()] == ["story.html"]


@pytest.mark.slow
def test_somebody_who_wants_another_one_first(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                              answering: Callable[..., list[str]]) -> None:
    answering("roll", "sensor_gain", "y")
    assert lab(runs, tmp_path) == 0
    reported = capsys.readouterr().out
    assert "elevation_right_m" in reported  # why it cannot be roll
    assert reported.index("=== Add sensor_gain ===") < reported.index("=== Add sensor_offset ===")
    assert [one.effect.name for one in read_model(tmp_path / "vehicle-2.yaml").effects] == ["sensor_gain",
                                                                                            "sensor_offset"]
    assert len(read_model(tmp_path / "vehicle-2.yaml").history) == 4


class Square(ForceEffect):
    """A damper by the square of the rate: no effect of the few is like it."""

    name = "square"

    def laws(self, p: SimpleNamespace, laws: CornerLaws) -> CornerLaws:
        return laws.with_force(lambda travel_m, rate_mps: 2500.0 * rate_mps * np.abs(rate_mps))


@pytest.mark.slow
def test_a_law_is_offered_where_no_effect_explains_it(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                      answering: Callable[..., list[str]]) -> None:
    runs = write_runs(tmp_path / "runs", [chosen(Square(), {})], lasts_s=16.0)
    asked = answering("maybe", "no", *["no"] * 4)
    assert lab(runs[1:], tmp_path / "not") == 0
    assert "Learn a law from the data" in asked[0] and "Expected yes or no." in capsys.readouterr().out
    assert not (tmp_path / "not" / "law.py").exists()
    out = tmp_path / "out"
    assert lab(runs, out, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["law"] == str(out / "law.py") and printed["added"] == ["learned_force_by_rate"]
    assert printed["error_after"] < 1.1 * printed["noise_floor_error"] and not printed["unexplained"]
    assert [one.effect.name for one in read_model(out / "vehicle-1.yaml").effects] == ["learned_force_by_rate"]
    html = (out / "story.html").read_text("utf-8")
    for words in ("A law learned from the runs", "The law", "power_ratio", "with learned_force_by_rate"):
        assert words in html
    told_of = [html.index(words) for words in ("<h2>What was missing", "<h2>A law learned from the runs", "<h2>Finally",
                                               "Nothing is missing: with")]
    assert told_of == sorted(told_of)


def test_nobody_to_ask_and_bad_input_is_one_line(runs: list[str], tmp_path: Path,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", StringIO())
    out = tmp_path / "file"
    out.touch()
    done = called("lab", "--vehicle", "rav4-2009", runs[0], "--out", out)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"ridelog: --out {out}: expected a folder\n"


@pytest.mark.slow
def test_no_more_files_are_written_than_were_looked_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("logger.api.lab.loop.MOST_ROUNDS", 1)
    two = [*named("sensor_offset", offset_m=0.5), *named("time_offset", delay_s=0.02)]
    few = {one.effect.name: one.effect for one in two}
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
    assert lab(write_runs(tmp_path / "runs", two, lasts_s=8.0), tmp_path / "out", "--yes") == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["story.html", "vehicle-1.yaml"]
    words = " ".join(capsys.readouterr().out.split())
    added = read_model(tmp_path / "out" / "vehicle-1.yaml").effects[0].effect.name
    left = ({"sensor_offset", "time_offset"} - {added}).pop()
    assert f"Missing, but not added: {left}." in words and "Nothing more is missing" not in words


def test_the_demos_drives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--lab", "--unpack", "--out", str(tmp_path), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["runs"] == [str(tmp_path / "slow"), str(tmp_path / "brisk")]
    with pytest.raises(BadInput, match="expected --lab, --field, --car or --years"):
        main(["demo", "--unpack"])
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match="expected a folder"):
        lab(reported["runs"], tmp_path / "file")
