"""The class of a road, for a person and for a program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from logger.report.summary import IRI_CLASSES
from logger.roads.elevation_spectrum import TrackClass
from logger.roads.iso8608 import iri_from_gd_n0
from logger.roads.plausible import doubts_of, unit_doubt
from logger.store.formats.profile_file import Profile


def as_json(tracks: Sequence[TrackClass]) -> dict[str, Any]:
    """Named fields, SI units in the names; a second track is ``right``."""
    return (_track_json(tracks[0]) | ({"right": _track_json(tracks[1])} if len(tracks) > 1 else {})
            | doubts_of(max(track.iri_m_per_km for track in tracks)))


def _track_json(track: TrackClass) -> dict[str, Any]:
    found = track.roughness
    return {
        "class": found.road_class, "gd_n0_cm3": found.gd_n0_cm3, "waviness": found.waviness,
        "iri_m_per_km": track.iri_m_per_km, "gd_n0_std_cm3": found.gd_n0_std_cm3,
        "waviness_std": found.waviness_std, "classes_possible": list(found.classes),
        "iri_of_gd_m_per_km": iri_from_gd_n0(found.gd_n0_cm3),
        "iri_expected_m_per_km": track.expected.value, "iri_expected_std_m_per_km": track.expected.std,
        "lowest_cpm": found.lowest_cpm, "highest_cpm": found.highest_cpm,
    }


def lines(tracks: Sequence[TrackClass], profile: Profile, name: str) -> list[str]:
    """The lines a person sees; ``name`` is that of the file."""
    length_m = (len(profile.elevation_m) - 1) * profile.spacing_m
    printed = [f"{name}: {length_m:.2f} m, one sample every {profile.spacing_m * 1000:.4g} mm"]
    if doubt := unit_doubt(max(track.iri_m_per_km for track in tracks)):
        printed.append(doubt)
    for side, track in zip(("left track", "right track") if len(tracks) > 1 else ("",), tracks, strict=True):
        printed += [*(["", side] if side else []), "", *_track_lines(track)]
    return printed


def _track_lines(track: TrackClass) -> list[str]:
    found = track.roughness
    doubt = "" if len(found.classes) == 1 else \
        f"; the road is too short or too odd to be sure: it may be {' or '.join(found.classes)}"
    return [
        f"class      {found.road_class}: {IRI_CLASSES[found.road_class]}{doubt}",
        f"Gd(n0)     {found.gd_n0_cm3:.4g} +- {found.gd_n0_std_cm3:.2g} cm3, from waves of "
        f"{1 / found.highest_cpm:.2g} to {1 / found.lowest_cpm:.2g} m",
        f"waviness   {found.waviness:.2f} +- {found.waviness_std:.2f} (the classes have 2)",
        f"IRI        {track.iri_m_per_km:.2f} m/km; this Gd(n0) means {iri_from_gd_n0(found.gd_n0_cm3):.2f} by "
        f"Eq 4.39, with this waviness {track.expected.value:.2f} +- {track.expected.std:.2f}",
    ]
