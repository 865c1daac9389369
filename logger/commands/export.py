"""``ridelog export``: finished logs to a USB stick, and the note that ``ridelog status`` shows of it."""

import re
import sys
from collections import Counter
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from logger.errors import BadInput, RidelogError
from logger.files import SETTINGS_BYTES, read_bounded
from logger.printable import counted, printable
from logger.question import Checked, Hidden, Option, Question, Verb
from logger.service.config import Config, find_config, load_config, load_pairing
from logger.store.export import sticks
from logger.store.export.export import ExportResult, Progress, export
from logger.store.log.atomic_file import is_taken

_PULL = "it may be pulled"


@dataclass(frozen=True, kw_only=True)
class ExportQuestion(Question):
    """Copy finished logs and recordings to a USB stick: checked, atomic, repeatable.

      sudo ridelog export --to /media/RIDELOG
      sudo ridelog export --to /mnt/backup --json

    Everything goes into ridelog/<this logger> on the stick, with a manifest that 'ridelog verify' checks. Files that
    are there already are checked and left alone. If the settings pair the logger with sticks, only a copy to a paired
    stick counts as an export. Exit status 0: all finished logs are there and marked; 1: they are not, and why; 2: wrong
    use.
    """

    to: Annotated[Path | None, Option("the stick, or any other folder", metavar="DIR", read=Path)] = None
    logs: Annotated[Path | None, Option("logs (default: the service's)", metavar="LOGDIR", read=Path,
                                        flag="--from")] = None
    config: Annotated[Path | None, Option("settings of the service", metavar="FILE", read=Path)] = None
    # What follows is typed by nobody: systemd/ridelog-export@.service passes it.
    unmounted: Annotated[Path | None, Hidden("say in the note that the stick that was mounted here may be pulled",
                                             read=Path)] = None
    removed: Annotated[bool, Hidden("the stick was pulled, and ridelog status no longer shows it")] = False
    mounted: Annotated[bool, Hidden("copy only if DIR is a mount point")] = False
    note: Annotated[Path | None, Hidden("file to write the note to", read=Path)] = None
    led: Annotated[Path | None, Hidden("the LED that shows the notes, /sys/class/leds/NAME", read=Path)] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.to is not None) + (self.unmounted is not None) + self.removed != 1:
            raise self.complaint(f"export: expected `to` DIR{' alone' * (self.to is not None)}")


VERB = Verb(ExportQuestion, "logger.commands.export:exported")


def exported(asked: ExportQuestion) -> Checked:
    """Copy what is asked for, with the note of the stick kept; or only say in the note what became of it."""
    board = _Board(asked.note, asked.led)
    if asked.removed or asked.unmounted is not None:
        return Checked("", {}, board.unmounted(asked.unmounted) if asked.unmounted is not None else board.removed())
    assert asked.to is not None
    if asked.mounted and not asked.to.is_mount():
        reason = f"{asked.to}: no stick could be mounted there; expected one with FAT or exFAT"
        board.report("unmounting", False, reason)
        return Checked(printable(reason), {"to": str(asked.to), "complete": False}, False)
    board.report("copying", True, "copying")
    try:
        config = _settings(asked.config, asked.logs)
        logs = asked.logs if asked.logs is not None else config.log.directory
        if asked.logs is None and asked.to.is_dir() and not logs.is_dir():
            raise BadInput(f"{logs}: expected a folder with the logs; --from LOGDIR names another")
        result = export(logs, asked.to, board.progress, config.pairing, by_hand=not asked.mounted)
    except RidelogError as error:
        board.report("unmounting", False, str(error))
        raise
    is_well = result.complete and result.unmarked is None
    board.report("unmounting", is_well, summary(result))
    return Checked("\n".join(map(printable, screen(result))),
                   {"to": str(asked.to), "complete": result.complete, **asdict(result)}, is_well)


def _settings(place: Path | None, logs: Path | None) -> Config:
    """Those of the service. A mistake in them must not keep logs in the car: then those that lie where logs lie without
    any setting, or in ``logs``, are taken, with a warning. Raises BadInput where there are none, and where the settings
    ask for a pairing, without which nothing may be given away."""
    found = find_config(place)
    try:
        return load_config(found)
    except BadInput as error:
        usual = Config()
        where = logs if logs is not None else usual.log.directory
        if _may_be_paired(found, where) or not any(where.glob("*.csv")):
            raise
        print(printable(f"{error}; the logs in {where} are copied"), file=sys.stderr)
        return usual


def _may_be_paired(settings: Path, logs: Path) -> bool:
    """False where a logger gives its logs to any stick for sure, though its settings are wrong or gone. What cannot be
    read counts as a pairing: the doubt is the owner's."""
    try:
        return load_pairing(settings).mode != sticks.OFF
    except BadInput:
        pass
    if is_taken(logs / sticks.PAIRED_NAME) or is_taken(sticks.Pairing().key_file):
        return True
    if not is_taken(settings):
        return False
    try:
        text = read_bounded(settings, SETTINGS_BYTES)
    except BadInput:
        return True
    # No YAML, perhaps not even UTF-8: all that can be looked for is a mode, outside of comments.
    said = re.sub(rb"#[^\n]*", b"", text.replace(b"\0", b""))
    return re.search(rb"\bmode\W+(first_stick|key_file)\b", said) is not None


def summary(result: ExportResult) -> str:
    """What happened, in one line."""
    there = f"{counted(len(result.copied), 'file')} copied ({result.bytes_copied / 1e6:.1f} MB), " \
            f"{len(result.already_there)} already there"
    if result.complete and result.unmarked is not None:
        return f"{there}, but this does not count as exported, and the logs stay on the card: {result.unmarked}"
    if result.complete:
        return there
    reason, _ = Counter(failure.reason for failure in result.failures).most_common(1)[0]
    return f"{counted(len(result.failures), 'file')} NOT copied: {reason}. {there}"


def screen(result: ExportResult) -> list[str]:
    """The lines a person sees."""
    lines = [f"{'ok' if result.complete and result.unmarked is None else 'WRONG'}: {summary(result)}"]
    reasons = Counter(failure.reason for failure in result.failures)
    for reason, count in reasons.most_common():
        first = next(failure.name for failure in result.failures if failure.reason == reason)
        lines.append(f"    {first}{f' and {count - 1} more' if count > 1 else ''}: {reason}")
    lines += [f"    set aside on the stick: {name}" for name in result.set_aside]
    if result.unmarked is not None and not result.complete:
        lines.append(f"    this does not count as exported, and the logs stay on the card: {result.unmarked}")
    return lines


class _Board:
    """The note of one stick, and the light; both only where they were asked for, and as far as they can be: that
    nobody can be notified is no reason not to copy."""

    def __init__(self, note: Path | None, led: Path | None) -> None:
        self._note = note
        self._led = led

    def report(self, state: sticks.StickState, ok: bool, text: str) -> None:
        if self._note is not None:
            before = sticks.read_note(self._note)
            try:
                sticks.write_note(self._note, sticks.StickNote(sticks.stick_of(self._note), state, ok, text))
            except OSError as error:
                print(f"{self._note}: no note can be kept ({error.strerror})", file=sys.stderr)
                self._note = None
                return
            if before is None or (before.state, before.ok) != (state, ok):
                self._show()

    def progress(self, progress: Progress) -> None:
        self.report("copying", True, f"copying, {progress.done} of {progress.total} files")

    def unmounted(self, place: Path) -> bool:
        """After the unmounting: only now may the stick be pulled. Whether it may."""
        before = sticks.read_note(self._note) if self._note is not None else None
        if place.is_mount():
            self.report("unmounting", False, f"{place} is still mounted; shut down before pulling it")
            return False
        if before is None or before.state in ("waiting", "copying"):
            self.report("ready", False, f"copying did not end as it should; {_PULL}")
        else:
            self.report("ready", before.ok, f"{before.text}; {_PULL}")
        return True

    def removed(self) -> bool:
        """After it was pulled."""
        if self._note is not None:
            with suppress(OSError):
                self._note.unlink(missing_ok=True)
            self._show()
        return True

    def _show(self) -> None:
        if self._led is not None and self._note is not None:
            sticks.show_on_led(self._led, self._note.parent)
