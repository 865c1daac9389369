"""Words that were made to hurt, in whatever a log brings with it: on pages, in tables, maps and on the terminal they
can be seen, are cut, and do nothing."""

from __future__ import annotations

import csv
import json
import re
import unicodedata
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from logger.exchange.layer import Attribute, Feature, Kind, Layer, write_layer
from logger.printable import LONGEST_WORD
from logger.shipped import vehicle_file
from logger.store.log.row_format import HEADER, format_row
from logger.store.log.sidecar import sealed

from ..support.command import called
from ..support.drives.logged_rows import repeated_drives
from ..support.slow import slow

LONG = "Q" * 1_000_000
WORDS = ("<script>alert(1)</script>", "=cmd|' /C calc'!A0", "+1+1", "-1+1", "@SUM(A1)", "\tx", "\x1b[2J\x1b]0;x\x07",
         "a\nok: all is well", "a\rok", "\u202egpj.exe", "\u2066x\u2069", "a\u200bb\u00adc", "\u3164\u2800", "\u034fx",
         "x;=1+1", "＝1+1", "]]>&lt;", "\x9b2J", "\udcff", LONG)
COMPUTED = re.compile(r"[\s]*[-=+@＝＋－＠]")


@pytest.fixture(scope="module")
def stick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """For each word a car's folder that is called so, as far as a file's name can be, with a log that says it."""
    place = tmp_path_factory.mktemp("words")
    rows = "\n".join([HEADER, *map(format_row, repeated_drives(2, 60, (2.0, 5.0))), ""])
    for number, word in enumerate(WORDS, start=1):
        folder = place / word.replace("/", "_")[:60]
        folder.mkdir(parents=True)
        (folder / f"{number:05d}-001.csv").write_text(rows, "ascii")
        (folder / f"{number:05d}-001.json").write_text(json.dumps(sealed({
            "vehicle": {"name": word[:900_000], word[:50_000]: 1}, "ridelog_version": word[:9000],
            "sensor": {"driver": word[:9000], "verified": False}, "iri_m_per_km": word[:9000]})))
    return place


def check(text: str, what: str) -> None:
    """What a person sees of it."""
    hidden = {one for one in text if unicodedata.category(one) in ("Cc", "Cf", "Cs", "Zl", "Zp")} - set("\n\t")
    assert not hidden | (set("\u3164\u2800\u034f") & set(text)), what
    assert "Q" * (LONGEST_WORD + 1) not in text, what


def check_table(path: Path) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        cells = [cell for row in csv.reader(file) for cell in row]
    check("".join(cells), path.name)
    for cell in cells:
        for part in re.split("[,;\t]", cell):
            assert not COMPUTED.match(part) or re.fullmatch(r"-?[0-9.e-]+", part), cell


def check_written(path: Path) -> None:
    text = path.read_text("utf-8")
    if path.suffix == ".csv":
        check_table(path)
    elif path.suffix in (".kml", ".gpx"):
        check("".join(ET.fromstring(text).itertext()), path.name)
    elif path.suffix == ".geojson":
        check("\n".join(str(value) for one in json.loads(text)["features"] for value in one["properties"].values()),
              path.name)
    else:
        check(text, path.name)
        assert "<script>alert" not in text


@pytest.mark.parametrize(("verb", "option", "name"), [
    ("report", "--out", "page.html"), ("convert", "--to", "a.csv"), ("passes", "--visit", "v.kml"),
    *slow(("convert", "--to", "a.kml"), ("convert", "--to", "a.gpx"), ("convert", "--to", "a.geojson"),
          ("sections", "--out", "s.csv"), ("passes", "--out", "p.html"))])
def test_of_logs(verb: str, option: str, name: str, stick: Path, tmp_path: Path) -> None:
    out = tmp_path / name
    done = called(verb, *sorted(stick.iterdir()), option, out, *(["--length", "100m"] if verb == "sections" else []))
    assert done.returncode == 0, done.stderr
    check(done.stdout + done.stderr, "terminal")
    check_written(out)


@pytest.mark.parametrize("ending", ["csv", "kml", "gpx", "geojson"])
def test_of_a_map_s_roads(ending: str, tmp_path: Path) -> None:
    ways = tuple(Feature(word, word, (word,), (((6.5, 46.5), (6.6, 46.5)),), (6.5, 46.5), None, False, "A")
                 for word in WORDS)
    out = tmp_path / f"out.{ending}"
    write_layer(Layer("ways", (Attribute("name", Kind.WORDS),), ways), out)
    check_written(out)


@pytest.mark.slow
def test_a_page_s_own_name(stick: Path, tmp_path: Path) -> None:
    done = called("report", stick, "--out", tmp_path / "\x1b[2J\u202e.html")
    assert done.returncode == 0
    check(done.stdout + done.stderr, "terminal")


def test_on_the_terminal(stick: Path, tmp_path: Path) -> None:
    for folder in sorted(stick.iterdir()):
        for words in (("verify", folder), ("sections", folder, "--length", "100m"), ("convert", folder, "--to", "x"),
                      ("extract", folder / "x.dump", "--out", tmp_path / "x"), (str(folder),),
                      ("passes", folder, "--since", folder), ("report", folder, "--out", folder)):
            done = called(*words)
            check(done.stdout + done.stderr, str(words))
            assert done.returncode == 0 or len(done.stderr.splitlines()) <= 1


def test_words_of_a_dump(tmp_path: Path) -> None:
    for word in WORDS:
        (tmp_path / "a.dump").write_text("# ridelog-dump 1 " + json.dumps({
            "start_utc": None, "accelerometer": {"driver": "bma220", "noise": word[:9000]}, "gps": {},
            "vehicle": word[:50_000]}) + "\n")
        done = called("replay", tmp_path / "a.dump", "--out", tmp_path / "out")
        check(done.stdout + done.stderr, word[:20])
        assert done.returncode == 2


def test_a_car_s_name_has_to_be_one(tmp_path: Path) -> None:
    before, rest = re.split(r"(?m)^name:.*", vehicle_file("rav4-2009").read_text("utf-8"))
    for word in ("\u202ex", "x" * 81, "a\u200bb"):
        (tmp_path / "car.yaml").write_text(f"{before}name: {json.dumps(word)}{rest}", "utf-8")
        done = called("calibrate", "--vehicle", tmp_path / "car.yaml")
        check(done.stderr, word)
        assert done.returncode == 2
        assert "expected a name of at most 80 printable characters" in done.stderr


def test_a_row_s_words_are_a_logger_s(tmp_path: Path) -> None:
    from dataclasses import replace

    rows = repeated_drives(1, 40, (2.0,))
    rows[3] = replace(rows[3], flags=("=cmd()",))
    rows[5] = replace(rows[5], comfort="<b>")
    rows[7] = replace(rows[7], iri_class="Z")
    (tmp_path / "00001-001.csv").write_text("\n".join([HEADER, *map(format_row, rows), ""]), "ascii")
    done = called("convert", tmp_path, "--to", tmp_path / "a.csv", "--json")
    assert json.loads(done.stdout)["damaged_lines"] == 3
