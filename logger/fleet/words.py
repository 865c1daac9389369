"""Figures of a fleet in words and as JSON."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from logger.fleet.ingest import Counts
from logger.fleet.layer import FIELDS, roads_layer
from logger.fleet.summary import FALSE_SHARE, FleetFigures, RoadTable, change_found
from logger.left_out import LeftOut, left_out_json, left_out_lines
from logger.printable import counted
from logger.report.left_rows import damaged
from logger.report.quantities import known
from logger.store.log.log_reader import utc

_SHOWN_ROADS, _SHOWN_CARS = 15, 10
_SURE = 2.0
"""Standard errors that a bias is listed from."""


def ingest_json(counts: Counts, rows: int) -> dict[str, Any]:
    """What an ingest did, by name; ``rows``: in the dataset after it."""
    return {**vars(counts), "rows": rows, **left_out_json(_left_out(counts))}


def _left_out(counts: Counts) -> list[LeftOut]:
    return [damaged(counts.damaged_lines), *(LeftOut(number, "row", why) for number, why in (
        (counts.repeated, "that are known already"),
        (counts.contradictions, "at odds with a known one of the same number and time; the first one stays"),
        (counts.undated, "without a date"), (counts.unplaced, "without a place or a direction"),
        (counts.trimmed, "cut at the ends of drives")))]


def ingest_words(counts: Counts, rows: int, place: str) -> str:
    """The same in lines."""
    lines = [f"{place}: {counts.added:,} rows added, {rows:,} in all"]
    known = [f"  {counted(counts.known_logs, 'log')} known already"] if counts.known_logs else []
    return "\n".join([*lines, *known, *(f"  {one}" for one in left_out_lines(_left_out(counts)))])


def figures_json(figures: FleetFigures) -> dict[str, Any]:
    """A summary by name; null: not known."""
    names = [field.name for field in FIELDS]
    biases = figures.biases
    return {
        "by": figures.roads.by, "windows": figures.windows, "withheld_segments": figures.withheld,
        "growth_per_year": known(biases.growth_per_year), "pass_std": known(biases.pass_std),
        "session_std": known(biases.session_std), "repeats": biases.repeats, "repeats_needed": biases.needed,
        "not_known": not_known(figures) or None, "change_found_m_per_km_per_year": known(change_found(figures.roads)),
        "cars": [{"car": car, "passes": int(passes), "bias": known(gain - 1.0 if estimated else np.nan),
                  "bias_std": known(gain * std if estimated else np.nan), "group": int(group)}
                 for car, passes, gain, std, group, estimated in zip(
                     figures.names, figures.car_passes.tolist(), biases.gain.tolist(), biases.log_std.tolist(),
                     biases.group.tolist(), biases.known.tolist(), strict=True)],
        "roads": [dict(zip(names, one.values, strict=True)) for one in roads_layer(figures.roads).features]}


def figures_words(figures: FleetFigures) -> str:
    """A summary in lines: what it rests on, cars that read too high or too low, the roughest roads, and the changes."""
    roads, biases = figures.roads, figures.biases
    lines = [f"{counted(figures.windows, 'window')} of {counted(len(figures.cars), 'car')}; "
             f"{counted(len(roads.key), roads.by)}, {roads.length_m.sum() / 1000:,.1f} km"]
    if figures.withheld:
        lines.append(f"{figures.withheld:,} segments are withheld: too few cars have driven them")
    if why := not_known(figures):
        lines.append(why)
    if isfinite(biases.pass_std):
        lines.append(f"One pass over 66 ft of road is {biases.pass_std:.1%} off (standard deviation), of which "
                     f"{biases.session_std:.1%} are shared by all passes of a session")
    if isfinite(biases.growth_per_year):
        lines.append(f"The mean road changes by {biases.growth_per_year:+.1%} a year")
    return "\n".join([*lines, "", *_cars(figures), "", *_roads(roads), "", *_changes(roads)])


def not_known(figures: FleetFigures) -> str:
    """Why figures are empty that too few drives show; nothing where there are enough."""
    if isfinite(figures.biases.pass_std):
        return ""
    return ("Not known yet: how far one drive is off another, and so the error of an IRI, its change a year, and what "
            f"each car reads too high. It takes {figures.biases.needed} drives over roads that the same car has driven "
            f"before; there {'is' if figures.biases.repeats == 1 else 'are'} {figures.biases.repeats}. Drive the same "
            "roads again.")


def _cars(figures: FleetFigures) -> list[str]:
    biases = figures.biases
    bias, std = biases.gain - 1.0, biases.gain * biases.log_std
    if not isfinite(biases.pass_std):
        more = len(figures.names) - _SHOWN_CARS
        return [f"Cars: {', '.join(sorted(figures.names)[:_SHOWN_CARS])}"
                + f" and {more} more (--json has all)" * (more > 0)]
    if not biases.known.any():
        return ["No road has passes of two cars: nothing is known of their biases"]
    order = np.argsort(-np.abs(bias) * biases.known, kind="stable")
    sure = [one for one in order.tolist() if biases.known[one] and abs(bias[one]) > _SURE * std[one]]
    alone = int((~biases.known).sum())
    lines = [f"Cars that read otherwise than the mean car ({len(sure)} of {len(bias)})"]
    width = max((len(figures.names[one]) for one in sure[:_SHOWN_CARS]), default=0)
    lines += [f"  {figures.names[one]:{width}}  {bias[one]:+7.1%} ± {std[one]:.1%}  "
              f"{int(figures.car_passes[one]):,} passes" for one in sure[:_SHOWN_CARS]]
    if len(sure) > _SHOWN_CARS:
        lines.append(f"  and {len(sure) - _SHOWN_CARS} more (--json has all)")
    return lines + ([f"  of {alone} cars nothing is known: they share no road with others"] if alone else [])


def _roads(roads: RoadTable) -> list[str]:
    order = np.argsort(-np.nan_to_num(roads.iri_m_per_km), kind="stable")[:_SHOWN_ROADS].tolist()
    if not order:
        return ["No road to show"]
    lines = [f"Roughest {roads.by}s",
             "  place                    IRI [m/km]      cars  passes  a_w [m/s2]  last seen   visit"]
    return lines + [
        f"  {roads.lat_deg[one]:10.5f} {roads.lon_deg[one]:11.5f}  {roads.iri_m_per_km[one]:5.2f} "
        f"{error_words(roads.iri_std_m_per_km[one]):7}  {roads.cars[one]:6d}  {roads.passes[one]:6.0f}  "
        f"{_number(roads.a_w_mps2[one], 2):>10}  {utc(int(roads.last_us[one])):%Y-%m-%d}  "
        f"{roads.visit[one].replace('|', ', ')}".rstrip() for one in order]


def _changes(roads: RoadTable) -> list[str]:
    worse = np.flatnonzero(roads.worse)
    order = worse[np.argsort(roads.p_value[worse], kind="stable")][:_SHOWN_ROADS].tolist()
    limit = change_found(roads)
    power = ([f"A change of {limit:.2f} m/km a year would be found on every second {roads.by} with 80 % certainty"]
            if isfinite(limit) else [])
    if not roads.changes_known:
        return [f"Whether a {roads.by} has become worse is not known"]
    if not order:
        return [f"No {roads.by} has become worse, as far as these drives show", *power]
    lines = [f"Became worse: {counted(len(worse), roads.by)} (at most {FALSE_SHARE:.0%} of them falsely)", *power,
             "  place                    IRI [m/km]   a year [m/km]    p"]
    return lines + [
        f"  {roads.lat_deg[one]:10.5f} {roads.lon_deg[one]:11.5f}  {roads.iri_m_per_km[one]:10.2f}  "
        f"{roads.trend_m_per_km_per_year[one]:+6.2f} ± {roads.trend_std_m_per_km_per_year[one]:.2f}  "
        f"{roads.p_value[one]:.1g}" for one in order]


def error_words(std: float) -> str:
    """A standard error behind its value: "± 0.12"; nothing where it is not known."""
    return f"± {std:.2f}" if isfinite(std) else ""


def _number(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if isfinite(value) else ""
