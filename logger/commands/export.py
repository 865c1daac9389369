"""Copy finished logs to a USB stick: checked, atomic, repeatable.

  sudo ridelog export --to /media/RIDELOG
  sudo ridelog export --to /media/RIDELOG --dumps

Everything goes into ridelog/<this logger> on the stick, with a manifest that 'ridelog verify' checks. What is there
already is read and left alone. If the settings pair the logger with sticks, only a copy to a paired one counts as an
export. Exit status 0: all finished logs are there and marked; 1: not so, and why; 2: wrong use.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import Counter
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput, RidelogError
from logger.files import read_bounded
from logger.printable import counted, printable
from logger.service.config import Config, find_config, load_config, load_pairing
from logger.store.export import sticks
from logger.store.export.export import ExportResult, Progress, export
from logger.store.formats.yaml_nodes import MAX_BYTES
from logger.store.log.atomic_file import is_taken

_PULL = "it may be pulled"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog export``."""
    phase = parser.add_mutually_exclusive_group(required=True)
    phase.add_argument("--to", metavar="DIR", type=Path, help="the stick, or any other folder")
    parser.add_argument("--from", dest="logs", metavar="LOGDIR", type=Path, help="logs (default: the service's)")
    parser.add_argument("--dumps", action="store_true", help="also the recorded dumps")
    parser.add_argument("--config", metavar="FILE", type=Path, help="settings of the service")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")
    # What follows is typed by nobody: systemd/ridelog-export@.service passes it. --unmounted: say in the note that this
    # stick may be pulled; --removed: it was, and ridelog status no longer shows it; --mounted: only if DIR is a mount
    # point; --note: the file of the note; --led: the light that shows the notes, /sys/class/leds/NAME.
    phase.add_argument("--unmounted", type=Path, help=argparse.SUPPRESS)
    phase.add_argument("--removed", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--mounted", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--note", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--led", type=Path, help=argparse.SUPPRESS)


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog export``."""
    board = _Board(args.note, args.led)
    if args.removed:
        return board.removed()
    if args.unmounted is not None:
        return board.unmounted(args.unmounted)
    if args.mounted and not args.to.is_mount():
        reason = f"{args.to}: no stick could be mounted there; expected one with FAT or exFAT"
        board.report("unmounting", False, reason)
        print(printable(reason))
        return EXIT_CHECK_FAILED
    board.report("copying", True, "copying")
    try:
        config = _settings(args.config, args.logs)
        logs = args.logs if args.logs is not None else config.log.directory
        if args.logs is None and args.to.is_dir() and not logs.is_dir():
            raise BadInput(f"{logs}: expected a folder with the logs; --from LOGDIR names another")
        result = export(logs, args.to, args.dumps, board.progress, config.pairing, by_hand=not args.mounted)
    except RidelogError as error:
        board.report("unmounting", False, str(error))
        raise
    is_well = result.complete and result.unmarked is None
    board.report("unmounting", is_well, summary(result))
    if args.json:
        print(json.dumps({"to": str(args.to), "complete": result.complete, **asdict(result)}))
    else:
        print("\n".join(map(printable, screen(result))))
    return EXIT_DONE if is_well else EXIT_CHECK_FAILED


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
        text = read_bounded(settings, MAX_BYTES)
    except BadInput:
        return True
    # No YAML, perhaps not even UTF-8: all that can be looked for is a mode, outside of comments.
    said = re.sub(rb"#[^\n]*", b"", text.replace(b"\0", b""))
    return re.search(rb"\bmode\W+(first_stick|key_file)\b", said) is not None


def summary(result: ExportResult) -> str:
    """What happened, in one line."""
    there = f"{counted(len(result.copied), 'file')} copied ({result.bytes_copied / 1e6:.1f} MB), " \
            f"{len(result.already_there)} {'was' if len(result.already_there) == 1 else 'were'} there"
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

    def unmounted(self, place: Path) -> int:
        """After the unmounting: only now may the stick be pulled."""
        before = sticks.read_note(self._note) if self._note is not None else None
        if place.is_mount():
            self.report("unmounting", False, f"{place} is still mounted; shut down before pulling it")
            return EXIT_CHECK_FAILED
        if before is None or before.state in ("waiting", "copying"):
            self.report("ready", False, f"copying did not end as it should; {_PULL}")
        else:
            self.report("ready", before.ok, f"{before.text}; {_PULL}")
        return EXIT_DONE

    def removed(self) -> int:
        if self._note is not None:
            with suppress(OSError):
                self._note.unlink(missing_ok=True)
            self._show()
        return EXIT_DONE

    def _show(self) -> None:
        if self._led is not None and self._note is not None:
            sticks.show_on_led(self._led, self._note.parent)
