"""The folder of a report: written beside its place, and moved there when it is whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from logger.errors import BadInput
from logger.exchange.format import format_of
from logger.files import whole_folder, write_file, write_text
from logger.fleet.engine import Engine
from logger.fleet.expressions import history
from logger.fleet.layer import roads_layer
from logger.fleet.page import fleet_page
from logger.fleet.road_map import RoadPieces
from logger.fleet.summary import FleetFigures, gains_table, grouped
from logger.fleet.tiles import History, write_tiles

INDEX = "index.html"
_TILES = "tiles"


def check_folder(out: Path) -> None:
    """Raise BadInput for a place that is neither free nor a report's."""
    if not out.parent.is_dir():
        raise BadInput(f"--out {out}: expected a folder in a folder that there is")
    is_report = (out / INDEX).is_file() and (out / _TILES).is_dir()
    if out.exists() and not is_report and not (out.is_dir() and not any(out.iterdir())):
        raise BadInput(f"--out {out}: expected a folder that is not there, is empty, or that a report has made")


def history_of(engine: Engine, figures: FleetFigures, since_us: int | None, until_us: int | None) -> History:
    """The quarters of the segments of a summary."""
    found = engine.arrays(history(engine.rows, gains_table(figures.cars, figures.biases), since_us, until_us))
    key = figures.roads.key
    at = np.minimum(np.searchsorted(key, found["road"]), len(key) - 1)
    published = key[at] == found["road"]
    passes = found["passes"][published]
    return History(at[published], found["quarter"][published], found["iri"][published] / passes, passes)


def write_report(figures: FleetFigures, steps: History, pieces: RoadPieces | None, out: Path) -> int:
    """Write the folder, of figures by segment; give the number of tiles. BadInput for what cannot be written."""
    sections = grouped(figures.roads, "section", pieces, figures.shared)
    try:
        with whole_folder(out) as new:
            tiles = write_tiles(figures.roads, steps, new / _TILES)
            for name, roads in (("segments.parquet", figures.roads), ("sections.parquet", sections),
                                ("sections.csv", sections)):
                write_file(new / name, format_of(out / name).content(
                    roads_layer(roads).printable(), str(out / name)))
            write_text(new / INDEX, fleet_page(figures, sections))
    except OSError as error:
        raise BadInput(f"--out {out}: expected a folder that can be written ({error.strerror or error})") from None
    return tiles
