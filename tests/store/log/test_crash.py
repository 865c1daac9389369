"""The storage of the service cut at every change of the disk: killed, and without power; the repair cut as well.

A few hundred of the crashes of ``tests/benchmarks/faults.py``, and cuts that this bench once showed to be wrong.
"""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from logger.store.log.recovery import repair

from ...support.faults.crashes import HAZARDS, Life, crash
from ...support.faults.disk_models import CrashModel, RecordingFiles
from ...support.faults.trials import Hazard, cases_for_tests, label


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, quick=0), ids=label)
def test_cut_at_every_change(tmp_path: Path, hazard: Hazard, case: object) -> None:
    found = hazard.trial(tmp_path, case)
    assert found.wrong == ()
    assert found.trials > 100
    assert found.figures["rows_promised"] > 500
    assert found.figures["torn_or_damaged"] > 5 or hazard is HAZARDS[0]


def test_a_disk_that_forgets_what_was_synced_is_noticed(tmp_path: Path) -> None:
    """The trial itself can fail: without syncs the promise of rows cannot be held."""
    (tmp_path / "life").mkdir()
    life = Life(tmp_path / "life", 103, steps=25)
    life.files.journal[:] = [change for change in life.files.journal if change.kind != "sync"]
    rng = random.Random(1)
    wrong = [crash(life, count, True, rng, tmp_path / "after").wrong for count in range(40, 100)]
    assert any("every promised row" in words for words in wrong)


def test_a_sidecar_whose_part_never_got_its_name_goes(tmp_path: Path) -> None:
    life = tmp_path / "life"
    life.mkdir()
    Life(life, 104, steps=3)
    csv, = life.glob("*.csv")
    sidecar = csv.with_suffix(".json")
    csv.unlink()
    repair(life)
    assert sidecar.exists()  # somebody took a finished log away: not ours to tidy
    sidecar.write_text('{"log": {"state": "open"}}')
    repair(life)
    assert not sidecar.exists()


@pytest.mark.slow
def test_what_a_killed_process_left_is_on_the_disk_before_it_counts_as_finished(tmp_path: Path) -> None:
    """Killed, repaired, and the power goes at once: the repaired file is whole or the part is still there."""
    (tmp_path / "life").mkdir()
    life = Life(tmp_path / "life", 105, steps=25)
    count = next(place for place, change in enumerate(life.files.journal)
                 if change.note.rows > change.note.rows_safe + 3)  # type: ignore[attr-defined]
    rng = random.Random(2)
    for trial in range(60):
        outcome = crash(life, count, False, rng, tmp_path / f"after-{trial}", again=0.8)
        assert outcome.wrong == ""


def test_the_model_disk_keeps_what_was_synced_and_only_that(tmp_path: Path) -> None:
    files = RecordingFiles(tmp_path)
    descriptor = files.create(tmp_path / "a")
    files.write(descriptor, b"safe")
    files.sync(descriptor)
    files.sync_directory(tmp_path)
    files.write(descriptor, b"late" * 400)
    files.rename(tmp_path / "a", tmp_path / "b")
    files.close(descriptor)
    model = CrashModel.after(files, len(files.journal))
    assert model.killed() == {"b": b"safe" + b"late" * 400}
    images = [model.powerless(random.Random(seed)) for seed in range(200)]
    assert all(len(image) == 1 and set(image) <= {"a", "b"} for image in images)
    contents = [content for image in images for content in image.values()]
    assert all(content.startswith(b"safe") for content in contents)
    assert {"a", "b"} == {name for image in images for name in image}
    assert len(set(contents)) > 50
