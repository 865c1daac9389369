"""The screen after a drive: it says the figures, in any encoding."""

from logger.printable import span_words
from logger.report.summary import date_words, distance_words, screen, summarise

ROUGH = {3: {"iri_m_per_km": 14.2, "iri_std_m_per_km": 2.1, "iri_class": "D", "comfort": "very_uncomfortable"}}


def test_the_screen_says_what_a_person_asks_first(drive) -> None:
    text = screen(summarise(drive(300, ROUGH)), "utf-8")
    assert "3.0 km in 2 min 30 s · 17 May 2025, 14:02 to 14:04 UTC" in text
    assert "mean IRI 2.0 m/km · comfort a_w 0.30 m/s² · mean speed 72 km/h" in text
    assert "14.2 ± 2.1 m/km  at    46.50031, 6.50000  (35 m along, 72 km/h) very uncomfortable" in text
    assert max(map(len, text.splitlines())) <= 120
    assert len(text.splitlines()) <= 24


def test_bars_are_as_long_as_their_share(drive) -> None:
    half = {index: {"iri_class": "C"} for index in range(30, 60)}
    lines = screen(summarise(drive(60, half)), "utf-8").splitlines()
    bars = {line.split()[0]: line.count("█") for line in lines if line.startswith(("  A ", "  B ", "  C "))}
    assert bars == {"A": 15, "B": 0, "C": 15}
    plain = screen(summarise(drive(60, half)), "ascii").splitlines()
    assert [line.count("#") for line in plain if line.startswith(("  A ", "  B ", "  C "))] == [15, 0, 15]


def test_a_share_above_nothing_always_shows(drive) -> None:
    for encoding in ("utf-8", "ascii"):
        line = next(line for line in screen(summarise(drive(1000, ROUGH)), encoding).splitlines() if "  D" in line)
        assert any(sign in line for sign in "▏#")
        assert " <1% " in line


def test_nothing_is_said_so(drive) -> None:
    text = screen(summarise([]), "utf-8")
    assert "no distance was measured" in text
    assert "date not known" in text
    assert "none with a value" in text
    blind = {0: {"distance_start_m": None, "distance_end_m": None, "iri_m_per_km": None, "lat_deg": None}}
    assert "0 m in 0 s" in screen(summarise(drive(1, blind)), "ascii")


def test_words_of_spans_and_distances() -> None:
    assert [span_words(value) for value in (0.4, 59.6, 61, 3600, 5025)] == [
        "0 s", "1 min 00 s", "1 min 01 s", "1 h 00 min", "1 h 23 min"]
    assert [distance_words(value) for value in (0, 999.4, 1000, 12449)] == ["0 m", "999 m", "1.0 km", "12.4 km"]


def test_a_drive_over_midnight_names_both_days(drive) -> None:
    rows = drive(2, {1: {"utc_us": 1_747_490_520_000_000 + 86_400_000_000}})
    assert date_words(summarise(rows)) == "17 May 2025, 14:02 to 18 May 2025, 14:02 UTC"
