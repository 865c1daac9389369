"""The page in a browser: silent, asks for nothing, right under the pointer, whole on a phone, in the dark, printed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logger.geodesy import ground_distance_m
from logger.records import WindowRecord
from logger.report.page import MapLine, page
from logger.report.summary import summarise
from logger.store.log.log_reader import LoggedFile

from ..support.browser import CHROMIUM, NO_BROWSER, browser, opened
from ..support.drives.logged_rows import repeated_drives, rows_of_drive
from ..support.drives.town import rows_of_town

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason=NO_BROWSER)]

DESK = {"viewport": {"width": 1100, "height": 1000}}
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
HOSTILE = "</script><script>document.title='mine'</script><img src=x onerror=\"document.title='mine'\">"


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as found:
        yield found


Open = Callable[..., Any]


@pytest.fixture
def open_page(chromium: Any, tmp_path: Path) -> Iterator[Open]:
    """Opens the page of some rows; at the end it must have said nothing and asked for nothing."""
    complaints: list[str] = []
    with ExitStack() as held:
        def open_it(rows: list[WindowRecord], context: dict[str, Any] = DESK, sidecar: Any = None,
                    **options: Any) -> Any:
            file = tmp_path / "page.html"
            file.write_text(page([LoggedFile("a.csv", rows, 0, sidecar or {})], **options), encoding="utf-8")
            return held.enter_context(opened(chromium, file, complaints, **context))

        yield open_it
    assert complaints == []


def middle_of(tab: Any, view: str, x_share: float = 0.5, y_share: float = 0.5) -> tuple[float, float]:
    tab.locator(view).scroll_into_view_if_needed()
    box = tab.locator(f"{view} canvas").first.bounding_box()
    return box["x"] + x_share * box["width"], box["y"] + y_share * box["height"]


def coloured(tab: Any, view: str, rgb: tuple[int, int, int]) -> int:
    """How many pixels of a view have about this colour."""
    return tab.evaluate("""([view, rgb]) => {
      const canvas = document.querySelector(view + " canvas"), copy = new OffscreenCanvas(canvas.width, canvas.height);
      const ink = copy.getContext("2d", {willReadFrequently: true});
      ink.drawImage(canvas, 0, 0);
      const {data} = ink.getImageData(0, 0, canvas.width, canvas.height);
      let found = 0;
      for (let i = 0; i < data.length; i += 4)
        found += data[i + 3] > 200 && rgb.every((value, channel) => Math.abs(data[i + channel] - value) < 5);
      return found;
    }""", [view, list(rgb)])


def test_a_pointer_on_the_map_reads_the_window_that_lies_there(open_page: Open) -> None:
    tab = open_page(rows_of_drive(300, {150: {"iri_m_per_km": 9.87, "iri_class": "C", "flags": ("clipped",)}}))
    tab.mouse.move(*middle_of(tab, "#map"))  # the whole drive is in view: its middle is in the middle
    said = tab.inner_text("#reading")
    along_m = float(re.search(r"([\d.]+) km along", said)[1]) * 1000  # type: ignore[index]
    assert along_m == pytest.approx(1500, abs=15)
    assert "Drive 1 · 2025-05-17 14:03" in said
    assert "46.51" in said
    for _ in range(12):
        tab.click("[data-zoom=in]")
    x, y = middle_of(tab, "#map")
    said = {(tab.mouse.move(x, y + off), tab.inner_text("#reading"))[1] for off in range(-40, 41, 8)}
    assert any("9.87" in words and "clipped: the accelerometer clipped" in words for words in said)


def test_a_pointer_on_the_curves_moves_the_map_there(open_page: Open) -> None:
    tab = open_page(rows_of_drive(300))
    for _ in range(8):
        tab.click("[data-zoom=in]")
    before = tab.evaluate("document.querySelector('#map canvas').toDataURL()")
    tab.mouse.move(*middle_of(tab, "#curves", 0.9))
    tab.wait_for_timeout(100)
    assert "2.8" in tab.inner_text("#reading") or "2.9" in tab.inner_text("#reading")
    assert tab.evaluate("document.querySelector('#map canvas').toDataURL()") != before


def test_a_dragged_range_has_the_figures_of_its_rows(open_page: Open) -> None:
    rows = rows_of_town(2, 400)
    tab = open_page(rows)
    x, y = middle_of(tab, "#curves", 0.2)
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 300, y, steps=4)
    tab.mouse.up()
    said = tab.inner_text("#range")
    count = int(re.search(r"(\d+) windows", said)[1])  # type: ignore[index]
    first_m = re.search(r"Range · ([\d.]+) (k?m) to", said)
    assert first_m
    start_m = float(first_m[1]) * (1000 if first_m[2] == "km" else 1)
    first = round(start_m / 7.62)
    expected = summarise(rows[first:first + count])
    assert abs(count - 300 / (1060 - 48 - 102) * len(rows)) < 6
    assert f"{expected.mean_iri_m_per_km:.2f} m/km" in said
    assert f"{expected.a_w_mps2:.3f} m/s²" in said
    tab.click("#range-clear")
    assert tab.is_hidden("#range")


def test_all_of_a_drive_as_a_range_is_the_summary_of_the_drive(open_page: Open) -> None:
    hidden = {"a_w_mps2": None, "comfort": "", "a_w_raw_mps2": 0.4, "flags": ("hidden",)}
    rows = rows_of_drive(60, {3: {"flags": ("unsettled",), "iri_m_per_km": 50.0}, 9: hidden, 20: {"iri_m_per_km": 4.0}})
    tab = open_page(rows)
    tab.focus("#curves canvas")
    tab.keyboard.press("Home")
    tab.keyboard.press("Shift+End")
    said, expected = tab.inner_text("#range"), summarise(rows)
    assert "60 windows, 2 of them" in said
    assert f"{expected.mean_iri_m_per_km:.2f} m/km" in said
    assert f"{expected.a_w_mps2:.3f} m/s²" in said
    assert f"{expected.mean_speed_mps * 3.6:.0f} km/h" in said  # type: ignore[operator]
    assert "Worst IRI\n4.0" in said


def test_keys_walk_from_window_to_window(open_page: Open) -> None:
    tab = open_page(rows_of_drive(40))
    tab.focus("#curves canvas")
    for key in ("Home", "ArrowRight", "ArrowRight", "ArrowLeft"):
        tab.keyboard.press(key)
    assert "15 m along" in tab.inner_text("#reading")
    tab.keyboard.press("Escape")
    assert "Point at a window" in tab.inner_text("#reading")
    tab.focus("#map canvas")
    scale = tab.get_attribute("#map", "data-scale")
    tab.keyboard.press("+")
    tab.wait_for_timeout(300)
    assert tab.get_attribute("#map", "data-scale") != scale


def test_the_scale_bar_is_as_long_as_it_says(open_page: Open) -> None:
    rows = rows_of_drive(2, {index: {
        "lat_deg": 60.0, "lon_deg": 10.0 + index * 0.02, "distance_start_m": index * 1000.0,
        "distance_end_m": index * 1000.0 + 1000.0} for index in range(2)})
    tab = open_page(rows)
    metres, pixels = map(float, re.findall(r"[\d.]+", tab.get_attribute("#map", "data-scale")))
    # The way fills the width but for 84 px.
    true_m = ground_distance_m(60.0, 10.0, 60.0, 10.02)
    width = tab.evaluate("document.querySelector('#map canvas').clientWidth") - 84
    assert metres / pixels == pytest.approx(true_m / width, rel=0.005)


@pytest.mark.parametrize(("lat_deg", "lon_deg"), [(-33.9, 18.4), (65.0, 179.9995), (0.0, -179.9995)])
def test_a_drive_anywhere_is_drawn_whole_and_says_where_it_is(open_page: Open, lat_deg: float, lon_deg: float) -> None:
    def lon(index: int) -> float:
        return (lon_deg + index * 10.0 / 111_195 / cos(radians(lat_deg)) + 180.0) % 360.0 - 180.0

    rows = rows_of_drive(60, {i: {"lat_deg": lat_deg, "lon_deg": lon(i)} for i in range(60)})
    tab = open_page(rows)
    metres, _ = map(float, re.findall(r"[\d.]+", tab.get_attribute("#map", "data-scale")))
    assert metres <= 100
    tab.focus("#curves canvas")
    tab.keyboard.press("End")
    assert f"{lat_deg:.6f}, {lon(59):.6f}" in tab.inner_text("#reading")


def test_colours_are_of_the_mean_when_far_and_of_each_window_when_near(open_page: Open) -> None:
    blue, yellow = (47, 109, 181), (242, 199, 68)
    rows = rows_of_drive(4000, {i: {"iri_class": "C", "iri_m_per_km": 7.0} for i in range(1, 4000, 2)})
    for row in rows:
        assert (row.iri_class == "C") == (row.iri_m_per_km == 7.0)
    tab = open_page(rows)
    assert coloured(tab, "#map", yellow) == coloured(tab, "#map", blue) == 0  # 4.5 m/km everywhere: class B
    for _ in range(14):
        tab.click("[data-zoom=in]")
    tab.wait_for_timeout(600)
    assert min(coloured(tab, "#map", yellow), coloured(tab, "#map", blue)) > 300


def test_a_place_of_the_list_is_shown_in_the_views(open_page: Open) -> None:
    tab = open_page(rows_of_town(10, 300))
    tab.click("[data-window] >> nth=2")
    value, error = map(float, tab.inner_text("tr:has([data-window]) >> nth=2").split("\t")[5].split(" ± "))
    said = re.search(r"IRI\n([\d.]+) ± ([\d.]+)", tab.inner_text("#reading"))
    assert said
    assert (float(said[1]), float(said[2])) == pytest.approx((value, error), abs=0.051)


@pytest.mark.parametrize("context", [DESK, PHONE])
def test_nothing_is_cut_or_wider_than_the_screen(open_page: Open, context: dict[str, Any]) -> None:
    tab = open_page(rows_of_town(3, 200), context, {"vehicle": {"name": "a-long-name-of-a-vehicle" * 3}})
    assert tab.evaluate("document.documentElement.scrollWidth") <= context["viewport"]["width"]
    cut = tab.evaluate("""[...document.querySelectorAll("main *")].filter(one => !one.closest(".scroll, pre")
      && one.getBoundingClientRect().right > innerWidth + 0.5).map(one => one.outerHTML.slice(0, 80))""")
    assert cut == []


def test_a_finger_reads_a_window_and_two_zoom(open_page: Open) -> None:
    tab = open_page(rows_of_drive(300), PHONE)
    tab.touchscreen.tap(*middle_of(tab, "#map"))
    assert "along" in tab.inner_text("#reading")
    tab.touchscreen.tap(*middle_of(tab, "#curves", 0.3))
    assert re.search(r"along", tab.inner_text("#reading"))
    x, y = middle_of(tab, "#map")
    before = tab.get_attribute("#map", "data-scale")
    session = tab.context.new_cdp_session(tab)

    def touch(kind: str, *apart: float) -> None:
        points = [{"x": x + sign * off, "y": y, "id": number} for off in apart for number, sign in enumerate((-1, 1))]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 20)
    for off in (40, 60, 80):
        touch("touchMove", off)
    touch("touchEnd")
    tab.wait_for_timeout(300)
    after = tab.get_attribute("#map", "data-scale")
    (m0, px0), (m1, px1) = (map(float, re.findall(r"[\d.]+", scale)) for scale in (before, after))
    assert (m0 / px0) / (m1 / px1) == pytest.approx(4.0, rel=0.1)


def test_a_finger_drags_a_range(open_page: Open) -> None:
    tab = open_page(rows_of_drive(300), PHONE)
    x, y = middle_of(tab, "#curves", 0.3)
    session = tab.context.new_cdp_session(tab)
    for kind, at in (("touchStart", x), ("touchMove", x + 20), ("touchMove", x + 90), ("touchEnd", None)):
        points = [] if at is None else [{"x": at, "y": y}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    assert tab.is_visible("#range")
    said = re.search(r"(\d+) windows", tab.inner_text("#range"))
    assert said
    assert int(said[1]) == pytest.approx(90 / (390 - 28 - 54) * 300, abs=6)


def test_the_dark_page_is_dark_and_its_paper_is_not(open_page: Open) -> None:
    tab = open_page(rows_of_drive(100), DESK | {"color_scheme": "dark"})
    ground = "getComputedStyle(document.body).backgroundColor"
    assert tab.evaluate(ground) == "rgb(20, 25, 30)"
    white = coloured(tab, "#curves", (231, 235, 238))
    assert white > 500
    tab.emulate_media(media="print", color_scheme="light")
    tab.wait_for_timeout(200)
    assert tab.evaluate(ground) == "rgb(255, 255, 255)"
    assert coloured(tab, "#curves", (231, 235, 238)) < white / 5
    assert coloured(tab, "#curves", (29, 36, 43)) > 500
    assert tab.evaluate("getComputedStyle(document.querySelector('.legend i')).printColorAdjust") == "exact"
    assert tab.pdf()[:5] == b"%PDF-"


def test_the_table_shows_some_rows_at_a_time(open_page: Open) -> None:
    tab = open_page(rows_of_drive(60, {59: {"flags": ("gap",)}}))
    tab.click("details.rows summary")
    assert tab.locator("#rows tr").count() == 25
    tab.click("[data-turn=last]")
    assert tab.locator("#rows tr").count() == 10
    assert "gap" in tab.inner_text("#rows tr:last-child")
    assert tab.inner_text("#rows-of") == "Page 3 of 3"
    tab.click("#rows tr:last-child")
    assert "595 m along" in tab.inner_text("#reading")


def test_what_files_say_does_not_run(open_page: Open) -> None:
    rows = rows_of_drive(9, {i: {"flags": (HOSTILE,), "iri_class": HOSTILE, "comfort": HOSTILE} for i in range(9)})
    tab = open_page(rows, DESK, {"vehicle": {"name": HOSTILE}, "sensor": HOSTILE})
    tab.focus("#curves canvas")
    tab.keyboard.press("End")
    assert HOSTILE in tab.inner_text("#reading")
    assert tab.title() != "mine"
    assert tab.locator("img").count() == 0


@pytest.mark.parametrize("changes", [
    {}, {"lat_deg": None, "lon_deg": None}, {"iri_m_per_km": None, "iri_std_m_per_km": None, "iri_class": ""},
    {"distance_start_m": None, "distance_end_m": None, "lat_deg": None, "lon_deg": None, "speed_mps": None},
    {"utc_us": None}, {"a_w_mps2": None, "comfort": ""}, {"flags": ("unsettled", "gap")}])
def test_one_window_and_windows_that_know_little_are_drawn(open_page: Open, changes: dict[str, Any]) -> None:
    for rows in (1, 3):
        tab = open_page(rows_of_drive(rows, dict.fromkeys(range(rows), changes)))
        if tab.locator("#curves").count():
            tab.mouse.move(*middle_of(tab, "#curves"))
            said = tab.inner_text("#reading")
            assert "along" in said
            assert not re.search("NaN|undefined|null", said)
        for mode in tab.locator("button[data-mode]").all():
            mode.click()
        assert "NaN" not in tab.inner_text("main")


def test_roads_are_drawn_beneath_and_those_far_away_are_not_in_the_page(open_page: Open) -> None:
    near = MapLine("", np.array([46.5, 46.52]), np.array([6.499, 6.499]))
    far = MapLine("", np.array([40.0, 40.1]), np.array([6.5, 6.5]))
    tab = open_page(rows_of_drive(200), base=[near, far], base_name="roads.geojson")
    assert json.loads(tab.text_content("#data"))["base"]["count"] == 2
    assert coloured(tab, "#map", (217, 222, 227)) > 200
    assert "Roads beneath: roads.geojson" in tab.inner_text("main")


def test_streets_are_asked_for_only_where_they_were_wished(chromium: Any, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    tiles = "https://tiles.invalid/{z}/{x}/{y}.png"
    file.write_text(page([LoggedFile("a.csv", rows_of_drive(50), 0, {})], tiles_from=tiles), encoding="utf-8")
    asked: list[str] = []
    with opened(chromium, file, asked, **DESK) as tab:
        tab.wait_for_timeout(200)
    requests = [line for line in asked if line.startswith("request")]
    assert requests
    assert all(re.fullmatch(r"request: https://tiles\.invalid/\d+/\d+/\d+\.png", line) for line in requests)


def test_places_that_lie_close_together_share_a_mark(open_page: Open) -> None:
    rough = {number: {"iri_m_per_km": 30.0 - number / 100} for number in (20, 30, 40, 50, 900)}
    tab = open_page(rows_of_drive(1000, rough))
    marks = tab.locator("#map").get_attribute("data-marks").split(", ")
    numbers = [one.split(" +")[0].split() for one in marks]
    more = sum(int(one.split(" +")[1]) for one in marks if " +" in one)
    assert len(marks) < 5
    assert sum(map(len, numbers)) + more == tab.locator("#places [data-window]").count()
    assert numbers[-1][0] == "1"


def test_repeated_drives_are_one_street_and_each_can_be_looked_at(open_page: Open) -> None:
    rows = repeated_drives(3, 60, iri=(2.0, 3.0, 4.0))
    tab = open_page(rows)
    tab.focus("#curves canvas")
    tab.keyboard.press("Home")
    for _ in range(30):
        tab.keyboard.press("ArrowRight")
    said = tab.inner_text("#reading")
    assert "Mean of 3 drives here" in said
    mean, error = map(float, re.search(r"drives here\n([\d.]+) ± ([\d.]+)", said).groups())  # type: ignore[union-attr]
    assert mean == pytest.approx(3.0, abs=0.3)  # weighted by errors, which grow with the level
    assert error > 0.2  # drives differ by as much
    assert tab.eval_on_selector_all("#only option", "all => all.map(one => one.textContent.slice(0, 7))") == [
        "all dri", "Drive 1", "Drive 2", "Drive 3"]
    all_of_them = tab.evaluate("document.querySelector('#map canvas').toDataURL()")
    tab.select_option("#only", "2")
    tab.wait_for_timeout(200)
    assert tab.evaluate("document.querySelector('#map canvas').toDataURL()") != all_of_them
    tab.mouse.move(*middle_of(tab, "#map", 0.5))
    tab.wait_for_timeout(100)
    assert "Drive 3" in tab.inner_text("#reading")
