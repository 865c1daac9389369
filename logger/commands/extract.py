"""Make runs for the lab out of what the box in the car recorded, or a phone.

Each continuous drive of a dump becomes a folder DIR/NAME, DIR/NAME-2, ... with drive.csv and run.yaml. With --profile,
a measured line with lat_deg,lon_deg, a run holds only what was driven on that line, by the line's own distance: first
from the GPS positions, then from the road as the car felt it. profile.csv then lies beside drive.csv.

  ridelog extract drive.dump.gz --out runs --profile line.csv
  ridelog diagnose --vehicle mycar.yaml runs/*

With --csv, recordings of phones and other loggers: a CSV file, or the folder of one recording with several. Exports of
phyphox, Sensor Logger, SensorLog, AndroSensor and Physics Toolbox are recognised; name the columns of others. The phone
may lie at any angle: gravity shows which way is up. Uneven and repeated samples are repaired.

  ridelog extract --csv phyphox-export/ --out runs
  ridelog extract --csv ride.csv --location gps.csv --out runs
  ridelog extract --csv log.csv --out runs --columns "t=time:ms,x=ax:g,y=ay:g,z=az:g,lat=lat,lon=lon,speed=v:km/h"

Exit status 1: one of several recordings could not be used; it is named, and the others are done.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.question import Range
from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput
from logger.left_out import left_out_json, left_out_lines
from logger.printable import printable

if TYPE_CHECKING:
    from collections.abc import Callable

    from logger.api.extraction import Extracted

CSV_OPTIONS = ("columns", "location", "up", "sign", "range", "speed")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog extract``."""
    parser.add_argument("dumps", nargs="*", type=Path, metavar="DUMP", help="recorded drive (.dump or .dump.gz)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the runs")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings of those drives")
    parser.add_argument("--profile", type=Path, metavar="PROFILE.csv",
                        help="profile of the road that was driven: distance_m,elevation_m[,elevation_right_m],lat_deg,"
                             "lon_deg; places may be empty in most rows")
    parser.add_argument("--vehicle", metavar="NAME|FILE",
                        help="the car whose model recognises the road (default: the one that the settings or the "
                             "recording name)")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")
    group = parser.add_argument_group("recordings of phones and other loggers")
    group.add_argument("--csv", nargs="+", type=Path, default=[], metavar="FILE|FOLDER",
                       help="recordings, in place of DUMP; a folder holds the files of one recording")
    group.add_argument("--location", type=Path, metavar="FILE.csv",
                       help="the file with the speed or place of the recording, on the same clock")
    group.add_argument("--columns", metavar="ROLE=COLUMN[:UNIT],...",
                       help="which columns are what: t (s, ms, us, ns, iso), x y z or up, the acceleration (m/s2, g, "
                            "mg), gx gy gz, gravity, lat, lon, speed (m/s, km/h, mph, kn). Without a unit: the one at "
                            "the end of the column's name, or what gravity and the clock show")
    group.add_argument("--up", choices=("x", "y", "z", "-x", "-y", "-z"),
                       help="for a record without gravity: the axis that points up (write --up=-z)")
    group.add_argument("--sign", choices=("+", "-"),
                       help="-: change the sign of the acceleration, for a program that gives gravity the opposite "
                            "sign (write --sign=-)")
    group.add_argument("--range", type=float, metavar="G",
                       help="range of the sensor: readings at its ends are marked as clipped (default: ridelog "
                            "recognises the range)")
    group.add_argument("--speed", type=float, metavar="MPS", help="the constant speed of a recording that has none")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog extract``."""
    from drivers.errors import DriverError
    from logger.commands.options import wipe

    for option, within in (("range", Range(0.5, 1000, "g")), ("speed", Range(0.5, 100, "m/s"))):
        if (value := getattr(args, option)) is not None:
            within.check(f"--{option}", value)
    extract_one = _of_csv(args) if args.csv else _of_dumps(args)
    sources = args.csv or args.dumps
    done: list[Extracted] = []
    for source in sources:
        try:
            found = extract_one(source)
        except (BadInput, DriverError) as error:
            wipe()
            if len(sources) == 1:
                raise
            print(f"ridelog: {printable(str(error))}", file=sys.stderr)
            continue
        wipe()
        done.append(found)
        if not args.json:
            print("\n".join(map(printable, lines(source, found))))
    if not done:
        raise BadInput(f"expected a {'recording' if args.csv else 'dump'} that can be used, found none among "
                       f"{len(sources)}")
    if args.json:
        notes = {"notes": [note for each in done for note in each.notes]} if args.csv else {}
        print(json.dumps({"runs": [one.as_json() for each in done for one in each.runs],
                          **left_out_json(one for each in done for one in each.left_out),
                          "torn_tail": any(each.torn_tail for each in done), **notes}))
    return EXIT_DONE if len(done) == len(sources) else EXIT_CHECK_FAILED


def _of_dumps(args: argparse.Namespace) -> Callable[[Path], Extracted]:
    from logger.api.extraction import extract_dump, name_of, read_measured_profile
    from logger.commands.options import on_screen
    from logger.service.config import load_config

    if not args.dumps:
        raise BadInput("extract: expected a DUMP, or --csv with a recording of a phone or another logger")
    if given := next((one for one in CSV_OPTIONS if getattr(args, one) is not None), None):
        raise BadInput(f"extract: expected --{given} together with --csv")
    _refuse_again(args.dumps, [name_of(one) for one in args.dumps], "dumps")
    config = load_config(args.config) if args.config else None
    measured = read_measured_profile(args.profile) if args.profile else None
    return lambda dump: extract_dump(dump, args.out, config, measured, on_screen(), args.vehicle)


def _of_csv(args: argparse.Namespace) -> Callable[[Path], Extracted]:
    from logger.api.csv_extraction import CsvSettings, extract_csv, run_name
    from logger.api.extraction import read_measured_profile
    from logger.commands.options import on_screen
    from logger.service.config import load_config
    from logger.store.formats.logger_csv import named_columns

    if args.dumps:
        raise BadInput(f"extract: expected dumps or --csv, found both ({args.dumps[0]})")
    if args.location is not None and len(args.csv) > 1:
        raise BadInput(f"extract: expected one recording with --location, found {len(args.csv)}")
    _refuse_again(args.csv, [run_name(one) for one in args.csv], "recordings")
    asked = CsvSettings(named_columns(args.columns) if args.columns is not None else None, args.location, args.up,
                  -1.0 if args.sign == "-" else 1.0, args.range, args.speed, args.vehicle)
    config = load_config(args.config) if args.config else None
    measured = read_measured_profile(args.profile) if args.profile else None
    return lambda source: extract_csv(source, args.out, asked, config, measured, on_screen())


def _refuse_again(sources: list[Path], names: list[str], what: str) -> None:
    if again := next((one for number, one in enumerate(sources) if names[number] in names[:number]), None):
        raise BadInput(f"{again}: expected {what} of different names, so that each has a folder of its own")


def lines(source: Path, found: Extracted) -> list[str]:
    """The lines for a person about a recording."""
    printed = [f"{source}: {note}" for note in found.notes]
    for one in found.runs:
        words = f"{one.run}: {one.seconds:.0f} s, {one.metres:.0f} m"
        if one.place_std_m is not None:
            how = "matched to the road" if one.by_road else "by GPS alone: the road was not recognised"
            words += f" on the profile, places ± {one.place_std_m:.2g} m ({how})"
        if one.gaps:
            words += f", {one.gaps} short gaps" if one.gaps > 1 else ", 1 short gap"
        if one.delay_s or one.delay_std_s:
            words += f"; corrected for a GPS delay of {one.delay_s:.2f} ± {one.delay_std_s:.2f} s"
        printed.append(words)
        if (scale := one.unusual_speed_scale) is not None:
            printed.append(f"{one.run}: taken out: speeds that are {100 * scale[0]:.2f} ± {100 * scale[1]:.2f} % of "
                           "those on the profile; a receiver's are not so far off: is the profile's distance_m right?")
    printed += [f"{source}: {words}" for words in left_out_lines(found.left_out)]
    if found.torn_tail:
        printed.append(f"{source}: the recording was cut short; everything before the cut was used")
    return printed
