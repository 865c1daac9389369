"""Chromium without a screen, for what only a browser can tell of a page."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CHROMIUM = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))),
                None)
NO_BROWSER = "needs Chromium, and there is none here (apt-get install chromium)"


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium that draws with the processor alone."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        # Run by root, as in a container, it has no sandbox of its own.
        chromium = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield chromium
        chromium.close()


@contextmanager
def opened(chromium: Any, page: Path, complaints: list[str], **context: Any) -> Iterator[Any]:
    """A page, drawn; ``complaints`` collects what it says on the console, what goes wrong, and what it asks for."""
    held = chromium.new_context(**context)
    tab = held.new_page()
    tab.on("console", lambda message: complaints.append(f"console: {message.text}"))
    tab.on("pageerror", lambda error: complaints.append(f"error: {error}"))
    tab.on("request", lambda request: complaints.append(f"request: {request.url}")
           if request.url != page.as_uri() else None)
    tab.goto(page.as_uri())
    tab.wait_for_selector("html[data-shown]")
    yield tab
    held.close()
