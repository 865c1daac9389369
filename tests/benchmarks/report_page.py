"""The report's page of 100,000 windows in a browser without a graphics card: size, first picture, frames.

A town's streets, driven on 40 days: 762 km in windows of 7.62 m, many of them over one another, all in view at once.
Without Chromium only the size is measured, and that is said.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

from logger.report.page import page
from logger.store.log.log_reader import LoggedFile

from ..support.browser import CHROMIUM, NO_BROWSER, browser, opened
from ..support.drives.town import rows_of_town
from .figures import Figures

DRIVES, WINDOWS = 40, 2500
_MOVE = """async ([wheel, view]) => {
  const canvas = document.querySelector(view), box = canvas.getBoundingClientRect(), frames = [];
  const at = {pointerId: 1, pointerType: "mouse", bubbles: true, clientX: box.x + box.width / 2, clientY: box.y + 150};
  canvas.setPointerCapture = () => {};
  if (!wheel) canvas.dispatchEvent(new PointerEvent("pointerdown", at));
  const frame = () => new Promise(requestAnimationFrame);
  let last = await frame();
  for (let i = 0; i < 60; i++) {
    at.clientX += i % 20 < 10 ? 9 : -9;
    if (wheel) canvas.dispatchEvent(new WheelEvent("wheel", {...at, deltaY: i % 60 < 30 ? -40 : 40, cancelable: true}));
    else canvas.dispatchEvent(new PointerEvent("pointermove", at));
    const now = await frame();
    frames.push(now - last);
    last = now;
  }
  canvas.dispatchEvent(new PointerEvent("pointerup", at));
  return frames;
}"""


def main() -> int:
    """Print each figure beside its goal."""
    figures = Figures()
    began = time.perf_counter()
    rows = rows_of_town(DRIVES, WINDOWS)
    print(f"{len(rows)} windows, {rows[-1].drive} drives, made in {time.perf_counter() - began:.1f} s")
    began = time.perf_counter()
    text = page([LoggedFile("town.csv", rows, 0, {})])
    figures.at_most("the page is made in", time.perf_counter() - began, 30, "s")
    figures.at_most("size of the page", len(text.encode()) / 1e6, 1.5, "MB")
    if CHROMIUM is None:
        print(f"first picture, frames: {NO_BROWSER}")
        return 1
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        file = Path(folder) / "page.html"
        file.write_text(text, encoding="utf-8")
        _look(figures, chromium, file)
    return 1 if figures.missed else 0


def _look(figures: Figures, chromium: Any, file: Path) -> None:
    complaints: list[str] = []
    with opened(chromium, file, complaints, viewport={"width": 1200, "height": 900}) as tab:
        figures.at_most("first picture after", tab.evaluate("performance.getEntriesByName('shown')[0].startTime") / 1e3,
                        2.0, "s")
        for name, move in (("panning the whole town", [False, "#map canvas"]), ("zooming", [True, "#map canvas"]),
                           ("hovering over the curves", [False, "#curves canvas"])):
            figures.at_most(f"median frame, {name}", median(tab.evaluate(_MOVE, move)), 50, "ms")
        tab.click("[data-zoom=all]")
        for _ in range(8):
            tab.click("[data-zoom=in]")
        figures.at_most("median frame, panning close by", median(tab.evaluate(_MOVE, [False, "#map canvas"])), 50, "ms")
    figures.at_most("complaints of the browser", len(complaints), 0, "")
    for complaint in complaints:
        print(f"  {complaint}")


if __name__ == "__main__":
    sys.exit(main())
