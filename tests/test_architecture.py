"""Who may import whom, read from the sources. Each rule was broken by hand once, to see it fail."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import drivers
import logger

TREES = {
    ".".join((package.__name__, *path.relative_to(root).with_suffix("").parts)): ast.parse(path.read_text("utf-8"))
    for package in (drivers, logger) for root in [Path(str(package.__file__)).parent] for path in root.rglob("*.py")
}
BELOW = {
    "dsp", "roads", "comfort", "vehicle", "estimation", "identification", "modal", "lab",
    "units", "records", "errors",
}
OUTSIDE = {"os", "sys", "io", "pathlib", "time", "socket", "logging", "subprocess", "threading", "yaml", "drivers"}
ON_BOARD = [name for name in TREES if name.startswith("logger.service.")] + ["logger.commands.run"]


def imports(module: str) -> set[str]:
    """Every module or name that a module imports, wherever in it the import stands."""
    found = set()
    for node in ast.walk(TREES[module]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} imports relatively"
            found |= {str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def closure(start: list[str]) -> set[str]:
    """Modules of ours that these load, or their functions may, directly or through others."""
    found, new = set(), set(start)
    while new:
        found |= new
        new = {name for module in new for name in imports(module) if name in TREES} - found
    return found


@pytest.mark.parametrize("module", TREES)
def test_arrows_point_one_way(module: str) -> None:
    parts = module.split(".")
    imported = imports(module)
    if parts[0] == "drivers":
        assert not {name for name in imported if name.split(".")[0] == "logger"}
    elif parts[1] in BELOW:
        above = {name for name in imported if name.startswith("logger.") and name.split(".")[1] not in BELOW}
        assert not above | {name for name in imported if name.split(".")[0] in OUTSIDE}


def test_what_runs_on_board_never_loads_what_belongs_to_the_desk() -> None:
    on_board = closure(ON_BOARD)
    assert "logger.dsp.sections" in on_board
    assert not {module for module in on_board if "scipy" in {name.split(".")[0] for name in imports(module)}}
    assert not {module for module in on_board if module.split(".")[1] in {"report", "lab", "sysid", "studies", "demo"}}


def test_a_service_that_logs_a_drive_has_loaded_nothing_of_the_desk(short_dump: Path, tmp_path: Path) -> None:
    """In a process of its own: every module of the service, and a drive through the code that runs in the car."""
    code = f"""
import importlib, json, pkgutil, sys
import logger.service
from logger.commands.main import main
for module in pkgutil.iter_modules(logger.service.__path__):
    importlib.import_module("logger.service." + module.name)
import logger.commands.run
assert main(["replay", {str(short_dump)!r}, "--out", {str(tmp_path)!r}, "--json"]) == 0
print(json.dumps(sorted(sys.modules)))
"""
    played = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = json.loads(played.stdout.splitlines()[-1])
    assert "logger.service.start" in loaded
    assert list(tmp_path.glob("*.csv"))
    desk = ("logger.lab", "logger.identification", "logger.modal", "logger.studies", "scipy")
    assert not [name for name in loaded if name.startswith(desk)]


@pytest.mark.parametrize("module", TREES)
def test_only_commands_print(module: str) -> None:
    calls = [node for node in ast.walk(TREES[module]) if isinstance(node, ast.Name) and node.id == "print"]
    assert module.startswith("logger.commands.") or not calls


@pytest.mark.parametrize("module", TREES)
def test_nothing_asks_the_system_for_the_date(module: str) -> None:
    """A Pi boots without a date and its clock may jump; time comes from the monotonic clock and the GPS."""
    forbidden = {("time", "time"), ("time", "time_ns"), ("datetime", "now"), ("datetime", "utcnow"), ("date", "today")}
    attributes = [node for node in ast.walk(TREES[module]) if isinstance(node, ast.Attribute)]
    asked = {(node.value.id, node.attr) for node in attributes if isinstance(node.value, ast.Name)}
    assert not asked & forbidden
