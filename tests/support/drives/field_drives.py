"""Makes the drives of ``ridelog demo --field``: ``python -m tests.support.drives.field_drives FILE.zip``.

Three passes over a measured street and a fourth drive over the street beyond, as the bytes that a recorder in a car
would have kept: two drives with a BMA220, two with an accelerometer on a serial line, each beside a GPS receiver whose
fixes are noisy and late. All of it is simulated; what the car truly is says ``logger.demo``.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import numpy as np

from logger.demo import BEYOND, FIELD, FOURTH, LINE
from logger.files import write_file
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.effect import chosen
from logger.vehicle.named_parameters import changed, read

from .lab_drives import LONG_AGO
from .simulated_drive import (
    DEFAULT,
    LEAD_M,
    LINES,
    SPACING_M,
    DemoDrive,
    DrivePlan,
    Reception,
    Road,
    RoadStretch,
    build_road,
    record,
    simulate_drive,
)

LINES_M: Mapping[str, tuple[float, float]] = {LINE: (60.0, 560.0), BEYOND: (600.0, 1200.0)}
"""From where to where, as the way goes."""
_PLACE_EVERY = 200  # rows of a line
_STREET = (RoadStretch(220, 300), RoadStretch(160, 700), RoadStretch(210, 250), RoadStretch(150, 80),
           RoadStretch(150, 200),
           RoadStretch(150, 50), RoadStretch(130, 300), RoadStretch(300, 100))
# A console that shakes. The serial sensor is no better than a BMA220 with its steps (0.18 m/s2) and less noise, so that
# no drive decides alone.
_NOISE_MPS2 = {DEFAULT: 0.17, LINES: 0.22}
_LENGTH_M, _SEED = 1300.0, 1927


def _pass(speed_mps: float, swing: float, to_m: float, seed: int, sensor: str = DEFAULT) -> DrivePlan:
    """From the car park at the beginning of the street, up to a speed that swings a little, past ``to_m``, to rest."""
    going_s = to_m / speed_mps
    knots = [(0.0, 0.0), (5.0, 0.0), (5.0 + speed_mps / 2, speed_mps)]
    while (begin_s := knots[-1][0]) < 5.0 + going_s:
        knots.append((begin_s + 8.0, speed_mps * (1 + swing * (-1) ** len(knots))))
    end_s = knots[-1][0]
    knots += [(end_s + speed_mps / 2.5, 0.0), (end_s + speed_mps / 2.5 + 4.0, 0.0)]
    return DrivePlan(
        speed_knots=knots, stretches=(), seed=seed, reception=Reception(first_fix_s=2.0, latency_s=0.18),
        sensor=sensor, noise_mps2=_NOISE_MPS2[sensor], offset_mps2=(0.12, -0.2, 0.17))


PLANS: Mapping[str, DrivePlan] = {
    "first": _pass(8.0, 0.15, 570.0, 11, LINES),
    "second": _pass(11.0, 0.12, 570.0, 12),
    "third": _pass(15.0, 0.10, 570.0, 13, LINES),
    FOURTH: _pass(13.0, 0.12, 1210.0, 14),
}


@cache
def street() -> Road:
    """The street and what lies beyond."""
    return build_road(_STREET, (), _LENGTH_M, _SEED)


def drive(name: str) -> DemoDrive:
    """One of the drives, with its truth."""
    given = read_vehicle(vehicle_file(FIELD.vehicle))
    true = changed(given, {one: factor * read(given, one) for one, factor in FIELD.off.items()})
    return simulate_drive(PLANS[name], true, [chosen(shipped_effects()[FIELD.effect], FIELD.values)], street())


def line(name: str, driven: DemoDrive) -> str:
    """A measured line as CSV; ``driven``: a drive that goes over all of it. Heights are to a tenth of a millimetre."""
    at_m = SPACING_M * np.arange(len(driven.road.elevation_m)) - LEAD_M
    from_m, to_m = LINES_M[name]
    inside = (at_m >= from_m) & (at_m <= to_m)
    at_m, height_m = at_m[inside], driven.road.elevation_m[inside]
    lat, lon = (np.interp(at_m, driven.motion.distance_m, one)
                for one in (driven.motion.lat_deg, driven.motion.lon_deg))
    last = len(at_m) - 1
    rows = [f"{one - from_m:.2f},{z - height_m[0]:.4f},"
            + (f"{a:.7f},{b:.7f}" if number % _PLACE_EVERY == 0 or number == last else ",")
            for number, (one, z, a, b) in enumerate(zip(at_m, height_m, lat, lon, strict=True))]
    return "\n".join(["distance_m,elevation_m,lat_deg,lon_deg", *rows]) + "\n"


def main() -> None:
    """Write the dumps and the lines to the archive named on the command line."""
    made = BytesIO()
    with TemporaryDirectory() as folder, ZipFile(made, "w") as archive:
        for name in PLANS:
            driven = drive(name)
            dump = Path(folder) / f"{name}.dump.gz"
            record(driven, dump)
            _add(archive, dump.name, dump.read_bytes(), ZIP_STORED)
        for name in LINES_M:
            _add(archive, name, line(name, driven).encode("ascii"), ZIP_DEFLATED)
    write_file(sys.argv[1], [made.getvalue()])


def _add(archive: ZipFile, name: str, content: bytes, how: int) -> None:
    # A date of its own, so that the archive is the same whenever it is made.
    entry = ZipInfo(name, LONG_AGO)
    entry.compress_type = how
    archive.writestr(entry, content)


if __name__ == "__main__":
    main()
