"""The command line: verbs, help, and faults that end in one line and a status."""

import argparse
import json
import pkgutil
import platform
import re
import shlex
import subprocess
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import logger.commands
from drivers.errors import DumpError, NotPresent, SettingsError
from logger.commands import main
from logger.errors import BadInput, CheckFailed

from ..support.command import called


def test_every_file_of_the_folder_is_a_verb_and_every_verb_a_file_or_asked() -> None:
    files = {module.name for module in pkgutil.iter_modules(logger.commands.__path__)}
    helpers = {"main", "options"}
    verbs = {verb.replace("-", "_") for verb in main.VERBS if verb not in main.ASKED}
    assert files - helpers == verbs and set(main.ASKED) <= set(main.VERBS)


@pytest.mark.parametrize("verb", main.VERBS)
def test_every_verb_explains_itself(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as leaving:
        main.main([verb, "--help"])
    assert leaving.value.code == 0
    assert f"usage: ridelog {verb}" in capsys.readouterr().out


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """A verb's parser, or those of the verbs below it."""
    below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    for action in below:
        for name in action.choices:
            yield from parsers(action.choices[name])
    if not below:
        yield parser


@pytest.mark.parametrize("verb", main.VERBS)
def test_the_help_of_each_verb_has_two_examples_that_it_takes(verb: str) -> None:
    whole, _ = main.command(verb)
    for parser in parsers(whole):
        examples = re.findall(r"^ +(?:sudo )?ridelog (.+)$", (parser.description or "").replace("\\\n", " "),
                              re.MULTILINE)
        assert len(examples) >= 2, parser.prog
        for example in examples:
            words = shlex.split(example)
            main.command(words[0])[0].parse_args(words[1:])


def test_help_lists_the_verbs_and_loads_nothing_heavy() -> None:
    script = ("import sys\nfrom logger.commands.main import main\n"
              "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
              "print('heavy:', *{'numpy', 'scipy', 'yaml', 'serial', 'importlib.metadata'} & set(sys.modules))")
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert all(f"\n  {verb} " in out and meaning in out for verb, meaning in main.VERBS.items())
    assert out.endswith("heavy:\n")


def test_questions_load_nothing_heavy() -> None:
    script = ("import sys, importlib\nfrom logger.commands.main import ASKED\n"
              "for place, _, _ in (one.partition(':') for one in ASKED.values() if one.startswith('api.')):\n"
              "    importlib.import_module(f'logger.{place}')\n"
              "print('heavy:', *{'numpy', 'scipy', 'yaml', 'serial'} & set(sys.modules))")
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout == "heavy:\n"


def test_the_version_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("ridelog ")


@pytest.mark.parametrize("arguments", [[], ["dance"], ["--dance"], ["status", "--dance"], ["replay"],
                                       ["verify", "x", "--\x1b[2J"], ["\x1b[2J\n"]])
def test_wrong_use_is_one_line_and_status_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as leaving:
        main.main(arguments)
    reported = capsys.readouterr()
    assert leaving.value.code == 2
    assert reported.out == ""
    assert reported.err.count("\n") == 1
    assert "--help')" in reported.err
    assert "\x1b" not in reported.err


def fault(error: BaseException) -> Callable[[object], int]:
    def run(args: object) -> int:
        raise error
    return run


@pytest.mark.parametrize(("error", "status", "reported"), [
    (BadInput("a.yaml:3: expected a number"), 2, "ridelog: a.yaml:3: expected a number\n"),
    (CheckFailed("2 rows\nare torn"), 1, "ridelog: 2 rows are torn\n"),
    (DumpError("a.dump:1: expected a header"), 2, "ridelog: a.dump:1: expected a header\n"),
    (SettingsError("range_g 3"), 2, "ridelog: range_g 3\n"),
    (NotPresent("/dev/ttyUSB7: no such port"), 2, "ridelog: /dev/ttyUSB7: no such port\n"),
    (PermissionError(13, "Permission denied", "/x"), 2, "ridelog: /x: Permission denied\n"),
    (FileExistsError(17, "File exists", "/x"), 2, "ridelog: /x: expected a folder, found a file\n"),
    (IsADirectoryError(21, "Is a directory", "/x"), 2, "ridelog: /x: expected a file, found a folder\n"),
    (RuntimeError("Symlink loop from '/x'"), 2,
     "ridelog: '/x': expected a file or a folder, found a loop of symbolic links\n"),
    (MemoryError(), 2, "ridelog: not enough memory for so much data; cut it into shorter files\n"),
    (KeyboardInterrupt(), 130, ""),
    (BadInput("\x1b[2Jok.csv: expected\x9b a log"), 2, "ridelog: \\x1b[2Jok.csv: expected\\x9b a log\n"),
    (PermissionError(13, "Permission denied", "/\u202e\udcffx"), 2, "ridelog: /\\u202e\\udcffx: Permission denied\n"),
])
def test_an_expected_fault_is_one_line_and_its_status(
        error: BaseException, status: int, reported: str, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    verb = types.ModuleType("logger.commands.verify", "A verb that fails.")
    verb.__dict__.update(add_arguments=lambda parser: None, run=fault(error))
    monkeypatch.setitem(sys.modules, "logger.commands.verify", verb)
    monkeypatch.setattr(sys, "argv", ["ridelog", "verify"])
    with pytest.raises(SystemExit) as leaving:
        main.run()
    assert leaving.value.code == status
    assert capsys.readouterr().err == reported


def test_a_closed_pipe_is_no_traceback() -> None:
    script = "from logger.commands.main import run; run()"
    with subprocess.Popen([sys.executable, "-c", script, "--version"], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        reported = process.stderr.read()
    assert reported == b""
    assert process.returncode == main.EXIT_PIPE_CLOSED


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc alone")
def test_memory_that_was_freed_is_kept_for_the_next_arrays() -> None:
    """Of twenty times six arrays of 750 pages, freed before the next six, the first six have their pages cleared."""
    command = ("import resource, numpy\n"
               "from logger.commands.options import keep_freed_memory\n"
               "keep_freed_memory()\n"
               "before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
               "for _ in range(20): [numpy.ones(384000) for _ in range(6)]\n"
               "print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)")
    run = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    assert int(run.stdout) < 2 * 6 * 750


def test_no_value_is_dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What may repeat does all of it, and names each; what takes one value refuses a second, and does nothing."""
    monkeypatch.chdir(tmp_path)
    made = ["road", "generate", "--class", "B", "--length", "50", "--out", "road.csv"]
    for twice in (["--out", "b.csv"], ["--length=60"]):
        refused = called(*made, *twice)
        assert refused.returncode == 2 and refused.stderr.count("\n") == 1
        assert f"{twice[0].partition('=')[0]}: expected it once, found it twice" in refused.stderr
    assert not list(tmp_path.iterdir())
    assert called(*made).stderr.endswith("Wrote road.csv\n")
    names = ["a.html", "a.svg", "b.html", "c.html"]
    shown = called("iri", "road.csv", "--json", *(word for name in names for word in ("--out", name)))
    assert shown.returncode == 0 and json.loads(shown.stdout)
    assert shown.stderr.splitlines() == [f"Wrote {name}" for name in names]
    assert {path.name for path in tmp_path.iterdir()} == {*names, "road.csv"}
    again = called("iri", "road.csv", "--out", "a.html", "--out", "../" + tmp_path.name + "/a.html")
    assert again.returncode == 2 and "expected a different file each time" in again.stderr
