"""The trials: each a function with a name, a promise, and checks with figures. A trial registers itself."""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from .guest import GuestFailed
from .shell import CommandFailed

if TYPE_CHECKING:
    from .bench import Bench


@dataclass(frozen=True)
class Check:
    """One thing that was tried: in words, whether the promise held (None: a figure without one), what was measured."""

    what: str
    held: bool | None
    figure: str


@dataclass
class Report:
    """What a trial found. ``times`` is how often it was done."""

    name: str
    promise: str
    guest: str
    commit: str = ""
    times: int = 1
    seconds: float = 0.0
    checks: list[Check] = field(default_factory=list)
    cannot: str = ""

    def check(self, what: str, held: bool, figure: object = "") -> None:
        """Write down one check, and print it."""
        self.checks.append(Check(what, bool(held), str(figure)))
        print(f"  {'ok   ' if held else 'WRONG'} {what}: {figure}", flush=True)

    def measure(self, what: str, figure: object) -> None:
        """Write down a figure of which nothing is promised, and print it."""
        self.checks.append(Check(what, None, str(figure)))
        print(f"        {what}: {figure}", flush=True)

    @property
    def held(self) -> bool:
        """Whether all that was promised held."""
        promised = [check.held for check in self.checks if check.held is not None]
        return bool(promised) and all(promised)

    def save(self, folder: Path) -> None:
        """Keep it for the page."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{self.name}.json").write_text(json.dumps(asdict(self), indent=1) + "\n")


def read_report(path: Path) -> Report:
    """A report that was saved."""
    fields = json.loads(path.read_text())
    return Report(**{**fields, "checks": [Check(**check) for check in fields["checks"]]})


Try = Callable[["Bench", Report], None]


@dataclass(frozen=True)
class Trial:
    """A trial: what is promised, and the function that tries it on a ``guest``."""

    name: str
    promise: str
    guest: str
    run: Try

    def carry_out(self, bench: Bench) -> Report:
        """Run it; whatever goes wrong with it is a check that did not hold."""
        print(f"== {self.name}: {self.promise}", flush=True)
        report = Report(self.name, self.promise, self.guest, bench.commit)
        began_s = monotonic()
        try:
            self.run(bench, report)
        except (GuestFailed, CommandFailed, OSError) as error:
            traceback.print_exc()
            report.check("the trial came to its end", False, str(error)[-400:])
        report.seconds = monotonic() - began_s
        return report


CATALOGUE: dict[str, Trial] = {}


def trial(promise: str, guest: str = "UML") -> Callable[[Try], Try]:
    """Register a function as the trial of its name."""

    def register(function: Try) -> Try:
        CATALOGUE[function.__name__] = Trial(function.__name__, promise, guest, function)
        return function

    return register
