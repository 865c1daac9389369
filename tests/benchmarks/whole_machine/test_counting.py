"""What the bench of the whole machine counts: rows promised before a cut against rows found after it."""

from __future__ import annotations

import json
import zlib

from logger.store.log.row_format import HEADER

from .catalogue import Check, Report
from .page import page
from .rows import compare, is_row, read_looks
from .trials import power

COLUMNS = HEADER.split(",")


def row(number: int, flags: str = "", utc: str = "2026-06-09T13:05:20.400Z", speed: str = "14.0") -> str:
    cells = dict.fromkeys(COLUMNS[:-1], "")
    cells |= {"segment": str(number), "t_utc": utc, "speed_mps": speed, "flags": flags}
    text = ",".join(cells.values())
    return f"{text},{zlib.crc32(text.encode()):08x}"


def look(t_s: float, *lines: str, name: str = "00001-001.csv.part") -> str:
    return json.dumps({"t_s": t_s, "rows_written": 0, "lines": {name: "".join(f"{line}\n" for line in lines)}})


def test_a_row_is_promised_when_it_was_seen_more_than_a_second_before_the_last_look() -> None:
    looks = read_looks("\n".join([look(10, HEADER, row(1)), look(11.5, row(2)), look(12)]))
    assert looks.promised == {("00001-001", row(1))}
    assert set(looks.ages_s) == {("00001-001", row(1)), ("00001-001", row(2))}


def test_a_row_in_a_file_that_a_repair_is_about_to_put_in_place_is_that_of_its_log() -> None:
    looks = read_looks("\n".join([look(10, row(1), name="00001-001.csv.tmp"), look(12)]))
    assert compare(looks, {"00001-001.csv": f"{HEADER}\n{row(1)}\n"}).lost == 0


def test_a_last_look_that_was_cut_short_does_not_count() -> None:
    looks = read_looks(look(10, row(1)) + "\n" + look(13)[:20])
    assert not looks.promised
    assert read_looks("").promised == set()


def test_a_promised_row_that_is_not_there_is_lost_and_a_newer_one_is_the_price() -> None:
    looks = read_looks("\n".join([look(10, row(1), row(2)), look(12, row(3))]))
    outcome = compare(looks, {"00001-001.csv": f"{HEADER}\n{row(1)}\n"})
    assert (outcome.promised, outcome.found, outcome.lost, outcome.newer_lost) == (2, 1, 1, 1)


def test_a_repaired_row_may_have_learned_its_time_and_nothing_else() -> None:
    looks = read_looks("\n".join([look(10, row(1, "time_unset", "")), look(12)]))
    assert compare(looks, {"00001-001.csv": f"{HEADER}\n{row(1)}\n"}).lost == 0
    outcome = compare(looks, {"00001-001.csv": f"{HEADER}\n{row(1, speed='15.0')}\n"})
    assert (outcome.lost, outcome.strange) == (1, 1)


def test_a_line_with_a_wrong_check_value_is_damaged_and_not_found() -> None:
    looks = read_looks("\n".join([look(10, row(1)), look(12)]))
    outcome = compare(looks, {"00001-001.csv": f"{HEADER}\n{row(1).replace('14.0', '14.1')}\n"})
    assert (outcome.lost, outcome.damaged, outcome.strange) == (1, 1, 0)
    assert not is_row(HEADER)


def test_the_page_names_what_did_not_hold_and_what_was_not_run() -> None:
    name = power.power_cuts.__name__
    report = Report(name, "nothing is lost", "UML", "abc", checks=[Check("rows | lost", held=False, figure="3")])
    text = page([report], "1 May 2026")
    assert "1 May 2026" in text
    assert "| rows \\| lost | **did not hold** | 3 |" in text


def test_a_trial_that_only_measured_has_not_held_what_it_promised() -> None:
    report = Report("boot", "it boots", "UML")
    report.measure("seconds", 11)
    assert not report.held
    report.check("rows come", held=True)
    assert report.held
    assert "| seconds | measured | 11 |" in page([Report("power_cuts", "", "UML", checks=report.checks)], "")
