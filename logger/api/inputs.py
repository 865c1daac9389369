"""What is asked about: vehicles with their effects, roads and runs, as they are read, made, checked and written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from inspect import getdoc
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.api.shown import Shown, table
from logger.chart_data import Array, Chart, Curves, line
from logger.dsp.channel_faults import released_at
from logger.errors import BadInput, as_bad_input
from logger.files import make_folder, together
from logger.printable import Notify, silent
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.report.quantities import numbers_of, unit_of
from logger.runs import UNKNOWN, Past, past_of
from logger.shipped import vehicle_names, vehicle_path
from logger.store.formats import drive_file, effect_file, profile_file, vehicle_file
from logger.store.formats.drive_file import facts_beside, write_run_facts
from logger.store.formats.record_checks import EvenRecord, RecordRules, even_columns
from logger.vehicle.compose import Car, compose, with_effect
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import changed, names, read
from logger.vehicle.structure import force_row
from logger.vehicle.vehicle import Vehicle

# --- vehicles ---


@dataclass(frozen=True, eq=False, repr=False)
class Model(vehicle_file.CarModel, Shown):
    """A vehicle with its effects, as in a vehicle's file.

    vehicle    the plain car: masses, springs, dampers and places
    effects    what it has besides, each with values and, where it was fitted, standard errors
    history    the steps that led to it, each with its error
    given      the car before any of its numbers was refitted; None: none was
    errors     standard errors of its numbers with their correlations; None: none are known
    """

    @property
    def numbers(self) -> dict[str, float]:
        """The car's numbers by the names of its file: ``front.suspension_damping_n_s_per_m``."""
        return {name: read(self.vehicle, name) for name in _names(self.vehicle)}

    def with_numbers(self, values: Mapping[str, float]) -> Model:
        """The same car with other numbers, named as in its file. BadInput for a name that there is not.

        >>> heavier = read_vehicle("rav4-2009").with_numbers({"front.unsprung_mass_kg": 60.0})
        >>> heavier.vehicle.front.unsprung_mass_kg
        60.0
        """
        if unknown := set(values) - set(self.numbers):
            raise BadInput(f"{self.vehicle.name}: no parameter {sorted(unknown)[0]!r}: expected one of "
                           f"{', '.join(self.numbers)}")
        return replace(self, vehicle=changed(self.vehicle, values))

    def with_effect(self, name: str, **values: float) -> Model:
        """The same car with one more effect, or another value of one that it has.

        name      of an effect that comes with ridelog, or the path of a Python file with one of your own
        values    of its parameters; those that are not said are at their usual value

        BadInput for an effect or a parameter that there is not, or that this car cannot have.

        >>> rubbing = read_vehicle("rav4-2009").with_effect("dry_friction", friction_force_n=80.0)
        >>> rubbing.effects[0].values["friction_force_n"]
        80.0
        """
        effect, file = effect_file.effect_named(name)
        with as_bad_input(name):
            one = chosen(effect, effect.usual | values, file=file)
        effect_file.check_on(self.vehicle, one, two_tracks=True)
        return replace(self, effects=with_effect(self.effects, one))

    def __repr__(self) -> str:
        rows = [(name, f"{value:.6g}", unit_of(name)) for name, value in self.numbers.items()]
        effects = [f"  with {one.effect.name} {numbers_of(one)}".rstrip() for one in self.effects]
        kind = self.vehicle.model.replace("_", " ")
        return "\n".join([table(f"{self.vehicle.name} ({kind})", rows), *effects])


def _names(vehicle: Vehicle) -> list[str]:
    return [name for name in names(vehicle) if not name.startswith("both.")]


def vehicles() -> list[str]:
    """Names of the vehicles that come with ridelog.

    >>> "rav4-2009" in vehicles()
    True
    """
    return vehicle_names()


def read_vehicle(vehicle: Path | str) -> Model:
    """A vehicle with its effects.

    vehicle    name of one that comes with ridelog, or the path of a YAML file (with a / or .yaml in its name)

    Raises BadInput (``file:line: expected ...``) for whatever is missing, unknown or wrong in the file. An effect of
    your own that it names is Python, which is run.

    >>> car = read_vehicle("rav4-2009")
    >>> car.vehicle.model, car.numbers["sprung_mass_kg"]
    ('half_car', 875.0)
    """
    return Model(**vars(vehicle_file.read_model(vehicle_path(str(vehicle)))))


def write_vehicle(path: Path | str, model: Model) -> None:
    """Write a vehicle as a file that ``read_vehicle`` reads back equal, to the last bit. OSError if that fails.

    >>> write_vehicle(folder / "mycar.yaml", read_vehicle("rav4-2009").with_effect("wheel_lift"))
    >>> [one.effect.name for one in read_vehicle(folder / "mycar.yaml").effects]
    ['wheel_lift']
    """
    vehicle_file.write_model(path, model)


def model_of(vehicle: vehicle_file.CarModel | Path | str) -> Model:
    """The model, or that of a name or a file."""
    if isinstance(vehicle, vehicle_file.CarModel):
        return vehicle if isinstance(vehicle, Model) else Model(**vars(vehicle))
    return read_vehicle(vehicle)


@dataclass(frozen=True, eq=False, repr=False)
class Effects(Mapping[str, "EffectInfo"], Shown):
    """The physical effects that ridelog knows, by name."""

    by_name: Mapping[str, EffectInfo]

    def __getitem__(self, name: str) -> EffectInfo:
        return self.by_name[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_name)

    def __len__(self) -> int:
        return len(self.by_name)

    def __repr__(self) -> str:
        width = max(map(len, self.by_name), default=0)
        return "\n".join(f"{name:{width}}  {one.title}" for name, one in self.by_name.items())


@dataclass(frozen=True, repr=False)
class EffectInfo(Shown):
    """A physical effect.

    title         in a few words
    parameters    its numbers: name, which ends in its unit, and meaning
    signature     what it leaves in a measurement
    shown_by      the drive that would show it best
    source        of the law
    """

    name: str
    title: str
    parameters: Mapping[str, str]
    signature: str
    shown_by: str
    source: str

    def __repr__(self) -> str:
        numbers = [f"  {name}: {meaning}" for name, meaning in self.parameters.items()]
        return "\n".join([f"{self.name}: {self.title}", *numbers, f"  leaves: {self.signature}",
                          f"  to see it: {self.shown_by}", f"  source: {self.source}"])


def effects() -> Effects:
    """The physical effects that ridelog knows, by name.

    >>> effects()["dry_friction"].title
    'Coulomb friction beside spring and damper'
    """
    return Effects({name: EffectInfo(name, one.title, {p.name: p.meaning for p in one.parameters}, one.signature,
                                     one.shown_by, one.source) for name, one in effect_file.shipped_effects().items()})


def check_forces(vehicle: Vehicle, track: Track | Excitation, said: str) -> None:
    """BadInput where a force, ``said`` in this file, acts on a part that the vehicle does not have, or what is moved is
    not what this vehicle is moved by."""
    if vehicle.is_part != (past_of(track) is Past.OF_PART):
        raise BadInput(f"{Path(said).parent}: expected an excitation.csv with " + (
            "t_s,displacement_m, as the vehicle is a part that its bench moves" if vehicle.is_part else
            f"elevation_m or forces, found displacement_m, which moves a part alone: the vehicle is a "
            f"{vehicle.model.replace('_', ' ')}"))
    for one in track.forces if isinstance(track, Excitation) else ():
        try:
            force_row(structure_of(vehicle), one.parts)
        except ValueError as error:
            raise BadInput(f"{said}: {one.name}: {error}") from None


def car_on(vehicle: Vehicle, effects: Sequence[Chosen], said: Mapping[str, str], track: Track | Excitation) -> Car:
    """The vehicle with its effects, which are possible on this road; ``said`` where, by name. BadInput for one that is
    not, ValueError as ``compose``."""
    for one in effects:
        with as_bad_input(said[one.effect.name], BadInput):
            effect_file.check_on(vehicle, one, track.two_tracks, track.timed, bool(track.acts_on))
    with as_bad_input(vehicle.name):
        return compose(vehicle, effects)


# --- roads ---


@dataclass(frozen=True, eq=False, repr=False)
class Profile(profile_file.Wheelpaths, Shown):
    """The elevations of a road under one or two wheelpaths.

    start_m              distance of the first sample [m]
    spacing_m            between samples [m]
    elevation_m          (n,) of the left track, or of the only one [m]
    elevation_right_m    (n,) of the right one [m], or None
    widest_step_m        for one that was resampled: the widest hole that a straight line was laid across [m]
    """

    @property
    def distance_m(self) -> Array:
        """(n,) where the samples lie [m]."""
        return self.start_m + self.spacing_m * np.arange(len(self.elevation_m), dtype=np.float64)

    def __repr__(self) -> str:
        return table("Profile", [
            ("length", self.spacing_m * (len(self.elevation_m) - 1), "m"), ("begins at", self.start_m, "m"),
            ("spacing", self.spacing_m, "m"), ("samples", len(self.elevation_m), ""),
            ("wheelpaths", 1 if self.elevation_right_m is None else 2, ""),
            ("elevation, standard deviation", float(self.elevation_m.std()), "m"),
            ("resampled across", self.widest_step_m, "m")])

    def charts(self) -> Sequence[Chart]:
        """The elevation of each track."""
        right = self.elevation_right_m
        tracks = {"elevation" if right is None else "left": self.elevation_m, "right": right}
        return [Curves("Profile", "distance [m]", "elevation [m]", tuple(
            line(name, self.distance_m, track) for name, track in tracks.items() if track is not None))]


def read_profile(path: Path | str, resample_m: float | None = None) -> Profile:
    """Read a road profile.

    path          CSV ``distance_m,elevation_m[,elevation_right_m]``, or ERD (recognised by its first line)
    resample_m    for one that is unevenly spaced: lay straight lines between its samples, and take one every so many
                  metres [m]

    Raises BadInput (``file:line: expected ...``) for anything else, and for distances that are not evenly spaced.

    >>> road = read_profile(folder / "profile.csv")
    >>> road.elevation_m.shape, road.spacing_m
    ((2001,), 0.1)
    """
    return Profile(**vars(profile_file.read_profile(path, resample_m, judged=True)))


def write_profile(path: Path | str, profile: Profile) -> None:
    """Write a profile as CSV, to a tenth of a micrometre. OSError if that fails.

    >>> write_profile(folder / "smooth.csv", random_road(iso_class="A", length_m=50.0))
    """
    drive_file.write_profile(Path(path), drive_file.track_of(profile))


# --- runs ---


@dataclass(frozen=True, eq=False, repr=False)
class Run(drive_file.Drive, Shown):
    __doc__ = f"""{getdoc(drive_file.Drive)}
profile        the road that was driven; None: not known
excitation     what moved the wheels of a rig, counted from the first sample; None: it is no rig
"""

    profile: Profile | None = None
    excitation: Excitation | None = None

    def __repr__(self) -> str:
        return table(f"Run {self.path}", [
            ("time", len(self.time_s) / self.rate_hz, "s"), ("samples", len(self.time_s), ""),
            ("rate", self.rate_hz, "Hz"),
            ("distance", None if self.excitation else
             f"{self.distance_m.min():.4g} to {self.distance_m.max():.4g}", "m"),
            ("mean speed", None if self.excitation else float(self.speed_mps.mean()), "m/s"),
            ("acceleration, r.m.s.", float(np.sqrt(np.mean(self.accel_z_mps2**2))), "m/s2"),
            ("profile", None if self.profile is None else
             f"{self.profile.start_m:.4g} to {self.profile.distance_m[-1]:.4g}", "m"),
            ("excitation", None if self.excitation is None else
             f"{self.excitation.start_s:.4g} to {self.excitation.end_s:.4g}", "s")])

    def charts(self) -> Sequence[Chart]:
        """The acceleration over time."""
        return [Curves("Run", "time [s]", "acceleration [m/s2]", (line("sensor", self.time_s, self.accel_z_mps2),))]

    @property
    def track(self) -> Track | Excitation | None:
        """The road, or the excitation, as models read it."""
        if self.excitation is not None:
            return self.excitation
        return None if self.profile is None else drive_file.track_of(self.profile)


def read_run(path: Path | str) -> Run:
    """Read a folder with ``drive.csv`` and ``profile.csv`` (where the road is known) or, for a rig, ``excitation.csv``;
    or a ``drive.csv`` alone.

    Raises BadInput (``file:line: expected ..., found ...``) for a file that is missing or not what it should be.

    >>> read_run(folder).accel_z_mps2.shape
    (1115,)
    """
    place = Path(path)
    timed = place.is_dir() and drive_file.driven_by_time(place)
    drive = drive_file.drive_in(place, timed) if place.is_dir() else drive_file.read_drive(place)
    return Run(**vars(drive), profile=_profile_beside(place),
               excitation=drive_file.excitation_beside(drive) if timed else None)


def run_on_road(given: Run | Path | str, notify: Notify = silent) -> Run:
    """A run, or its folder, with the road that it was driven on, or its excitation; a free decay from where it is let
    go. BadInput for one without."""
    if not isinstance(given, Run) and not Path(given).is_dir():
        raise BadInput(f"{given}: expected a folder with {drive_file.DRIVE} and {drive_file.PROFILE} (or "
                       f"{drive_file.EXCITATION})")
    run = given if isinstance(given, Run) else read_run(given)
    if run.track is None:
        raise BadInput(f"{run.path}: expected a run with the profile that it was driven on, or its excitation "
                       f"({drive_file.PROFILE} or {drive_file.EXCITATION})")
    return _let_go(run, notify) if past_of(run.track) is Past.FREE else run


def _let_go(run: Run, notify: Notify) -> Run:
    """A free decay without the time in which it was held still before."""
    first = released_at(run.accel_z_mps2)
    if not first:
        return run
    later_s = first / run.rate_hz
    notify(f"{run.path}: held still for its first {later_s:.3g} s, which are left out")
    columns: dict[str, Any] = {name: one[first:] for name, one in vars(run).items() if isinstance(one, np.ndarray)}
    return replace(run, **columns, more={name: one[first:] for name, one in run.more.items()},
                   excitation=run.excitation and run.excitation.begun(later_s))


def _file_of(place: Path) -> Path:
    return place / drive_file.DRIVE if place.is_dir() else place


def _profile_beside(place: Path) -> Profile | None:
    profile = place / drive_file.PROFILE
    return read_profile(profile) if place.is_dir() and profile.exists() else None


def checked_run(run: drive_file.Drive | Path | str, asked: RecordRules) -> tuple[Run, EvenRecord]:
    """A run, or its file, judged and, where that was ``asked`` for, mended; and what was found.

    Raises BadInput as ``read_run``, and for what would give a wrong result.
    """
    if isinstance(run, drive_file.Drive):
        run = run if isinstance(run, Run) else Run(**vars(run))
        names = (*drive_file.COLUMNS, *drive_file.PLACE, drive_file.USABLE)
        arrays = (run.time_s, run.accel_z_mps2, run.speed_mps, run.distance_m, run.lat_deg, run.lon_deg, run.usable)
        columns = {name: one for name, one in zip(names, arrays, strict=True) if one is not None}
        place, profile, file = run.path, run.profile, str(_file_of(run.path))
    else:
        place = Path(run)
        (file, columns), profile = drive_file.read_columns(_file_of(place)), _profile_beside(place)
    found = even_columns(columns, file, asked)
    if found.resampled is None and asked.unit is None and isinstance(run, Run):
        return run, found
    even = {drive_file.TIME: np.array([found.start_s]), **found.accel_mps2, **found.others}
    drive = drive_file.drive_of(place, found.rate_hz, even)
    # What was laid on other times, or written in another unit, is on none of the steps that its facts say.
    as_written = found.resampled is None and asked.unit is None
    facts = facts_beside(place) if as_written else UNKNOWN
    return Run(**{**vars(drive), "facts": facts}, profile=profile), found


def write_run(folder: Path | str, run: Run) -> None:
    """Write a run as a folder with ``drive.csv`` (ten digits) and what else is known: ``profile.csv`` or, for a rig,
    ``excitation.csv``; and ``run.yaml``. OSError if that fails.

    >>> write_run(folder / "again", read_run(folder))
    """
    place = Path(folder)
    columns = {"t_s": run.time_s, run.facts.main.name: run.accel_z_mps2, "speed_mps": run.speed_mps,
               "distance_m": run.distance_m, "lat_deg": run.lat_deg, "lon_deg": run.lon_deg, "usable": run.usable,
               **run.more}
    away = (drive_file.SPEED, drive_file.DISTANCE) if run.excitation is not None else ()
    with together():
        make_folder(place)
        drive_file.write_drive(place / drive_file.DRIVE, {name: one for name, one in columns.items()
                                                          if one is not None and name not in away})
        forces = () if run.excitation is None else run.excitation.forces
        if run.facts != UNKNOWN or forces:
            write_run_facts(place, run.facts, forces)
        if run.excitation is not None:
            on_its_clock = run.excitation.begun(-float(run.time_s[0]))
            drive_file.write_excitation(place / drive_file.EXCITATION, on_its_clock)
        if run.profile is not None:
            write_profile(place / drive_file.PROFILE, run.profile)


def make_run(
    accel_z_mps2: npt.ArrayLike, speed_mps: npt.ArrayLike, *, rate_hz: float, distance_m: npt.ArrayLike | None = None,
    profile: Profile | None = None, name: str = "run",
) -> Run:
    """A run from arrays (n,); the first sample is at 0 s.

    accel_z_mps2   of the sensor, up positive, gravity removed [m/s2]
    speed_mps      (n,), or one for all samples [m/s]
    distance_m     where the front tires stand on the profile [m]; None: the integral of the speed, from 0 on
    name           other runs beside it need others

    Raises BadInput for arrays of different lengths, values that are not finite, or fewer than two samples.

    >>> run = make_run([0.0] * 500, 10.0, rate_hz=100.0)
    >>> round(float(run.distance_m[-1]), 6)
    49.9
    """
    accel = np.asarray(accel_z_mps2, dtype=np.float64)
    speed = np.broadcast_to(np.asarray(speed_mps, dtype=np.float64), accel.shape)
    driven = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) / rate_hz])
    distance = driven if distance_m is None else np.asarray(distance_m, dtype=np.float64)
    if not accel.ndim == 1 < len(accel) == len(distance) or not rate_hz > 0:
        raise BadInput(f"{name}: expected arrays of one length, two samples or more, and a rate above 0 Hz")
    if not all(np.isfinite(one).all() for one in (accel, speed, distance)):
        raise BadInput(f"{name}: expected finite values")
    return Run(Path(name), rate_hz, np.arange(len(accel)) / rate_hz, accel, speed, distance, None, None, profile)
