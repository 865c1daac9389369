"""The page: whole, safe whatever the files say, small, and made by the command from what lies in a folder."""

import json
import re
import shutil
import zlib
from base64 import b64decode, b64encode
from hashlib import sha256
from html import unescape
from html.parser import HTMLParser
from itertools import accumulate
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from logger.commands import main
from logger.commands import report as report_command
from logger.errors import BadInput
from logger.report.page import FLAG_MEANINGS, page, track_data
from logger.store.formats.road_lines import read_road_lines
from logger.store.log.log_reader import LoggedFile
from logger.store.log.row_format import COLUMNS, HEADER, format_row
from logger.store.log.sidecar import sealed

from ..support.drives.town import rows_of_town

SIDECAR: dict[str, Any] = {"ridelog_version": "1.2", "sensor": {"driver": "bma220", "verified": True},
                           "vehicle": {"name": "rav4-2009"}, "settings": {"gps": {"baud": 9600}}, "log": {"part": 1}}
HOSTILE = "</script></style><script>alert(1)</script><img src=//evil onerror=alert(1)>\"'&\ud800"


class Tags(HTMLParser):
    """Every tag with its attributes, and whether elements that must be closed are."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag in ("main", "section", "div", "table", "details", "svg", "g", "figure", "pre", "ul", "a", "dl"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in self.open:
            assert self.open.pop() == tag


def text_of(page_text: str) -> str:
    return " ".join(unescape(re.sub(r"(?s)<style>.*?</style>|<script.*?</script>|<[^>]*>", " ", page_text)).split())


VALUES = [
    "", "0", "-1", "1", "7.620", "-7.620000", "1.0000", "0.500000", "90.0000000", "-180.0000000", "1000000000.000",
    "-1000000000.0000", "1000000000.000000", f"{1e300:.4f}", f"{1e300:.3f}", f"{-1e150:.3f}", f"{1e308:.6f}",
    f"{1e15:.6f}", "999999999999999.999999", "999999999999999999", "9999-12-31T23:59:59.999Z", "gap|x", "A", "H",
    "0001-01-01T00:00:00.000Z", "2026-07-04T10:15:00.250Z", "2199-12-31T23:59:59.999Z", "uncomfortable",
]


@pytest.mark.slow
@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(st.dictionaries(st.integers(0, len(COLUMNS) - 1), st.sampled_from(VALUES), max_size=4),
                        min_size=1, max_size=5))
def test_any_value_in_any_column_gives_a_page(drive, tmp_path: Path, changes: list[dict[int, str]]) -> None:
    rows = [format_row(row).split(",")[:-1] for row in drive(len(changes), {})]
    for row, change in zip(rows, changes, strict=True):
        for column, value in change.items():
            row[column] = value
    bodies = [",".join(row) for row in [format_row(drive(1, {})[0]).split(",")[:-1], *rows]]
    path = tmp_path / "00001-001.csv"
    path.write_text("\n".join([HEADER, *(f"{body},{zlib.crc32(body.encode()):08x}" for body in bodies)]) + "\n")
    assert main.main(["report", str(path), "--out", str(tmp_path / "out.html"), "--json"]) == 0


def test_the_page_says_the_figures(drive) -> None:
    rows = drive(300, {40: {"iri_m_per_km": 14.2, "iri_std_m_per_km": 2.1, "iri_class": "D", "flags": ("clipped",)}})
    text = text_of(page([LoggedFile("00001-001.csv", rows, 2, SIDECAR)]))
    for words in ("Road roughness of a drive", "17 May 2025, 14:02 to 14:04 UTC · vehicle rav4-2009 · ridelog 1.2",
                  "3.0 km", "2 min 30 s", "14.2 ± 2.1", "2025-05-17 14:02:20", "46.50364, 6.50000", "Sensor: bma220",
                  "2 damaged lines were left out", "clipped 1 0.3%", '"baud": 9600', "All windows (300)"):
        assert words in text


def test_every_flag_that_rows_carry_is_explained() -> None:
    assert set(FLAG_MEANINGS) == {"gps_lost", "gap", "clipped", "slow", "fast", "stationary", "time_unset", "partial",
                                  "unsettled", "faint", "blind", "frozen", "repeated", "speed_doubtful", "gps_late",
                                  "hidden"}


def test_the_page_needs_nothing_from_elsewhere(drive) -> None:
    text = page([LoggedFile("a.csv", drive(200), 0, SIDECAR)])
    tags = Tags(text)
    assert tags.open == []
    assert not {"link", "iframe", "img", "object", "base"} & {tag for tag, _ in tags.tags}
    assert not [attributes for tag, attributes in tags.tags if tag == "script" and "src" in attributes]
    text = text.replace('<a href="https://www.openstreetmap.org/?mlat=', "")  # followed only when it is clicked
    assert not re.search(r"https?:|url\(|@import|\bfetch\(|XMLHttpRequest|WebSocket|innerHTML|\beval\(", text)


def test_the_policy_lets_only_our_script_run(drive) -> None:
    text = page([LoggedFile("a.csv", drive(5), 0, SIDECAR)])
    (script,) = re.findall(r"(?s)<script>(.*?)</script>", text)
    policy = next(unescape(str(attributes["content"])) for tag, attributes in Tags(text).tags
                  if attributes.get("http-equiv") == "Content-Security-Policy")
    digest = b64encode(sha256(script.encode()).digest()).decode()
    assert policy == f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"


def test_links_lead_to_maps_of_the_reader(drive) -> None:
    tags = Tags(page([LoggedFile("a.csv", drive(200), 0, SIDECAR)]))
    links = {str(attributes["href"])[:30] for tag, attributes in tags.tags if tag == "a" and attributes["href"]}
    assert {link[:4] for link in links} == {"geo:", "http"}
    assert {link for link in links if link[:4] == "http"} == {"https://www.openstreetmap.org/"}


def test_hostile_text_stays_text(drive) -> None:
    hostile = {0: {"comfort": HOSTILE, "iri_class": HOSTILE, "flags": (HOSTILE,), "iri_m_per_km": 99.0}}
    sidecars: list[Any] = [
        {"sensor": {"driver": HOSTILE, "profile": HOSTILE}, "vehicle": {"name": HOSTILE}, "ridelog_version": HOSTILE,
         "iri_m_per_km": HOSTILE, HOSTILE: HOSTILE},
        {"sensor": HOSTILE, "vehicle": HOSTILE, "iri_m_per_km": [HOSTILE]}, None]
    files = [LoggedFile(HOSTILE, drive(5, hostile), 1, sidecar) for sidecar in sidecars]
    tags = Tags(page(files))
    assert "img" not in {tag for tag, _ in tags.tags}
    assert [tag for tag, _ in tags.tags].count("script") == 2  # the data and what draws them
    assert not [name for _, attributes in tags.tags for name in attributes if name.startswith("on")]
    assert tags.open == []


def test_a_sensor_nobody_has_verified_is_said_so(drive) -> None:
    unverified = {**SIDECAR, "sensor": {"driver": "pasco", "profile": "ps2119", "verified": False}}
    text = text_of(page([LoggedFile("a.csv", drive(3), 0, unverified)]))
    assert "Sensor: pasco ps2119 . Nobody has verified on hardware" in text.replace("ps2119.", "ps2119 .")
    assert "Logs without a sidecar (.json): a.csv" in text_of(page([LoggedFile("a.csv", drive(3), 0, None)]))


def unpacked(block: dict[str, Any]) -> dict[str, list[float | None]]:
    """Columns as a reader of the format gets them, without the script or numpy."""
    data, count = zlib.decompress(b64decode(block["packed"])), block["count"]
    columns: dict[str, list[float | None]] = {}
    for number, (name, steps, order) in enumerate(block["columns"]):
        planes = [data[(4 * number + plane) * count:(4 * number + plane + 1) * count] for plane in range(4)]
        whole = [sum(byte << 8 * plane for plane, byte in enumerate(one)) for one in zip(*planes, strict=True)]
        whole = [folded // 2 if folded % 2 == 0 else -(folded + 1) // 2 for folded in whole]
        for _ in range(order):
            whole = list(accumulate(whole))
        signed = [(one + 2**31) % 2**32 - 2**31 for one in whole]
        columns[name] = [None if one == -2**31 else one / steps for one in signed]
    return columns


def test_packed_numbers_come_back_as_they_were(drive) -> None:
    changes = {3: {"lat_deg": None, "lon_deg": None, "iri_m_per_km": None}, 4: {"lon_deg": -179.999},
               5: {"iri_m_per_km": 1e300, "speed_mps": -1e300}, 6: {"a_w_mps2": 0.123, "a_w_std_mps2": 0.4}}
    rows = drive(50, changes)
    columns = unpacked(track_data([rows[:20], rows[20:]])["windows"])
    for name, within in (("lat_deg", 5e-7), ("iri_std_m_per_km", 5e-3), ("a_w_mps2", 5e-4), ("duration_s", 5e-4)):
        for kept, row in zip(columns[name], rows, strict=True):
            assert kept == pytest.approx(getattr(row, name), abs=within)
    assert columns["iri_m_per_km"][3] is None
    assert columns["iri_m_per_km"][5] == pytest.approx(2**31 / 100)
    assert columns["lon_deg"][4] == pytest.approx(-179.999 + 360 * (6.5 - -179.999 > 180), abs=1e-6)
    assert columns["expected_above_mps2"][6] == pytest.approx((0.123**2 + 0.4**2) ** 0.5 - 0.123, abs=1e-3)
    assert [index for index, kind in enumerate(columns["begins"]) if kind == 2] == [0, 20]
    assert columns["begins"][3:6] == [1, 1, 1]  # no place, a place again, and a leap


def test_100_000_windows_make_a_page_of_at_most_1_5_mb() -> None:
    rows = rows_of_town(4, 1500)
    fixed = len(page([LoggedFile("a.csv", rows[:1], 0, SIDECAR)]).encode())
    per_row = (len(page([LoggedFile("a.csv", rows, 0, SIDECAR)]).encode()) - fixed) / len(rows)
    assert fixed + 100_000 * per_row < 1_500_000


@pytest.mark.parametrize("changes", [
    {"lat_deg": None, "lon_deg": None}, {"iri_m_per_km": None, "iri_std_m_per_km": None, "iri_class": ""},
    {"distance_start_m": None, "distance_end_m": None, "lat_deg": None, "lon_deg": None, "speed_mps": None},
    {"utc_us": None}, {"a_w_mps2": None, "comfort": "", "mtvv_mps2": None, "vdv_mps175": None, "crest_factor": None}])
def test_what_is_not_known_leaves_a_whole_page(drive, changes: dict[str, Any]) -> None:
    for rows in (1, 3):
        text = page([LoggedFile("a.csv", drive(rows, dict.fromkeys(range(rows), changes)), 0, {})])
        assert Tags(text).open == []
        assert "None" not in text_of(text)
        assert "nan" not in text_of(text)


def write_log(path: Path, rows: list[Any], sidecar: object = SIDECAR, extra: str = "") -> None:
    path.write_text("\n".join([HEADER, *map(format_row, rows)]) + "\n" + extra, encoding="utf-8")
    (path.parent / f"{path.name.partition('.')[0]}.json").write_text(
        json.dumps(sealed(sidecar) if isinstance(sidecar, dict) else sidecar), encoding="utf-8")


def test_the_command_reads_a_folder_in_order(drive, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_log(tmp_path / "00002-001.csv.part", drive(4), extra="5,2025-05")
    write_log(tmp_path / "00001-002.csv", drive(8)[5:], {**SIDECAR, "vehicle": {"name": "\ud800"}})
    write_log(tmp_path / "00001-001.csv", drive(5))
    write_log(tmp_path / "00001-001.csv.part", drive(3))
    (tmp_path / "notes.csv").write_text("mine", encoding="utf-8")
    out = tmp_path / "page.html"
    assert main.main(["report", str(tmp_path), "--out", str(out), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["files"] == ["00001-001.csv", "00001-002.csv", "00002-001.csv.part"]
    assert reported["summary"]["windows"] == 12
    assert reported["summary"]["drives"] == 2
    text = out.read_text(encoding="utf-8")
    assert "Road roughness of 2 drives" in text
    assert "1 damaged line was left out" in text
    assert sorted(path.name for path in tmp_path.iterdir() if "page" in path.name) == ["page.html"]


def test_the_command_finds_the_logs_on_a_stick(drive, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "page.html"
    cars = [tmp_path / "stick" / "ridelog" / name for name in ("0123456789ab", "123456789abc")]
    for car, windows in zip(cars, (5, 6), strict=True):
        car.mkdir(parents=True)
        write_log(car / "00001-001.csv", drive(windows))
    write_log(cars[1] / "00002-001.csv", drive(4))
    shutil.copytree(cars[1], tmp_path / "stick" / "saved" / cars[1].name)
    (tmp_path / "stick" / "ridelog" / "link").symlink_to(cars[0])
    names = ["0123456789ab/00001-001.csv", "123456789abc/00001-001.csv", "123456789abc/00002-001.csv"]
    for place, expected in ((tmp_path / "stick", [f"ridelog/{name}" for name in names]),
                            (tmp_path / "stick" / "ridelog", names), (cars[0], ["00001-001.csv"])):
        assert main.main(["report", str(place), "--out", str(out), "--json"]) == 0
        reported = json.loads(capsys.readouterr().out)
        assert reported["files"] == expected
        assert reported["summary"]["drives"] == len(expected)


def test_many_places_are_one_report_and_a_copy_counts_once(drive, tmp_path: Path,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    one, stick = tmp_path / "car", tmp_path / "stick" / "ridelog" / "0123456789ab"
    for folder in (one, stick):
        folder.mkdir(parents=True)
        write_log(folder / "00001-001.csv", drive(5))
    write_log(stick / "00002-001.csv", drive(4))
    write_log(tmp_path / "00001-001.csv", drive(7))
    out = tmp_path / "page.html"
    places = [str(one), str(tmp_path / "stick"), str(tmp_path / "00001-001.csv"), str(one / "00001-001.csv")]
    assert main.main(["report", *places, "--out", str(out), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["files"] == ["car/00001-001.csv", "stick/ridelog/0123456789ab/00002-001.csv", "00001-001.csv"]
    assert reported["summary"]["windows"] == 16
    assert reported["summary"]["drives"] == 3


@pytest.mark.parametrize(("text", "words"), [
    ("{", "expected GeoJSON, found text that is not JSON"), ("[]", "expected GeoJSON, an object with a type"),
    ('{"type": "FeatureCollection", "features": []}', "expected roads as LineString or MultiLineString, found none"),
    ('{"type": "LineString", "coordinates": [[6.5]]}', r"expected lines of at least two \[longitude, latitude\]"),
    ('{"type": "LineString", "coordinates": [[6.5, 46], [6.5, "x"]]}', "in degrees, found"),
    ('{"type": "LineString", "coordinates": [[6.5, 46], [6.5, 460]]}', "in degrees, found"),
    ('{"type": "MultiLineString", "coordinates": [5]}', "in degrees, found 5"), ("[" * 100_000, "not JSON")])
def test_roads_that_are_none_are_refused(drive, tmp_path: Path, text: str, words: str) -> None:
    write_log(tmp_path / "00001-001.csv", drive(2))
    (tmp_path / "roads.geojson").write_text(text)
    with pytest.raises(BadInput, match=rf"roads\.geojson: .*{words}"):
        main.main(["report", str(tmp_path), "--base", str(tmp_path / "roads.geojson"), "--out", str(tmp_path / "p")])


def test_roads_of_every_kind_are_read(tmp_path: Path) -> None:
    line = {"type": "LineString", "coordinates": [[6.5, 46.5, 400.0], [6.6, 46.5]]}
    several = {"type": "MultiLineString", "coordinates": [[[1, 2], [3, 4]], [[5, 6], [7, 8]]]}
    path = tmp_path / "roads.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "geometry": line}, {"type": "Feature", "geometry": None},
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 2]}},
        {"type": "Feature", "geometry": {"type": "GeometryCollection", "geometries": [several]}}]}))
    assert [(list(lat), list(lon)) for lat, lon in read_road_lines(path)] == [
        ([46.5, 46.5], [6.5, 6.6]), ([2, 4], [1, 3]), ([6, 8], [5, 7])]


@pytest.mark.parametrize("address", ["logs", "https://host/{z}/{x}.png", "https://h/{z}/{x}/{y}';script-src *",
                                     "http://["])
def test_an_address_of_no_street_pictures_is_refused(drive, tmp_path: Path, address: str) -> None:
    write_log(tmp_path / "00001-001.csv", drive(2))
    with pytest.raises(BadInput, match=r"^--tiles .*: expected an address such as https"):
        main.main(["report", str(tmp_path), "--out", str(tmp_path / "p.html"), "--tiles", address])


def test_a_part_that_is_finished_before_it_is_read_is_read_as_what_it_has_become(
        drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("00001-001.csv", "00001-002.csv.part", "00001-003.csv"):
        write_log(tmp_path / name, drive(5))
    found = report_command.find_logs_in

    def meanwhile(places: list[Path]) -> list[tuple[Path, Path | None]]:
        logs = found(places)
        (tmp_path / "00001-002.csv.part").rename(tmp_path / "00001-002.csv")
        (tmp_path / "00001-001.csv").unlink()
        return logs

    monkeypatch.setattr(report_command, "find_logs_in", meanwhile)
    assert main.main(["report", str(tmp_path), "--out", str(tmp_path / "p.html"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["00001-002.csv", "00001-003.csv"]


def test_a_folder_with_the_name_of_a_log_is_no_log(drive, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "00001-001.csv").mkdir()
    write_log(tmp_path / "00002-001.csv", drive(5))
    assert main.main(["report", str(tmp_path), "--out", str(tmp_path / "p.html"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["00002-001.csv"]


def test_logs_that_lost_their_settings_in_a_repair_are_named(drive, tmp_path: Path) -> None:
    write_log(tmp_path / "00001-001.csv", drive(5))
    (tmp_path / "00001-001.json").write_text(json.dumps(sealed({"settings_lost": True})), encoding="utf-8")
    assert main.main(["report", str(tmp_path), "--out", str(tmp_path / "p.html")]) == 0
    assert "Their settings were lost before a repair:</span> 00001-001.csv" in (tmp_path / "p.html").read_text("utf-8")


def test_the_command_takes_one_file_and_tells_where_the_page_is(drive, tmp_path: Path,
                                                                capsys: pytest.CaptureFixture[str]) -> None:
    write_log(tmp_path / "00001-001.csv", drive(5))
    (tmp_path / "00001-001.json").write_text("{torn", encoding="utf-8")
    assert main.main(["report", str(tmp_path / "00001-001.csv"), "--out", str(tmp_path / "p.html")]) == 0
    assert capsys.readouterr().out == f"Report: {tmp_path}/p.html (5 windows from 1 file)\n"


def test_the_command_refuses_what_is_no_log(drive, tmp_path: Path) -> None:
    out = ["--out", str(tmp_path / "p.html")]
    with pytest.raises(BadInput, match="expected a folder"):
        main.main(["report", str(tmp_path / "gone"), *out])
    with pytest.raises(BadInput, match="expected segment logs"):
        main.main(["report", str(tmp_path), *out])
    write_log(tmp_path / "00001-001.csv", [], extra="nonsense\n")
    with pytest.raises(BadInput, match=r"00001-001\.csv: expected a log with at least one intact row"):
        main.main(["report", str(tmp_path), *out])
    write_log(tmp_path / "00001-001.csv", drive(2))
    with pytest.raises(BadInput, match="expected a place where a page can be written"):
        main.main(["report", str(tmp_path), "--out", str(tmp_path / "no" / "p.html")])
    with pytest.raises(BadInput, match=r"--out .*p\.pdf: expected the name of a web page, such as p\.html"):
        main.main(["report", str(tmp_path), "--out", str(tmp_path / "p.pdf")])
    assert not list(tmp_path.glob("p.*"))
