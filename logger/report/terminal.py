"""A summary as one screen of text, for a terminal that can draw blocks or for one that cannot."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from logger.report.summary import DriveSummary, RoughWindow, Share, class_limits_m_per_km
from logger.store.log.log_reader import utc

_BAR_CELLS = 30
_EIGHTHS = " ▏▎▍▌▋▊▉█"
_SIGNS = {"±": "+-", "²": "2", "·": "-"}


def screen(summary: DriveSummary, encoding: str) -> str:
    """The lines a person reads after a drive. Characters that ``encoding`` does not have are replaced."""
    drawn = _can_encode(_EIGHTHS, encoding)
    lines = [_headline(summary)]
    values = [
        "" if summary.mean_iri_m_per_km is None else f"mean IRI {summary.mean_iri_m_per_km:.1f} m/km",
        "" if summary.a_w_mps2 is None else f"comfort a_w {summary.a_w_mps2:.2f} m/s²",
        "" if summary.mean_speed_mps is None else f"mean speed {summary.mean_speed_mps * 3.6:.0f} km/h",
    ]
    lines += [" · ".join(value for value in values if value), ""]
    lines += ["Road roughness (IRI, by the classes of ISO 8608)", *_bars(summary.iri_classes, class_words, drawn), ""]
    lines += ["Comfort inside (ISO 2631)", *_bars(summary.comfort, comfort_words, drawn), ""]
    lines += ["Roughest places", *_places(summary.roughest)]
    text = "\n".join(lines) + "\n"
    for sign, plain in _SIGNS.items():
        if not _can_encode(sign, encoding):
            text = text.replace(sign, plain)
    return text


def span_words(seconds: float) -> str:
    """A length of time: ``1 h 02 min``, ``17 min 05 s``, ``42 s``."""
    minutes, rest_s = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest_s:02d} s" if minutes else f"{rest_s} s"


def distance_words(distance_m: float) -> str:
    """A distance: ``12.4 km``, or ``840 m`` below one kilometre."""
    return f"{distance_m / 1000:.1f} km" if distance_m >= 1000 else f"{distance_m:.0f} m"


def percent_words(share: float) -> str:
    """A share: ``38%``, and ``<1%`` for one that would be rounded to nothing."""
    return "<1%" if 0 < share < 0.005 else f"{share:.0%}"


def date_words(summary: DriveSummary) -> str:
    """When it was: ``17 May 2025, 14:02 to 14:20 UTC``."""
    if summary.start_utc_us is None or summary.end_utc_us is None:
        return "date not known"
    start, end = utc(summary.start_utc_us), utc(summary.end_utc_us)
    if start.date() == end.date():
        return f"{start.day} {start:%B %Y, %H:%M} to {end:%H:%M} UTC"
    return f"{start.day} {start:%B %Y, %H:%M} to {end.day} {end:%B %Y, %H:%M} UTC"


def class_words(letter: str) -> str:
    """An IRI class: ``B  3.05-6.09 m/km``."""
    if not letter:
        return "no value"
    lower, upper = class_limits_m_per_km(letter)
    if lower is None:
        limits = f"below {upper:.2f}"
    else:
        limits = f"from {lower:.2f}" if upper is None else f"{lower:.2f}-{upper:.2f}"
    return f"{letter}  {limits} m/km"


def comfort_words(name: str) -> str:
    """A comfort word: ``a little uncomfortable``."""
    return name.replace("_", " ") or "no value"


def place_words(place: RoughWindow) -> str:
    """Coordinates as maps take them: ``46.51234, 6.61234``."""
    if place.lat_deg is None or place.lon_deg is None:
        return "position not known"
    return f"{place.lat_deg:.5f}, {place.lon_deg:.5f}"


def iri_words(place: RoughWindow) -> str:
    """The IRI of a place with its standard error: ``14.2 ± 2.1``."""
    error = "" if place.iri_std_m_per_km is None else f" ± {place.iri_std_m_per_km:.1f}"
    return f"{place.iri_m_per_km:.1f}{error}"


def _headline(summary: DriveSummary) -> str:
    what = "1 drive" if summary.drives == 1 else f"{summary.drives} drives"
    return f"{what}, {distance_words(summary.distance_m)} in {span_words(summary.duration_s)} · {date_words(summary)}"


def _bars(shares: Sequence[Share], words_of: Callable[[str], str], drawn: bool) -> list[str]:
    if not shares:
        return ["  no distance was measured"]
    width = max(len(words_of(share.name)) for share in shares)
    return [f"  {words_of(share.name):{width}}  {_bar(share.share, drawn)} {percent_words(share.share):>5} "
            f"{distance_words(share.distance_m):>8}" for share in shares]


def _bar(share: float, drawn: bool) -> str:
    """A bar of fixed room; a share above zero always shows."""
    if not drawn:
        return ("#" * max(round(share * _BAR_CELLS), share > 0)).ljust(_BAR_CELLS, ".")
    eighths = max(round(share * _BAR_CELLS * 8), share > 0)
    full, rest = divmod(eighths, 8)
    return ("█" * full + (_EIGHTHS[rest] if rest else "")).ljust(_BAR_CELLS)


def _places(places: Sequence[RoughWindow]) -> list[str]:
    if not places:
        return ["  none with a value"]
    return [f"  {number}. IRI {iri_words(place):>11} m/km  at {place_words(place):>20}  "
            f"({distance_words(place.along_m)} along{_speed(place)}) {comfort_words(place.comfort)}"
            for number, place in enumerate(places, start=1)]


def _speed(place: RoughWindow) -> str:
    return "" if place.speed_mps is None else f", {place.speed_mps * 3.6:.0f} km/h"


def _can_encode(text: str, encoding: str) -> bool:
    try:
        text.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
