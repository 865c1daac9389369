"""NMEA: single sentences against pynmeagps, epochs against what was put into them, damage against silence."""

import datetime
import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pynmeagps import NMEAReader

from drivers.nmea import NmeaDecoder
from drivers.nmea_sentences import (
    KMH_MPS,
    KNOT_MPS,
    Checksum,
    Gga,
    Gsa,
    MalformedError,
    Rmc,
    Vtg,
    Zda,
    check,
    parse_checked,
)

TALKERS = ["GP", "GL", "GA", "GB", "BD", "GQ", "QZ", "GI", "GN"]
DAY_US = 86_400_000_000


def parse_sentence(data):
    """What a sentence says, from its ``$`` to its checksum; None where that is wrong or a field is malformed."""
    try:
        return parse_checked(data) if check(data) is Checksum.GOOD else None
    except MalformedError:
        return None


def sentence(text, lower=False):
    """Put ``$`` and checksum around, by the plainest of loops."""
    total = 0
    for character in text.encode():
        total ^= character
    return f"${text}*{total:02{'x' if lower else 'X'}}".encode()


def lines(*texts):
    return b"".join(sentence(text) + b"\r\n" for text in texts)


def utc_us(*when):
    return int(datetime.datetime(*when, tzinfo=datetime.UTC).timestamp()) * 1_000_000


def rmc(clock="120000.00", date="150626", status="A", mode=",A", speed="10.0", talker="GN"):
    return f"{talker}RMC,{clock},{status},4807.038,N,01131.000,E,{speed},84.4,{date},,{mode}"


def gga(clock="120000.00", quality="1"):
    return f"GPGGA,{clock},4807.038,N,01131.000,E,{quality},08,0.9,545.4,M,46.9,M,,"


def decode(data, t_us=5, **settings):
    decoder = NmeaDecoder(**settings)
    return decoder.feed(t_us, data) + decoder.flush(), decoder.counts


# --- sentence by sentence against the independent parser


def angle(rng, degree_digits, decimals):
    degrees = rng.randrange(90 if degree_digits == 2 else 180)
    minutes = rng.uniform(0, 59.9)
    width = 2 if decimals == 0 else 3 + decimals
    return f"{degrees:0{degree_digits}d}{minutes:0{width}.{decimals}f}"


def position(rng):
    decimals = rng.choice([3, 4, 5, 6, 7, 8])
    return f"{angle(rng, 2, decimals)},{rng.choice('NS')},{angle(rng, 3, decimals)},{rng.choice('EW')}"


def clock(rng):
    text = f"{rng.randrange(24):02d}{rng.randrange(60):02d}{rng.randrange(60):02d}"
    decimals = rng.choice([0, 1, 2, 3])
    return text + (f".{rng.randrange(10**decimals):0{decimals}d}" if decimals else "")


def day(rng):
    return datetime.date(2020, 1, 1) + datetime.timedelta(days=rng.randrange(15_000))


def random_sentence(rng):
    talker, kind = rng.choice(TALKERS), rng.choice(["RMC", "GGA", "VTG", "GSA", "ZDA"])
    course, knots = rng.choice(["", f"{rng.uniform(0, 359.9):.2f}"]), f"{rng.uniform(0, 200):.{rng.choice([1, 2, 3])}f}"
    mode = rng.choice(["", ",A", ",D", ",F", ",P", ",R", ",E", ",S", ",N", ",V"])
    match kind:
        case "RMC":
            status = ",V" if mode and rng.random() < 0.3 else ""
            letter = rng.choice("AAAV")
            fields = f"{clock(rng)},{letter},{position(rng)},{knots},{course},{day(rng):%d%m%y},,{mode}{status}"
        case "GGA":
            fields = (
                f"{clock(rng)},{position(rng)},{rng.randrange(9)},{rng.randrange(40):02d},{rng.uniform(0.5, 20):.2f},"
                f"{rng.uniform(-400, 5000):.1f},M,{rng.uniform(-100, 100):.1f},M,,"
            )
        case "VTG":
            fields = f"{course},T,,M,{knots},N,{float(knots) * 1.852:.3f},K{mode}"
        case "GSA":
            used = ",".join(rng.choice(["", f"{rng.randrange(1, 99):02d}"]) for _ in range(12))
            dops = ",".join(f"{rng.uniform(0.5, 90):.2f}" for _ in range(3))
            fields = f"{rng.choice('MA')},{rng.choice('123')},{used},{dops}{rng.choice(['', ',1', ',4'])}"
        case _:
            fields = f"{clock(rng)},{day(rng):%d,%m,%Y},00,00"
    return sentence(f"{talker}{kind},{fields}", lower=rng.random() < 0.3)


def us_of(moment):
    return ((moment.hour * 60 + moment.minute) * 60 + moment.second) * 1_000_000 + moment.microsecond


def days_of(date):
    return (date - datetime.date(1970, 1, 1)).days


def number(value):
    return None if value == "" else value


def close(value):
    return pytest.approx(value, abs=1e-9, rel=1e-9)


def test_two_thousand_sentences_say_what_pynmeagps_reads():
    rng = random.Random(20260615)
    seen = set()
    for _ in range(2000):
        data = random_sentence(rng)
        ours, theirs = parse_sentence(data), NMEAReader.parse(data.upper() + b"\r\n")
        assert ours is not None, data
        seen.add((theirs.talker, theirs.msgID))
        match ours:
            case Rmc():
                fix_mode = getattr(theirs, "posMode", "") in ("", "A", "D", "F", "P", "R")
                assert ours.vouches == (theirs.status == "A" and fix_mode)
                assert ours.time_of_day_us == us_of(theirs.time)
                assert (ours.lat_deg, ours.lon_deg) == (close(theirs.lat), close(theirs.lon))
                assert ours.speed_mps == close(theirs.spd * 1852 / 3600)
                assert ours.course_deg == number(theirs.cog)
                assert (ours.day, ours.illegal_date) == (days_of(theirs.date), False)
            case Gga():
                assert ours.vouches == (theirs.quality in (1, 2, 3, 4, 5))
                assert ours.time_of_day_us == us_of(theirs.time)
                assert (ours.lat_deg, ours.lon_deg) == (close(theirs.lat), close(theirs.lon))
                assert (ours.satellites, ours.hdop, ours.altitude_m) == (theirs.numSV, theirs.HDOP, theirs.alt)
            case Vtg():
                assert ours.vouches == (getattr(theirs, "posMode", "") in ("", "A", "D", "F", "P", "R"))
                assert ours.speed_mps == close(theirs.sogn * 1852 / 3600)
                assert ours.course_deg == number(theirs.cogt)
            case Gsa():
                assert ours == (theirs.navMode, theirs.PDOP, theirs.HDOP, theirs.VDOP)
            case Zda():
                date = datetime.date(theirs.year, theirs.month, theirs.day)
                assert ours == (us_of(theirs.time), days_of(date), False)
    assert len(seen) == len(TALKERS) * 5


# --- formats by hand


@pytest.mark.parametrize(
    ("lat", "lon", "expected"),
    [
        ("4807.038,N", "01131.000,E", (48 + 7.038 / 60, 11 + 31 / 60)),
        ("4807,S", "1131.0,W", (-(48 + 7 / 60), -(11 + 31 / 60))),
        ("9000.0000,N", "18000.0,W", (90.0, -180.0)),
        ("0000.12345678,S", "00000.5,W", (-0.12345678 / 60, -0.5 / 60)),
        (",", ",", (None, None)),
    ],
)
def test_positions(lat, lon, expected):
    parsed = parse_sentence(sentence(f"GPGGA,120000,{lat},{lon},1,08,0.9,545.4,M,46.9,M,,"))
    assert (parsed.lat_deg, parsed.lon_deg) == expected


@pytest.mark.parametrize(
    ("clock", "expected"),
    [
        ("000000", 0),
        ("235959.999", DAY_US - 1000),
        ("120000.", 43_200_000_000),
        ("235960.5", DAY_US + 500_000),
        ("010203.0404", 3_723_040_400),
        ("", None),
    ],
)
def test_times(clock, expected):
    assert parse_sentence(sentence(rmc(clock))).time_of_day_us == expected


def test_both_forms_of_vtg():
    modern = parse_sentence(sentence("GPVTG,54.7,T,34.4,M,5.5,N,10.2,K,A"))
    old = parse_sentence(sentence("GPVTG,54.7,34.4,5.5,10.2"))
    assert modern == old == (True, 54.7, 5.5 * KNOT_MPS)
    assert parse_sentence(sentence("GPVTG,,T,,M,,N,36.0,K")) == (True, None, 36.0 * KMH_MPS)
    assert parse_sentence(sentence("GPVTG,,,,,,,,,N")) == (False, None, None)


def test_empty_sentences_say_nothing():
    assert parse_sentence(sentence("GPRMC,,V,,,,,,,,,,N")) == (None, False, None, None, None, None, None, False)
    assert parse_sentence(sentence("GPGGA,,,,,,0,00,99.99,,,,,,")) == (None, False, None, None, 0, None, None)
    assert parse_sentence(sentence("GPGSA,A,1,,,,,,,,,,,,,99.99,0.00,99.00")) == (1, None, None, None)
    assert parse_sentence(sentence("GPZDA,,,,,00,00")) == (None, None, False)


@pytest.mark.parametrize(
    "text",
    [
        "GPRMC,120000,A,4807.038,N,01131.000,E,10.0,84.4,150626,",  # too few fields
        "GPRMC,120000,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A,V,V",  # too many
        "GPRMC,120000,B,4807.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,250000,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,126000,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,120061,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,12000,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,9007.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,4867.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,E,01131.000,N,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,,01131.000,E,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,N,,,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,N,18100.000,E,10.0,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,N,01131.000,E,291.6,84.4,150626,,,A",  # 150.01 m/s
        "GPRMC,120000,A,4807.038,N,01131.000,E,-1.0,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,N,01131.000,E,nan,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,N,01131.000,E,1e1,84.4,150626,,,A",
        "GPRMC,120000,A,4807.038,N,01131.000,E,10.0,360.1,150626,,,A",
        "GPGGA,120000,4807.038,N,01131.000,E,9,08,0.9,545.4,M,46.9,M,,",
        "GPGGA,120000,4807.038,N,01131.000,E,1,100,0.9,545.4,M,46.9,M,,",
        "GPGGA,120000,4807.038,N,01131.000,E,1,08,0.9,54540.4,M,46.9,M,,",
        "GPGGA,120000,4807.038,N,01131.000,E,1,08,0.9,545.4,F,46.9,M,,",
        "GPGSA,A,4,,,,,,,,,,,,,1.0,1.0,1.0",
        "GPVTG,54.7,T,34.4,M,5.5,K,10.2,N,A",
        "GPZDA,120000,15,06,2026,00",
        "GPGSV,1,1,00",
        "PQRMC,120000,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A",
        "GPXRMC,120000,A",
        "",
    ],
)
def test_what_cannot_be_is_not_read(text):
    assert check(sentence(text)) is Checksum.GOOD
    assert parse_sentence(sentence(text)) is None


def test_checksum_is_strict():
    good = sentence(rmc())
    assert check(good) is Checksum.GOOD
    assert check(good[:-3]) is Checksum.MISSING
    assert check(good[:-1]) is Checksum.BAD
    assert check(good + b"0") is Checksum.BAD
    assert check(good[:-2] + b"G0") is Checksum.BAD
    assert check(sentence("GPTXT,a*b")) is Checksum.GOOD
    assert check(sentence("GP" + "X" * 126)) is Checksum.BAD
    assert parse_sentence(good[:-3]) is None


# --- epochs


def test_an_epoch_gathers_its_sentences_whatever_their_order():
    parts = [rmc(), gga(), "GNGSA,A,3,02,07,,,,,,,,,,,1.5,0.8,1.2,1"]
    for order in (parts, [parts[1], parts[2], parts[0]], [parts[1], parts[0], parts[2]]):
        (fix,), _ = decode(lines(*order), t_us=7)
        assert fix.valid
        assert fix.t_us == 7
        assert fix.utc_us == utc_us(2026, 6, 15, 12)
        assert fix.time_of_day_us == DAY_US // 2
        assert (fix.lat_deg, fix.lon_deg) == (48 + 7.038 / 60, 11 + 31 / 60)
        assert fix.speed_mps == 10.0 * 1852 / 3600
        assert (fix.course_deg, fix.altitude_m, fix.satellites, fix.hdop) == (84.4, 545.4, 8, 0.9)


def test_an_epoch_carries_the_arrival_of_its_first_byte():
    data = lines(rmc("120000.00"), gga("120000.00"), rmc("120001.00"))
    decoder = NmeaDecoder()
    closing = len(data) - 2
    fixes = [fix for k in range(len(data)) for fix in decoder.feed(1000 + k, data[k : k + 1]) if k <= closing]
    assert [fix.t_us for fix in fixes] == [1000]
    assert [fix.t_us for fix in decoder.flush()] == [1000 + data.rindex(b"$")]
    assert decoder.flush() == []


@pytest.mark.parametrize(
    ("text", "valid"),
    [
        *((rmc(mode=mode), True) for mode in ("", ",", ",A", ",D", ",F", ",P", ",R", ",A,V")),
        *((rmc(mode=mode), False) for mode in (",E", ",M", ",N", ",S", ",V", ",C", ",0")),
        *((rmc(status="V", mode=mode), False) for mode in ("", ",A", ",D")),
        ("GPRMC,120000,A,,,,,10.0,84.4,150626,,,A", False),
        *((gga(quality=quality), quality in "12345" and quality != "") for quality in ["", *"012345678"]),
    ],
)
def test_validity(text, valid):
    (fix,), _ = decode(lines(text))
    assert fix.valid is valid
    if not valid:
        assert (fix.utc_us, fix.time_of_day_us, fix.lat_deg, fix.lon_deg, fix.speed_mps) == (None,) * 5


def test_rmc_and_gga_must_both_vouch():
    (fix,), _ = decode(lines(rmc(), gga(quality="6")))
    assert not fix.valid
    (fix,), _ = decode(lines(rmc(status="V"), gga()))
    assert not fix.valid


def test_a_receiver_without_fix_or_time_is_still_heard():
    empty = ["GPRMC,,V,,,,,,,,,,N", "GPVTG,,,,,,,,,N", "GPGGA,,,,,,0,00,99.99,,,,,,", "GPGSA,A,1" + "," * 16]
    fixes, counters = decode(lines(*(empty * 3)))
    assert [fix.valid for fix in fixes] == [False] * 3
    assert counters["sentences"] == 12
    stuck = [rmc(status="V", mode=",N")] * 4
    assert [fix.valid for fix in decode(lines(*stuck))[0]] == [False] * 4


@pytest.mark.parametrize("text", [
    "GPRMC,::,V,0000.00000,S,0000.00000,W,---,,000000,,,N",
    "GPRMC,235959.99,V,9999.9999,N,99999.9999,E,999.9,999.9,,,,N",
    "GPGGA,------,,,,,0,-1,99.9,-,M,-,M,,",
    "GPGLL,????.??,N,?????.??,E,,V",
])
def test_what_fills_the_fields_of_a_sentence_without_a_fix_may_be_anything(text):
    fixes, counters = decode(lines(text) * 2)
    assert [fix.valid for fix in fixes] == [False] * 2
    assert (counters["malformed"], counters["sentences"]) == (0, 2)


def test_an_address_with_other_than_letters_and_digits_is_none():
    place = "120000,A,4807.038,N,01131.000,E,10.0,84.4,150626,,,A"
    assert parse_sentence(sentence(f"GNRMC,{place}")) is not None
    for address in ("G,RMC", ",,RMC", "G RMC", "G*RMC"):
        assert parse_sentence(sentence(f"{address},{place}")) is None


def test_several_talkers_make_one_fix():
    fixes, _ = decode(lines(rmc(talker="GP"), rmc(talker="GL", speed="11.0"), rmc("120001", talker="GN")))
    assert [fix.speed_mps for fix in fixes] == [10 * KNOT_MPS] * 2


def test_gga_and_vtg_alone_give_fixes_without_date():
    fixes, counters = decode(lines(gga("120000"), "GPVTG,54.7,T,,M,5.5,N,,K,A", gga("120000.2")))
    assert [fix.valid for fix in fixes] == [True, True]
    assert [fix.utc_us for fix in fixes] == [None, None]
    assert [fix.speed_mps for fix in fixes] == [5.5 * KNOT_MPS, None]
    assert fixes[1].time_of_day_us == DAY_US // 2 + 200_000
    assert counters["refused_dates"] == 0


def test_dead_reckoned_speed_is_no_speed():
    (fix,), _ = decode(lines(gga(), "GPVTG,54.7,T,,M,5.5,N,,K,E"))
    assert (fix.valid, fix.speed_mps, fix.course_deg) == (True, None, None)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_date_may_come_from_zda(order):
    texts = (gga("235959.50"), "GPZDA,235959.50,15,06,2026,00,00")
    fixes, _ = decode(lines(texts[order[0]], texts[order[1]]))
    assert [fix.utc_us for fix in fixes] == [utc_us(2026, 6, 15, 23, 59, 59) + 500_000]


@pytest.mark.parametrize("day", ["99", "015", "9" * 40, "9" * 5000])
@pytest.mark.parametrize("field", [1, 2])
def test_a_date_from_zda_that_cannot_be_leaves_the_position(field, day):
    words = ["GPZDA", "120000.00", "15", "06", "2026", "00", "00"]
    words[field + 1] = day
    (fix,), _ = decode(lines(gga("120000.00"), ",".join(words)))
    assert (fix.valid, fix.utc_us, fix.lat_deg) == (True, None, 48 + 7.038 / 60)


def test_a_date_once_known_counts_on_over_midnight_and_days():
    decoder = NmeaDecoder()
    decoder.feed(0, lines("GPZDA,235959.00,15,06,2026,00,00", gga("235959.00")))
    fixes = decoder.feed(1_000_000, lines(gga("000000.00")))
    fixes += decoder.feed(2_000_000, lines(gga("000001.00")))
    fixes += decoder.feed(2 * DAY_US, lines(gga("000010.00")))
    fixes += decoder.flush()
    assert [fix.utc_us for fix in fixes] == [
        utc_us(2026, 6, 15, 23, 59, 59),
        utc_us(2026, 6, 16),
        utc_us(2026, 6, 16, 0, 0, 1),
        utc_us(2026, 6, 18, 0, 0, 10),
    ]


@pytest.mark.parametrize("week_rollovers", [0, 1, 400])
@pytest.mark.parametrize("clock", ["000000.00", "120000.00", "235959.00"])
@pytest.mark.parametrize("date", ["31,12,9999", "01,01,2069", "31,12,2068", "01,01,0001", "31,12,0001"])
def test_a_date_of_another_age_is_refused(date, clock, week_rollovers):
    decoder = NmeaDecoder(week_rollovers)
    decoder.feed(0, lines(f"GPZDA,{clock},{date},00,00", gga(clock)))
    fixes = decoder.feed(1_000_000, lines(gga("120001.00"))) + decoder.flush()
    is_known = date == "31,12,2068" and week_rollovers == 0
    assert [fix.utc_us is not None for fix in fixes] == [is_known, is_known]
    assert decoder.counts["refused_dates"] == (not is_known)


def test_zda_of_a_receiver_without_fix_is_not_believed():
    fixes, _ = decode(lines(gga("120000", quality="0"), "GPZDA,120000,15,06,2026,00,00", gga("120001")))
    assert [fix.utc_us for fix in fixes] == [None, None]


@pytest.mark.parametrize(
    ("clock", "date", "expected_us"),
    [("000000.00", "150626", DAY_US), ("000000.00", "160626", DAY_US), ("235959.80", "160626", DAY_US - 200_000)],
)
def test_date_and_time_need_not_wrap_together(clock, date, expected_us):
    """Old date after midnight, or new date before it: UTC goes on steadily."""
    decoder = NmeaDecoder()
    decoder.feed(0, lines(rmc("235959.60", "150626")))
    decoder.feed(400_000, lines(rmc(clock, date)))
    (fix,) = decoder.flush()
    assert fix.utc_us == utc_us(2026, 6, 15) + expected_us


def test_a_wrong_day_is_not_held_on_to():
    """Switched on between the wrap of the time and that of the date: the first date is a day late, the next right."""
    decoder = NmeaDecoder()
    decoder.feed(0, lines(rmc("000000.00", "150626")))
    decoder.feed(200_000, lines(rmc("000000.20", "160626")))
    (fix,) = decoder.flush()
    assert fix.utc_us == utc_us(2026, 6, 16) + 200_000


@pytest.mark.parametrize("date", ["311199", "061206", "311225", "320126", "300226", "2208-1", "15062026", "000000"])
def test_refused_dates_leave_the_position(date):
    (fix,), counters = decode(lines(rmc(date=date)))
    assert (fix.valid, fix.utc_us) == (True, None)
    assert (fix.lat_deg, fix.time_of_day_us) == (48 + 7.038 / 60, DAY_US // 2)
    assert (counters["refused_dates"], counters["malformed"]) == (1, 0)


def test_no_date_is_not_a_refused_one():
    (fix,), counters = decode(lines(rmc(date="")))
    assert (fix.valid, fix.utc_us, counters["refused_dates"]) == (True, None, 0)


def test_the_first_day_that_is_accepted():
    (fix,), _ = decode(lines(rmc("000000", date="010126")))
    assert fix.utc_us == utc_us(2026, 1, 1)
    (fix,), _ = decode(lines(rmc(date="220899")), earliest_utc_us=0)
    assert fix.utc_us == utc_us(1999, 8, 22, 12)
    (fix,), _ = decode(lines(rmc(date="010168")))
    assert fix.utc_us == utc_us(2068, 1, 1, 12)


def test_a_known_week_rollover_is_put_right():
    """2026-06-15 less 1024 weeks is 2006-10-30."""
    (fix,), counters = decode(lines(rmc(date="301006")), week_rollovers=1)
    assert (fix.utc_us, counters["refused_dates"]) == (utc_us(2026, 6, 15, 12), 0)


def test_a_leap_second_is_the_next_day():
    (fix,), _ = decode(lines(rmc("235960.00", "300626")))
    assert fix.utc_us == utc_us(2026, 7, 1)


# --- damage

DRIVE = [
    text
    for second in range(12)
    for text in (
        rmc(f"1200{second:02d}.00", speed=f"{second}.5"),
        "GPGSV,1,1,01,12,17,083,03",
        gga(f"1200{second:02d}.00"),
        "GPVTG,84.4,T,,M,5.5,N,10.2,K,A",
    )
]
BINARY = b"\xb5\x62\x01\x07\x0c\x00$GPRMC,1*00\n"


def with_check_bytes(frame):
    a = b = 0
    for byte in frame[2:]:
        a = (a + byte) % 256
        b = (b + a) % 256
    return frame + bytes((a, b))


def test_ubx_in_between_changes_nothing():
    clean, counted = decode(lines(*DRIVE))
    binary = with_check_bytes(BINARY)
    mixed, counters = decode(binary.join(sentence(text) + b"\r\n" for text in DRIVE))
    assert mixed == clean
    assert (counters["ubx_frames"], counters["dropped_bytes"]) == (len(DRIVE) - 1, 0)
    assert counters["sentences"] == counted["sentences"] == len(DRIVE)


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n", b"\r\r\n", b" \r\n"])
def test_line_ends(end):
    fixes, _ = decode(b"".join(sentence(text) + end for text in DRIVE))
    assert fixes == decode(lines(*DRIVE))[0]


def test_split_at_every_byte():
    data = b"\n".join(with_check_bytes(BINARY) + sentence(text) for text in DRIVE[:8]) + b"\n"
    whole = decode(data)
    for place in range(len(data)):
        decoder = NmeaDecoder()
        fixes = decoder.feed(5, data[:place]) + decoder.feed(5, data[place:]) + decoder.flush()
        assert (fixes, decoder.counts) == whole


def test_truncated_anywhere_loses_no_more_than_the_sentence():
    """The beginning of a sentence, then the next: what real captures hold after lost bytes."""
    whole = sentence(rmc("120000.00"))
    for size in range(len(whole)):
        fixes, counters = decode(whole[:size] + lines(rmc("120001.00")))
        assert [fix.time_of_day_us for fix in fixes] == [DAY_US // 2 + 1_000_000]
        assert counters["sentences"] == 1
        assert counters["bad_checksum"] + counters["no_checksum"] == (size > 0)


@pytest.mark.parametrize("text", [rmc(), gga(), "GNVTG,84.4,T,,M,5.5,N,10.2,K,A"])
def test_every_corrupted_byte_is_seen(text):
    right = sentence(text)
    expected = parse_sentence(right)
    for place in range(len(right)):
        for value in range(256):
            wrong = right[:place] + bytes((value,)) + right[place + 1 :]
            parsed = parse_sentence(wrong)
            assert parsed is None or (parsed == expected and wrong.upper() == right.upper())


def test_counters():
    good = sentence(rmc())
    bad = good[:-2] + b"ZZ"
    malformed = sentence("GPVTG,54.7,T,34.4,M,5.5,K,10.2,N,A")
    data = b"junk\r\n" + b"\r\n".join([good, bad, b"$PLCS,REV", malformed, sentence("GPGSV,1,1,00")]) + b"\r\n"
    fixes, counters = decode(data + with_check_bytes(BINARY))
    assert len(fixes) == 1
    assert counters["sentences"] == 3
    assert (counters["bad_checksum"], counters["no_checksum"], counters["malformed"]) == (1, 1, 1)
    assert (counters["ubx_frames"], counters["dropped_bytes"]) == (1, 4)


PIECES = st.one_of(
    st.binary(max_size=40),
    st.sampled_from([*DRIVE[:4], "GPZDA,120000,15,06,2026,00,00", rmc(status="V")]).map(lambda text: lines(text)),
    st.sampled_from([b"$GPRMC", b"$", b"*", with_check_bytes(BINARY), BINARY]),
)


@settings(max_examples=150)
@given(st.lists(PIECES, max_size=10).map(b"".join), st.lists(st.integers(0, 600), max_size=6))
def test_cuts_do_not_matter(data, places):
    edges = [0, *sorted(min(place, len(data)) for place in places), len(data)]
    decoder = NmeaDecoder()
    fixes = [fix for a, b in pairwise(edges) for fix in decoder.feed(5, data[a:b])]
    assert (fixes + decoder.flush(), decoder.counts) == decode(data)


ALPHABET = st.sampled_from([bytes((byte,)) for byte in b"$*,.\r\nGPRMCANSEW0123456789\xb5\x62"])


@settings(max_examples=150)
@given(st.one_of(st.binary(max_size=500), st.lists(ALPHABET, max_size=300).map(b"".join)))
def test_noise_gives_no_fix_and_no_error(data):
    fixes, counters = decode(data)
    assert fixes == [] or counters["sentences"] > 0


@settings(max_examples=150)
@given(st.text(st.characters(min_codepoint=32, max_codepoint=126, exclude_characters="$*"), max_size=100))
def test_anything_behind_a_right_checksum_is_survived(fields):
    for kind in ("RMC", "GGA", "VTG", "GSA", "ZDA"):
        decode(lines(f"GP{kind},{fields}"))


@pytest.mark.parametrize(("date", "advised"), [
    ("091106", "25 June 2026, its week counter wrapped after 1024 weeks: set gps.week_rollovers: 1"),
    ("060180", ""), ("100180", ""), ("220899", ""), ("070419", ""),  # a count that has just begun: no date yet
    ("010170", ""),  # before the first week: a clock that was never set
])
def test_a_rollover_is_advised_with_the_date_that_it_gives_and_never_of_a_date_that_is_none(date, advised):
    decoder = NmeaDecoder()
    decoder.feed(0, lines(f"GPRMC,120000.00,A,4600.0,N,00630.0,E,30.0,0.0,{date},,,A"))
    decoder.flush()
    assert "earliest_date" in decoder.doubt
    assert ("week_rollovers" in decoder.doubt) == bool(advised)
    assert advised in decoder.doubt


def test_a_receiver_that_names_no_date_is_told_what_to_send():
    """GGA and VTG alone give places and speeds, and no row would ever have a date."""
    decoder = NmeaDecoder()
    for second in range(30):
        decoder.feed(second * 1_000_000, lines(gga(clock=f"1200{second:02d}.00"), "GPVTG,84.4,T,,M,10.0,N,18.5,K,A"))
    assert decoder.doubt.startswith("it sends GGA and VTG, but no date")
    assert decoder.doubt.endswith("have it send RMC with its date, or ZDA sentences too")
    for second in range(30, 60):
        decoder.feed(second * 1_000_000, lines(rmc(clock=f"1200{second:02d}.00"), gga(clock=f"1200{second:02d}.00")))
    assert decoder.doubt == ""


@pytest.mark.parametrize(("every_s", "doubt"), [(1, ""), (5, ""), (10, "it sends only every 10 s")])
def test_a_receiver_that_sends_too_seldom_is_named(every_s, doubt):
    decoder = NmeaDecoder()
    for k in range(5):
        at_s = k * every_s
        decoder.feed(at_s * 1_000_000, lines(rmc(clock=f"1200{at_s:02d}.00")))
    assert decoder.doubt.startswith(doubt)
    assert bool(decoder.doubt) == bool(doubt)
    decoder.feed(60_000_000, lines(rmc(clock=f"1200{at_s + 1:02d}.00")))
    assert decoder.doubt == ""
