"""``ridelog extract``: runs for the lab out of recordings."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from logger.errors import BadInput
from logger.left_out import left_out_json, left_out_lines
from logger.printable import printable
from logger.question import Argument, Checked, LongQuestion, Option, Range, Several, Verb

if TYPE_CHECKING:
    from logger.api.extraction import Extracted

CSV_OPTIONS = ("columns", "location", "up", "speed_mps")


@dataclass(frozen=True, kw_only=True)
class ExtractQuestion(LongQuestion):
    """Make runs for the lab out of what the box in the car recorded, or a phone.

    Each continuous drive of a dump becomes a folder DIR/NAME, DIR/NAME-2, ... with drive.csv and run.yaml. With
    --profile, a measured line with lat_deg,lon_deg, a run holds only what was driven on that line, by the line's own
    distance: located first by GPS, then by matching the car's response to the profile. profile.csv then lies beside
    drive.csv.

      ridelog extract drive.dump.gz --out runs --profile line.csv
      ridelog diagnose --vehicle mycar.yaml runs/*

    With --csv, recordings of phones and other loggers: a CSV file, or the folder of one recording with several. Exports
    of phyphox, Sensor Logger, SensorLog, AndroSensor and Physics Toolbox are recognised; name the columns of others.
    The phone may lie at any angle: gravity shows which way is up. Uneven and repeated samples are repaired.

      ridelog extract --csv phyphox-export/ --out runs
      ridelog extract --csv ride.csv --location gps.csv --out runs
      ridelog extract --csv log.csv --out runs --columns "t=time:ms,x=ax:g,y=ay:g,z=az:g,lat=lat,lon=lon,speed=v:km/h"

    Exit status 1: a recording could not be used; extract names it and processes the others.
    """

    dumps: Annotated[list[Path] | tuple[Path, ...], Argument("recorded drive (.dump or .dump.gz)", metavar="DUMP",
                                                             read=Path, many=list)] = ()
    out: Annotated[Path, Option("folder for the runs", metavar="DIR", read=Path)]
    config: Annotated[Path | None, Option("settings of those drives", metavar="FILE", read=Path)] = None
    profile: Annotated[Path | None, Option(
        "profile of the road that was driven: distance_m,elevation_m[,elevation_right_m],lat_deg,lon_deg; positions "
        "may be empty in most rows", metavar="PROFILE.csv", read=Path)] = None
    vehicle: Annotated[str | None, Option(
        "the car whose model recognises the road (default: the one that the settings or the recording name)",
        metavar="NAME|FILE")] = None
    csv: Annotated[list[Path] | tuple[Path, ...], Several(
        "recordings of phones and other loggers, in place of DUMP; a folder holds the files of one recording",
        metavar="FILE|FOLDER", read=Path, many=list)] = ()
    location: Annotated[Path | None, Option(
        "with --csv: the file with the speed or position of the recording, on the same clock", metavar="FILE.csv",
        read=Path)] = None
    columns: Annotated[str | None, Option(
        "with --csv: the columns to read: t (s, ms, us, ns, iso), x y z or up, the acceleration (m/s2, g, mg), gx "
        "gy gz, gravity, lat, lon, speed (m/s, km/h, mph, kn). Without a unit: the one at the end of the column's "
        "name, or what gravity and the clock show", metavar="ROLE=COLUMN[:UNIT],...")] = None
    up: Annotated[str | None, Option(
        "with --csv: for a record without gravity, the axis that points up (write --up=-z)",
        choices=("x", "y", "z", "-x", "-y", "-z"))] = None
    speed_mps: Annotated[float | None, Option(
        "with --csv: the constant speed of a recording that has none", Range(0.5, 100, "m/s"), "MPS")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.csv and self.dumps:
            raise self.complaint(f"extract: expected dumps or `csv`, found both ({self.dumps[0]})")
        if not (self.csv or self.dumps):
            raise self.complaint("extract: expected a DUMP, or `csv` with a recording of a phone or another logger")
        if not self.csv and (given := next((one for one in CSV_OPTIONS if getattr(self, one) is not None), None)):
            raise self.complaint(f"extract: expected `{given}` together with `csv`")
        if self.location is not None and len(self.csv) > 1:
            raise self.complaint(f"extract: expected one recording with `location`, found {len(self.csv)}")


VERB = Verb(ExtractQuestion, "logger.commands.extract:extracted")


def extracted(asked: ExtractQuestion) -> Checked:
    """Make the runs. BadInput where not one recording can be used."""
    from drivers.errors import DriverError
    from logger.commands.options import wipe

    sources = asked.csv or asked.dumps
    extract_one = _extractor(asked)
    done: list[tuple[Path, Extracted]] = []
    for number, source in enumerate(sources, start=1):
        if len(sources) > 1:
            asked.progress(f"recording {number} of {len(sources)}: {source}")
        try:
            done.append((source, extract_one(source)))
        except (BadInput, DriverError) as error:
            if len(sources) == 1:
                raise
            wipe()
            print(f"ridelog: {printable(str(error))}", file=sys.stderr)
    if not done:
        raise BadInput(f"expected a {'recording' if asked.csv else 'dump'} that can be used, found none among "
                       f"{len(sources)}")
    found = [one for _, one in done]
    said = {"runs": [one.as_json() for each in found for one in each.runs],
            **left_out_json(one for each in found for one in each.left_out),
            "torn_tail": any(each.torn_tail for each in found),
            **({"notes": [note for each in found for note in each.notes]} if asked.csv else {})}
    return Checked("\n".join(printable(words) for one in done for words in lines(*one)), said,
                   len(done) == len(sources))


def _extractor(asked: ExtractQuestion) -> "Callable[[Path], Extracted]":
    """What makes runs of one recording. BadInput for two that would have one folder, and wrong settings."""
    from logger.api.csv_recording import CsvSettings, extract_csv, run_name
    from logger.api.extraction import extract_dump, name_of, read_measured_profile
    from logger.service.config import load_config
    from logger.store.formats.logger_csv import named_columns

    sources, name = (asked.csv, run_name) if asked.csv else (asked.dumps, name_of)
    names = list(map(name, sources))
    if again := next((one for number, one in enumerate(sources) if names[number] in names[:number]), None):
        raise BadInput(f"{again}: expected {'recordings' if asked.csv else 'dumps'} of different names, so that each "
                       "has a folder of its own")
    settings = CsvSettings(named_columns(asked.columns) if asked.columns is not None else None, asked.location,
                           asked.up, asked.speed_mps, asked.vehicle)
    config = load_config(asked.config) if asked.config else None
    measured = read_measured_profile(asked.profile) if asked.profile else None
    if asked.csv:
        return lambda source: extract_csv(source, asked.out, settings, config, measured, asked.progress)
    return lambda dump: extract_dump(dump, asked.out, config, measured, asked.progress, asked.vehicle)


def lines(source: Path, found: "Extracted") -> list[str]:
    """The lines for a person about a recording."""
    printed = [f"{source}: {note}" for note in found.notes]
    for one in found.runs:
        words = f"{one.run}: {one.seconds:.0f} s, {one.metres:.0f} m"
        if one.place_std_m is not None:
            how = "matched to the road" if one.by_road else "by GPS alone: the road was not recognised"
            words += f" on the profile, positions ± {one.place_std_m:.2g} m ({how})"
        if one.gaps:
            words += f", {one.gaps} short gaps" if one.gaps > 1 else ", 1 short gap"
        if one.delay_s or one.delay_std_s:
            words += f"; corrected for a GPS delay of {one.delay_s:.2f} ± {one.delay_std_s:.2f} s"
        printed.append(words)
        if (scale := one.unusual_speed_scale) is not None:
            printed.append(f"{one.run}: corrected speeds that were {100 * scale[0]:.2f} ± {100 * scale[1]:.2f} % of "
                           "those on the profile. A receiver is not that far off: is the profile's distance_m right?")
    printed += [f"{source}: {words}" for words in left_out_lines(found.left_out)]
    if found.torn_tail:
        printed.append(f"{source}: the recording was cut short; everything before the cut was used")
    return printed
