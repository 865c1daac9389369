"""Installing and undoing it, in a folder that stands for a machine's root; and every step of a real one, as words."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest

import logger
from logger import installation as store
from logger.commands.main import main
from logger.errors import BadInput, CheckFailed
from logger.installation import (
    COMMAND,
    CONFIG,
    ENABLED,
    FILES,
    LOGS,
    PROGRAM,
    RECORD,
    Installation,
    InstallationStep,
    hidden_from_services,
    run_command,
)
from logger.service.config import load_config
from logger.shipped import shipped

UNIT = "etc/systemd/system/ridelog.service"
OTHER_PROGRAM = Path("/srv/ridelog/bin/ridelog")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A machine that has other things on it."""
    for name in ("etc/udev/rules.d/70-other.rules", "etc/passwd", "usr/local/bin/other"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("other\n")
    return tmp_path


@pytest.fixture
def ran() -> list[tuple[str, ...]]:
    return []


def installation(root: Path, ran: list[tuple[str, ...]], program: Path = PROGRAM) -> Installation:
    return Installation(root, program, lambda words: ran.append(tuple(words)))


def take(steps: list[InstallationStep]) -> list[str]:
    for step in steps:
        if step.act is not None:
            step.act()
    return [step.words for step in steps]


def everything(root: Path) -> dict[str, str]:
    """All names under a root, with the content of files and the target of links."""
    return {str(path.relative_to(root)): f"-> {path.readlink()}" if path.is_symlink() else path.read_text()
            for path in root.rglob("*") if path.is_symlink() or path.is_file()}


def test_the_steps_on_a_machine_are_exactly_these(tmp_path: Path) -> None:
    class OnThisMachine(Installation):
        @property
        def _is_this_machine(self) -> bool:
            return True

    machine = OnThisMachine(tmp_path, OTHER_PROGRAM, run_command)
    assert [step.words.replace(str(tmp_path), "") for step in machine.install()] == [
        "write /etc/sysusers.d/ridelog.conf",
        "write /etc/ridelog/ridelog.yaml",
        "write /etc/systemd/system/ridelog.service",
        "write /etc/systemd/system/ridelog-export@.service",
        "write /etc/systemd/system/ridelog-car.service",
        "write /etc/udev/rules.d/90-ridelog.rules",
        "link /etc/systemd/system/multi-user.target.wants/ridelog.service to /etc/systemd/system/ridelog.service",
        "link /usr/local/bin/ridelog to /srv/ridelog/bin/ridelog",
        "write /etc/ridelog/installed.json",
        "run systemd-sysusers /etc/sysusers.d/ridelog.conf",
        "run systemctl daemon-reload",
        "run udevadm control --reload",
        "run udevadm trigger --action=add --subsystem-match=leds",
        "run systemctl restart ridelog.service",
    ]
    installation(tmp_path, [], OTHER_PROGRAM).install()
    assert everything(tmp_path) == {}
    take(installation(tmp_path, [], OTHER_PROGRAM).install())
    undone = OnThisMachine(tmp_path, OTHER_PROGRAM, run_command).uninstall()
    assert [step.words.replace(str(tmp_path), "") for step in undone] == [
        "run systemctl stop ridelog.service ridelog-export@*.service ridelog-car*.service",
        "remove /etc/systemd/system/multi-user.target.wants/ridelog.service",
        "remove /usr/local/bin/ridelog",
        "remove /etc/sysusers.d/ridelog.conf",
        "remove /etc/ridelog/ridelog.yaml",
        "remove /etc/systemd/system/ridelog.service",
        "remove /etc/systemd/system/ridelog-export@.service",
        "remove /etc/systemd/system/ridelog-car.service",
        "remove /etc/udev/rules.d/90-ridelog.rules",
        "remove /etc/ridelog/installed.json",
        "remove /etc/ridelog if it is empty",
        "run systemctl daemon-reload",
        "run udevadm control --reload",
        "keep the user ridelog (userdel ridelog removes it)",
    ]


def test_what_is_put_in_place_works_together(root: Path, ran: list[tuple[str, ...]]) -> None:
    take(installation(root, ran, OTHER_PROGRAM).install())
    assert load_config(root / CONFIG) == load_config(shipped("config") / "ridelog.yaml")
    for name in FILES:
        text = (root / name).read_text()
        assert str(PROGRAM) not in text
        assert (root / name).stat().st_mode & 0o777 == 0o644
    assert f"ExecStart={OTHER_PROGRAM} run" in (root / UNIT).read_text()
    assert (root / ENABLED).readlink() == Path("/etc/systemd/system/ridelog.service")
    assert (root / COMMAND).readlink() == OTHER_PROGRAM
    assert ran == [("systemd-sysusers", f"--root={root}", str(root / "etc/sysusers.d/ridelog.conf"))]


def test_uninstall_leaves_what_was_there_before_and_the_logs(root: Path, ran: list[tuple[str, ...]]) -> None:
    before = everything(root)
    take(installation(root, ran).install())
    (root / LOGS).mkdir(parents=True)
    (root / LOGS / "00001-001.csv").write_text("rows\n")
    words = take(installation(root, ran).uninstall())
    assert everything(root) == {**before, f"{LOGS}/00001-001.csv": "rows\n"}
    assert words[-1] == f"keep {root / LOGS} and the user ridelog who owns it"
    assert not (root / "etc/ridelog").exists()
    take(installation(root, ran).uninstall())
    assert everything(root) == {**before, f"{LOGS}/00001-001.csv": "rows\n"}


def test_a_second_time_nothing_changes(root: Path, ran: list[tuple[str, ...]]) -> None:
    take(installation(root, ran).install())
    before = everything(root)
    words = take(installation(root, ran).install())
    assert everything(root) == before
    assert len([line for line in words if line.endswith("it is there")]) == len(FILES) + 2


@pytest.mark.parametrize("name", [CONFIG, UNIT])
def test_what_was_changed_by_hand_is_never_lost(root: Path, ran: list[tuple[str, ...]], name: str) -> None:
    take(installation(root, ran).install())
    original = (root / name).read_text()
    (root / name).write_text("mine\n")
    words = take(installation(root, ran).install())
    assert f"keep {root / name}: it was changed; write {root / name}.new beside it" in words
    assert (root / name).read_text() == "mine\n"
    assert (root / f"{name}.new").read_text() == original
    assert f"keep {root / name}: it was changed" in take(installation(root, ran).uninstall())
    assert (root / name).read_text() == "mine\n"
    assert not (root / f"{name}.new").exists()


def test_a_newer_version_replaces_what_was_not_changed(root: Path, ran: list[tuple[str, ...]]) -> None:
    take(installation(root, ran).install())
    words = take(installation(root, ran, OTHER_PROGRAM).install())
    assert f"replace {root / UNIT}" in words
    assert str(OTHER_PROGRAM) in (root / UNIT).read_text()
    assert f"link {root / COMMAND} to {OTHER_PROGRAM}, no longer to {PROGRAM}" in words
    assert (root / COMMAND).readlink() == OTHER_PROGRAM
    take(installation(root, ran, OTHER_PROGRAM).uninstall())
    assert not (root / COMMAND).is_symlink()


@pytest.mark.parametrize("kind", ["link", "file"])
def test_a_command_of_somebody_else_stays(root: Path, ran: list[tuple[str, ...]], kind: str) -> None:
    if kind == "link":
        (root / COMMAND).symlink_to("/opt/other/ridelog")
    else:
        (root / COMMAND).write_text("mine\n")
    before = everything(root)[COMMAND]
    assert f"keep {root / COMMAND}: ridelog did not make it" in take(installation(root, ran).install())
    take(installation(root, ran).install())
    take(installation(root, ran).uninstall())
    assert everything(root)[COMMAND] == before


def test_what_is_not_installed_is_undone_without_harm(tmp_path: Path) -> None:
    class OnThisMachine(Installation):
        @property
        def _is_this_machine(self) -> bool:
            return True

    def run(words: Sequence[str]) -> None:
        if words[1] == "stop":
            raise CheckFailed("Failed to stop ridelog.service: Unit ridelog.service not loaded.")

    words = take(OnThisMachine(tmp_path, PROGRAM, run).uninstall())
    assert words[0] == f"nothing to stop: no {tmp_path / UNIT}"


@pytest.mark.parametrize("arguments", [["install"], ["install", "--dry-run"]])
@pytest.mark.parametrize("hidden", ["program", "python", "code"])
def test_a_dry_run_refuses_what_the_real_one_would(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], hidden: str) -> None:
    """The venv may be well, and its Python be a link into a home, or its code an editable installation of one."""
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    places = {"program": tmp_path / "venv/bin/python", "python": tmp_path / "pyenv/python",
              "code": tmp_path / "src/x.py"}
    monkeypatch.setattr("sys.executable", str(places["program"]))
    monkeypatch.setattr(logger, "__file__", str(places["code"]))
    for place in places.values():
        place.parent.mkdir(parents=True)
    places["python"].touch()
    places["program"].symlink_to(places["python"])
    monkeypatch.setattr(store, "_HIDDEN_FROM_SERVICES", (str(places[hidden].parent),))
    with pytest.raises(BadInput, match="where a service can read them"):
        main(arguments)


def test_settings_that_were_there_first_stay_and_a_link_is_not_written_through(
        root: Path, ran: list[tuple[str, ...]]) -> None:
    (root / "etc/ridelog").mkdir()
    (root / "mine.yaml").write_text("mine\n")
    (root / CONFIG).symlink_to(root / "mine.yaml")
    take(installation(root, ran).install())
    take(installation(root, ran).uninstall())
    assert (root / CONFIG).is_symlink()
    assert (root / "mine.yaml").read_text() == "mine\n"


@pytest.mark.parametrize("record", ["", "[]", "7", '{"etc/passwd": "x", "../../etc/passwd": "y"}'])
def test_a_record_that_is_damaged_removes_nothing(root: Path, ran: list[tuple[str, ...]], record: str) -> None:
    take(installation(root, ran).install())
    (root / RECORD).write_text(record)
    take(installation(root, ran).uninstall())
    assert (root / CONFIG).exists()
    assert (root / UNIT).exists()
    assert (root / "etc/passwd").read_text() == "other\n"


def test_a_root_whose_folders_lead_out_of_it_is_refused(root: Path, ran: list[tuple[str, ...]], tmp_path: Path) -> None:
    inner = root / "inner"
    (inner / "etc").mkdir(parents=True)
    (root / "outside").mkdir()
    (inner / "etc/systemd").symlink_to(root / "outside")
    with pytest.raises(BadInput, match="leads out"):
        installation(inner, ran).install()
    assert list((root / "outside").iterdir()) == []


def test_a_step_that_fails_says_which(tmp_path: Path) -> None:
    with pytest.raises(CheckFailed, match="no-such-command: expected this command here"):
        run_command(["no-such-command"])
    with pytest.raises(CheckFailed, match="ls /no/such/place"):
        run_command(["ls", "/no/such/place"])
    run_command(["true"])


@pytest.mark.parametrize(("place", "hidden"), [
    ("/home/pi/venv/bin/ridelog", True), ("/root/venv/bin/ridelog", True), ("/tmp/venv/bin/ridelog", True),
    ("/opt/ridelog/bin/ridelog", False), ("/usr/bin/ridelog", False), ("/homes/x/ridelog", False),
])
def test_a_program_that_the_service_could_not_see_is_known(place: str, hidden: bool) -> None:
    assert hidden_from_services(Path(place)) is hidden


def words_of(arguments: Sequence[str], capsys: pytest.CaptureFixture[str]) -> list[str]:
    assert main(list(arguments)) == 0
    return capsys.readouterr().out.splitlines()


def test_a_dry_run_takes_no_step(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = everything(root)
    words = words_of(["install", "--dry-run", "--root", str(root)], capsys)
    assert f"write {root / UNIT}" in words
    assert words_of(["uninstall", "--dry-run", "--root", str(root)], capsys)
    assert everything(root) == before


@pytest.mark.skipif(shutil.which("systemd-sysusers") is None, reason="no systemd here to make the user with")
def test_the_command_does_what_its_dry_run_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "etc").mkdir()
    said = words_of(["install", "--dry-run", "--root", str(tmp_path)], capsys)
    assert words_of(["install", "--root", str(tmp_path)], capsys) == said
    assert (tmp_path / UNIT).is_file()
    user = next(line for line in (tmp_path / "etc/passwd").read_text().splitlines() if line.startswith("ridelog:"))
    assert user.endswith("/nologin")
    groups = {line.split(":")[0] for line in (tmp_path / "etc/group").read_text().splitlines() if "ridelog" in line}
    assert groups == {"ridelog", "i2c", "dialout"}
    said = words_of(["uninstall", "--dry-run", "--root", str(tmp_path)], capsys)
    assert words_of(["uninstall", "--root", str(tmp_path)], capsys) == said
    assert not (tmp_path / UNIT).exists()


def test_without_a_folder_or_rights_nothing_is_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match="expected a folder"):
        main(["install", "--root", str(tmp_path / "none")])
    monkeypatch.setattr("sys.executable", "/opt/ridelog/bin/python")
    monkeypatch.setattr("logger.__file__", "/opt/ridelog/lib/logger/__init__.py")
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(BadInput, match="sudo"):
        main(["install"])
    monkeypatch.setattr("sys.executable", "/home/pi/venv/bin/python")
    with pytest.raises(BadInput, match="where a service can read them"):
        main(["install"])


def test_a_port_that_is_not_on_the_pins_and_logs_in_memory_are_said(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "dev").mkdir()
    (tmp_path / "dev/ttyAMA10").touch()
    (tmp_path / "dev/serial0").symlink_to("ttyAMA10")
    main(["install", "--root", str(tmp_path)])
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note: ")]
    assert [line[:60] for line in said] == ["note: /dev/serial0 is the three-pin debug connector; pins 8 and 10"[:60]]
    (tmp_path / CONFIG).write_text("log: {directory: /dev/shm/logs}\ngps: {port: /dev/ttyUSB0}\n")
    monkeypatch.setattr("logger.commands.install._THIS_MACHINE", tmp_path)
    monkeypatch.setattr("logger.commands.install._refuse_hidden", lambda program: None)
    main(["install", "--root", str(tmp_path), "--dry-run"])
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("note: logs: /dev/shm/logs lies in memory (/dev/shm is a tmpfs, a file system in memory): ")
