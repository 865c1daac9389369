"""The README's pictures: ``python -m tests.support.pictures`` runs both demonstrations and draws docs/*.png anew.

Each is small: a map (Chromium's picture of the page), the roughness along it, and a residual before and after the
missing effect is added.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from logger.api.lab.compare import Comparison, compare, worst_moment
from logger.chart_data import Curves, Line
from logger.report.charts import drawn

from .browser import CHROMIUM, NO_BROWSER
from .command import called

DOCS = Path(__file__).resolve().parents[2] / "docs"
MAP_PX = (1060, 840)


def the_map(page: Path, picture: Path) -> None:
    """The top of a page, as a reader sees it."""
    if CHROMIUM is None:
        sys.exit(NO_BROWSER)
    width, height = MAP_PX
    subprocess.run([CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                    f"--window-size={width},{height}", "--virtual-time-budget=5000", f"--screenshot={picture}",
                    page.as_uri()], check=True, capture_output=True)


def before_and_after(before: Comparison, after: Comparison, effect: str) -> Curves:
    """Residuals around the place that was worst without the effect."""
    standing = before.found.refitted
    worst, residuals = worst_moment(standing), standing.residuals
    count = len(residuals.residual[worst.run])
    time_s = ((residuals.runs[worst.run].first + np.arange(count)) / residuals.rate_hz)[worst.part]
    lines = [("measured", residuals.measured), ("residual without the effect", residuals.residual),
             (f"residual with {effect}", after.found.refitted.residuals.residual)]
    title = f"{worst.words}: NRMSE {before.refitted_error:.3f} without {effect}, {after.refitted_error:.3f} with it"
    return Curves(title, "time [s]", "acceleration [m/s2]",
                  tuple(Line(name, time_s, values[worst.run][worst.part]) for name, values in lines))


def main() -> None:
    """Make all of them."""
    with tempfile.TemporaryDirectory() as folder:
        box, lab = Path(folder) / "box", Path(folder) / "lab"
        called("demo", "--out", str(box))
        the_map(box / "report.html", DOCS / "map.png")
        called("passes", str(box), "--out", str(DOCS / "roughness.png"))
        called("demo", "--lab", "--out", str(lab))
        runs = [lab / "slow", lab / "brisk"]
        found = [compare(vehicle, runs) for vehicle in ("rav4-2009", lab / "vehicle-1.yaml")]
        picture = DOCS / "effect.png"
        picture.write_bytes(drawn([before_and_after(*found, "progressive_spring")], picture))


if __name__ == "__main__":
    main()
