"""Who may import whom, read from the sources. Each rule was broken by hand once, to see it fail."""

import ast
import importlib
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import drivers
import logger
import ridelog

ROOT = Path(__file__).parents[1]
SOURCES = {module: path for path, module in {
    path: ".".join((package.__name__, *path.relative_to(root).with_suffix("").parts))
    for package in (drivers, logger, ridelog) for root in [Path(str(package.__file__)).parent]
    for path in root.rglob("*.py")
}.items()}
"""Modules and their sources; the public package, which in a repository lies inside ``logger``, by its own name."""
READS_FOLDERS = "drivers.catalogue."
"""Imports the modules of a folder, and knows no bus."""
OUTWARD = ("ridelog.", "logger.public.")
"""Names of the public package: as others know it, and by its folder in a repository."""
FLOORS = (
    "arrays", "errors", "bounds", "units", "geodesy", "records", "chart_data", "printable", "left_out", "fitting",
    "dsp", "comfort", "profiles", "runs", "vehicle", "roads", "estimation", "simulation", "identification", "modal",
    "lab", "extraction",
    "files", "shipped", "plugins", "installation", "store", "question", "exchange", "studies", "service", "report",
    "fleet", "demo", "api", "commands",
)
"""Folders and single modules of ``logger``, from the lowest floor up: imports run downwards only."""
STORE = ("formats", "log", "export", "integrity")
"""The same inside ``logger.store``."""
NUMERICAL = FLOORS[: FLOORS.index("extraction") + 1]
"""Floors of arrays and units: no files, no clocks, no processes."""
OUTSIDE = {"os", "sys", "io", "pathlib", "time", "socket", "logging", "subprocess", "threading", "yaml", "drivers"}
CARRIED = {
    "arrays", "errors", "bounds", "units", "geodesy", "records", "printable", "dsp", "comfort", "profiles", "runs",
    "vehicle", "roads", "estimation", "files", "shipped", "plugins", "installation", "store", "question", "service",
    "commands",
}
"""Floors that a car carries; every other floor is the desk's."""
ON_BOARD = [name for name in SOURCES if name.startswith("logger.service.")] + [
    f"logger.commands.{name}" for name in ("main", "run", "status", "export", "verify", "capture", "install")
]


@dataclass(frozen=True)
class Used:
    """What rules ask of a module. Its tree is let go: all of them together are 160 MB, which every search for garbage
    would go through.

    names    of modules, or in them, that it imports, wherever in it the import stands
    prints   lines that print; clocks: lines that ask the system for the date
    writes   whether it may write a file
    """

    names: frozenset[str]
    prints: tuple[int, ...]
    clocks: tuple[int, ...]
    writes: bool


def tree(module: str) -> ast.Module:
    """A module as it is written."""
    return ast.parse(SOURCES[module].read_text("utf-8"))


@cache
def used(module: str) -> Used:
    """By a module."""
    names: set[str] = set()
    prints, clocks, is_writing = [], [], False
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} imports relatively"
            names |= {str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Name) and node.id == "print":
            prints.append(node.lineno)
        elif isinstance(node, ast.Attribute) and node.attr in WALL_CLOCKS.get(
                getattr(node.value, "attr", getattr(node.value, "id", "")), ()):
            clocks.append(node.lineno)
        is_writing |= writes(node)
    return Used(frozenset(names), tuple(prints), tuple(clocks), is_writing)


def floor_of(module: str) -> str:
    """Folder or single module of ``logger`` that a name belongs to."""
    return module.split(".")[1]


MODULES = [name for name in SOURCES if name.startswith("logger.") and floor_of(name) != "__init__"]
DESK = {floor_of(name) for name in MODULES} - CARRIED


def imports(module: str) -> frozenset[str]:
    """Every module or name that a module imports."""
    return used(module).names


def closure(start: list[str]) -> set[str]:
    """Modules of ours that these load, or their functions may, directly or through others."""
    found, new = set(), set(start)
    while new:
        found |= new
        new = {name for module in new for name in imports(module) if name in SOURCES} - found
    return found


MOST_CONSTANTS = 62
"""Lines of the lab, without its laws and plans, that give a number a name."""


def has_number(value: ast.AST) -> bool:
    """Whether an expression holds a number that is written there."""
    return any(isinstance(node, ast.Constant) and type(node.value) in (int, float) for node in ast.walk(value))


def named_numbers(module: str) -> Iterator[tuple[str, bool]]:
    """Names that a module gives to numbers, and whether a reason stands with each: a docstring or a comment."""
    text = SOURCES[module].read_text("utf-8").splitlines()
    body = tree(module).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None and has_number(node.value):
            is_said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            beside = [text[node.lineno - 2], *text[node.lineno - 1 : node.end_lineno]]
            yield ast.unparse(node), is_said or any("#" in line for line in beside)


LAB = [name for name in MODULES if name.startswith("logger.lab.") and name.split(".")[2] not in ("laws", "plan")]


def test_the_lab_has_few_constants_and_says_where_each_is_from() -> None:
    named = [(module, *one) for module in LAB for one in named_numbers(module)]
    assert len(named) <= MOST_CONSTANTS
    assert not [(module, text) for module, text, is_said in named if not is_said]


def test_every_folder_has_a_floor() -> None:
    assert sorted(FLOORS) == sorted({floor_of(name) for name in MODULES})
    assert set(FLOORS) > CARRIED


def test_imports_run_downwards() -> None:
    ranks = {floor: rank for rank, floor in enumerate(FLOORS)}
    assert not [(module, name) for module in MODULES for name in imports(module)
                if name.startswith("logger.") and ranks.get(floor_of(name), len(ranks)) > ranks[floor_of(module)]]


def test_imports_inside_the_store_run_downwards() -> None:
    stored = [name for name in MODULES if floor_of(name) == "store" and name.count(".") > 1 and "__init__" not in name]
    ranks = {name: STORE.index(name.split(".")[2]) for name in stored}
    assert not {(name, used) for name in stored for used in imports(name) & set(stored) if ranks[used] > ranks[name]}


def test_every_folder_with_code_is_installed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    packages = {name.rpartition(".")[0].removesuffix(".__init__") for name in SOURCES}
    assert packages <= set(settings["tool"]["setuptools"]["packages"])


def test_numerical_folders_know_no_files_and_no_clocks() -> None:
    numerical = [name for name in MODULES if floor_of(name) in NUMERICAL]
    assert not [(module, name) for module in numerical for name in imports(module) if name.split(".")[0] in OUTSIDE
                and not f"{name}.".startswith(READS_FOLDERS)]


def test_drivers_know_nothing_of_the_logger() -> None:
    of_drivers = [name for name in SOURCES if name.startswith("drivers.")]
    assert not [(module, name) for module in of_drivers for name in imports(module) if name.split(".")[0] == "logger"]


def test_the_public_interface_names_what_the_api_has_and_nothing_of_ours_uses_it() -> None:
    """Its names are loaded when they are asked for; type checkers read in the stub where they are from."""
    stub = ast.parse(Path(str(ridelog.__file__)).with_suffix(".pyi").read_text("utf-8"))
    homes = {alias.asname: str(node.module) for node in stub.body if isinstance(node, ast.ImportFrom)
             for alias in node.names}
    assert sorted(homes) == sorted(ridelog.__all__)
    assert all(getattr(importlib.import_module(module), name) is getattr(ridelog, name)
               for name, module in homes.items() if name != "effects")
    assert {floor_of(name) for name in homes.values()} - {"errors", "identification"} == {"api"}
    assert not {module for module in SOURCES for name in imports(module) if f"{name}.".startswith(OUTWARD)}


def test_no_file_imports_itself_through_others() -> None:
    loads = {module: imports(module) & set(SOURCES) - {module} for module in SOURCES}
    while loose := {module for module, needs in loads.items() if not needs & set(loads)}:
        loads = {module: needs for module, needs in loads.items() if module not in loose}
    assert not loads


def test_what_runs_on_board_never_loads_what_belongs_to_the_desk() -> None:
    on_board = closure(ON_BOARD)
    assert "logger.dsp.filters" in on_board
    assert not {module for module in on_board if "scipy" in {name.split(".")[0] for name in imports(module)}}
    assert not {module for module in on_board if module.startswith("logger.") and floor_of(module) in DESK}


def test_a_service_that_logs_a_drive_has_loaded_nothing_of_the_desk(short_dump: Path, tmp_path: Path) -> None:
    """In a process of its own: every module of the service, and a drive through the code that runs in the car, in one
    that has effects."""
    plain = (ROOT / "config/vehicles/rav4-2009.yaml").read_text("utf-8")
    effects = "effects: [{name: dry_friction, friction_force_n: 60}, {name: sensor_gain, gain: 1.1}]"
    car = tmp_path / "car.yaml"
    car.write_text(plain.replace("effects: []", f"{effects}\nstandard_errors: {{sprung_mass_kg: 20}}"), "utf-8")
    code = f"""
import importlib, json, pkgutil, sys
import logger.service
from logger.commands.main import main
for module in pkgutil.walk_packages(logger.service.__path__, "logger.service."):
    importlib.import_module(module.name)
import logger.commands.run
assert main(["replay", {str(short_dump)!r}, "--out", {str(tmp_path)!r}, "--json", "--vehicle", {str(car)!r}]) == 0
print(json.dumps(sorted(sys.modules)))
"""
    played = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = json.loads(played.stdout.splitlines()[-1])
    assert "logger.service.serve" in loaded
    assert list(tmp_path.glob("*.csv"))
    assert {"lab", "identification", "modal", "studies"} <= DESK
    desk = {"scipy", "numba"} | {f"logger.{folder}" for folder in DESK - {"report"}}  # a replay ends with a summary
    assert not [name for name in loaded if ".".join(name.split(".")[:2]) in desk or name.split(".")[0] in desk]


def test_only_commands_print() -> None:
    assert not [(module, used(module).prints) for module in SOURCES
                if used(module).prints and not module.startswith("logger.commands.")]


WALL_CLOCKS = {"time": {"time", "time_ns", "localtime", "gmtime", "ctime", "CLOCK_REALTIME"},
               "datetime": {"now", "utcnow", "today"}, "date": {"today"}}


def test_nothing_asks_the_system_for_the_date() -> None:
    """A Pi boots without a date and its clock may jump; time comes from the monotonic clock and the GPS."""
    assert not [(module, used(module).clocks) for module in SOURCES if used(module).clocks]


WRITING = {"write_text", "write_bytes", "savetxt", "savez", "savez_compressed", "tofile", "savefig",
           "write_table", "write_arrow", "to_csv", "to_parquet", "ZipFile", "NamedTemporaryFile", "mkstemp",
           "rename", "renames", "copy2", "copyfile", "copytree"}
"""Calls that may write a file, or put one in the place of another."""
WRITERS_OF_FILES = {
    "drivers.accelerometers._iio_device": "settings of the kernel's driver, which are no files on a disk",
    "drivers.disk": "the one way of the car, and what the one writer of the desk goes through",
    "logger.commands.main": "nowhere, when nobody reads on", "logger.files": "the one writer of whole files",
    "logger.installation": "a link, put into place",
    "logger.service.status": "a file in memory, every second, without waiting for a disk",
    "logger.store.export.directory_handle": "sticks, which a hand may pull",
    "logger.store.export.export": "the same", "logger.store.export.sticks": "an LED of the board",
    "logger.store.log.atomic_file": "the car's small files, through drivers.disk",
    "logger.store.log.disk_quota": "the same",
    "logger.store.log.recovery": "the same",
}


def writes(node: ast.AST) -> bool:
    """Whether a call may write a file by its path; into memory, or through the writer of ``logger.files``, is none."""
    if not isinstance(node, ast.Call):
        return False
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    given = [one.value for one in [*node.args, *(word.value for word in node.keywords)]
             if isinstance(one, ast.Constant) and isinstance(one.value, str)]
    if called == "open":
        return any(set(mode) <= set("rwaxbt+U") and set(mode) & set("wax+") for mode in given) or any(
            isinstance(one, ast.Attribute) and one.attr in {"O_WRONLY", "O_RDWR", "O_CREAT"} for one in ast.walk(node))
    if called == "replace":  # of a path; a text's takes two words, a dataclass's keywords
        return len(node.args) == 1 and not node.keywords
    into_memory = {"made", "archive"} & {one.id for one in node.args if isinstance(one, ast.Name)}
    ours = called in {"write_text", "write_table"} and isinstance(node.func, ast.Name)
    reads = called == "ZipFile" and not any(mode in given for mode in ("w", "a", "x"))
    return called in WRITING and not (into_memory or ours or reads)


def test_files_are_written_in_one_place() -> None:
    assert {module for module in SOURCES if used(module).writes} == set(WRITERS_OF_FILES)
    for words in ("open(a, 'w')", "a.open(mode='x')", "a.write_text(b)", "np.savetxt(a, b)", "figure.savefig(a)",
                  "ZipFile(a, 'w')", "a.replace(b)", "os.open(a, os.O_WRONLY)", "pq.write_table(b, a)"):
        assert writes(ast.parse(words, mode="eval").body), words
