"""Questions about a record, a drive, a road or a car: comfort, estimate, calibrate, modes, simulate, iri, road and
learn-car.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union

from drivers.catalogue import names
from logger import question
from logger.api import shared_fields
from logger.errors import BadInput
from logger.question import IRI as IRI_RANGE
from logger.units import COMMON_SPEED_MPS, WINDOW_M

if TYPE_CHECKING:
    from logger.store.formats.drive_file import Drive
    from logger.store.formats.profile_file import Wheelpaths
    from logger.store.formats.record_checks import ChannelRecord
    from logger.store.formats.record_file import AccelerationRecord


_WEIGHTINGS = ", ".join(names("logger.dsp.weightings", "WEIGHTING"))


@dataclass(frozen=True)
class ComfortQuestion(question.Question):
    """Rate how a recorded ride feels and what it does to health: ISO 2631-1 values of an acceleration record.

      ridelog comfort seat.csv
      ridelog comfort seat.csv --daily-hours 4 --out ride.html

    FILE is CSV with the columns t_s and accel_z_mps2 (vertical, at the seat), evenly sampled at 80 Hz or more for 1 s
    or longer, optionally accel_x_mps2 and accel_y_mps2. comfort subtracts the mean. The weighting is the standard's
    formula, magnitude and phase, applied to the whole record by Fourier transform.

    comfort refuses a record with repeated samples, uneven times or values in g, and names the option that helps. It
    reports doubts on stderr: samples at an end of the sensor's range, accelerations that no moving car has.

    In Python: takes records and runs as well; raises BadInput for what is none of this, for what makes the values
    wrong (repeated samples, gravity in g), and as ``read_record``. What is doubtful is in ``doubts``, a line each.

    >>> found = comfort(read_run(folder))
    >>> found.comfort, round(found.a_w_mps2, 2)
    ('a_little_uncomfortable', 0.32)
    """

    record: Annotated[Union["AccelerationRecord", "Drive", Path, str], question.Argument(
        "CSV with t_s,accel_z_mps2[,accel_x_mps2,accel_y_mps2]", metavar="FILE", read=Path)]
    weighting: Annotated[str, question.Option(
        f"weighting of accel_z_mps2: one of {_WEIGHTINGS} (default: wk). With wk, accel_x_mps2 and accel_y_mps2 are "
        "weighted by wd and combined with it", metavar="NAME")] = "wk"
    _: KW_ONLY
    daily_hours: Annotated[float | None, question.Option(
        "hours a day of such riding, for the health values (default: the length of the record)", question.DAILY_HOURS,
        "H")] = None
    unit: shared_fields.Unit = None
    resample_hz: shared_fields.ResampleHz = None


@dataclass(frozen=True)
class EstimateQuestion(question.LongQuestion):
    """Estimate the road from a drive's acceleration: IRI of windows with standard errors, and the road's profile.

    RUN is a folder with a drive.csv (t_s,accel_z_mps2,speed_mps,distance_m), or such a file. Where a profile.csv lies
    in the folder, estimate compares with its exact IRI. Beside the estimates it prints the limit: the accuracy of an
    estimator that knows the road's spectrum, the sensor's noise and the car exactly.

      ridelog estimate run --vehicle rav4-2009
      ridelog estimate drive.csv --vehicle mycar.yaml --step 0.613 --profile-out road.csv

    GPS corrections may make the distance step back by up to 1 m: estimate then takes the integral of speed_mps, plus
    the correction smoothed over 2 s. It resamples other rates to 100 Hz. It refuses repeated samples, uneven times and
    values in g, and names the option that helps.

    The profile holds only the wavelengths that the readings resolve: it is smoother than the road, and its IRI is too
    low. A drive with gaps makes several: P.csv, P-2.csv, P-3.csv. R2 depends on the range of IRI: estimate gives the
    limit's R2 for an even mix of roads (IRI 1 to 10 m/km), and for a road as rough as this one.

    In Python: raises BadInput for a drive that cannot be used, or of another road than its profile's, what makes the
    result wrong (repeated samples, gravity in g), and as ``read_run`` and ``read_vehicle``. Source: a smoother of the
    road's state as ISO 8608 lets expect it (``logger.estimation``).

    >>> found = estimate(folder, "rav4-2009", noise_mps2=0.05)
    >>> found.iri_m_per_km.shape == found.iri_exact_m_per_km.shape == (len(found.flags),)
    True
    """

    run: Annotated[Union["Drive", Path, str], question.Argument("folder with drive.csv, or a drive.csv", metavar="RUN",
                                                                read=Path)]
    vehicle: Annotated[shared_fields.Vehicle, question.Option(
        "a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name), which also says where the "
        "sensor sits; in Python a model as well", metavar="NAME|FILE", read=str)]
    _: KW_ONLY
    noise_mps2: Annotated[float | Literal["auto"] | None, question.Option(
        f"r.m.s. noise of one reading before rounding, {question.READING_NOISE.words}; auto: learned from the drive, "
        "with a standard error (default: what the run's run.yaml says, or auto)", metavar="auto|MPS2",
        read=question.word_or_number(question.AUTO, question.READING_NOISE),
        check=question.check_word_or_number(question.AUTO, question.READING_NOISE))] = None
    step_mps2: Annotated[float | None, question.Option(
        "quantisation step of the readings [m/s2], 0: none (default: what the run's run.yaml says)", question.ADDED,
        "MPS2")] = None
    window_m: Annotated[float, question.Option(
        "length of a window [m] (default: 7.62, 25 ft)", question.WINDOW, "M")] = WINDOW_M
    unit: shared_fields.Unit = None
    resample_hz: shared_fields.ResampleHz = None
    anyway: shared_fields.Anyway = False

    def files_read(self) -> Sequence[Path]:
        from logger.store.formats.drive_file import DRIVE, PROFILE

        given = super().files_read()
        beside = [run / name for run in given for name in (DRIVE, PROFILE)]
        return [*given, *beside, *shared_fields.files_of(self.vehicle)]

    def check_written(self, files: Mapping[str, Sequence[Path]]) -> None:
        for profile in files.get("--profile-out", ()):
            written = [path for given in files.values() for path in given]
            taken = {path.resolve() for path in (*self.files_read(), *written)}
            part = re.compile(rf"{re.escape(profile.stem)}-[1-9][0-9]*{re.escape(profile.suffix)}")
            folder = profile.parent.resolve()
            beside = {path for path in taken if path.parent == folder} | {*(
                folder.iterdir() if folder.is_dir() else ())}
            if clash := [path for path in beside if part.fullmatch(path.name) and path.resolve() in taken]:
                raise BadInput(f"--profile-out {profile}: expected another name: its parts could overwrite {clash[0]}")


@dataclass(frozen=True)
class CalibrateQuestion(question.LongQuestion):
    """Compute how much a vehicle shakes on known roads: IRI and Gd(n0) per r.m.s. acceleration, comfort per IRI.

    The vehicle's model drives over random roads of IRI 1 to 10 m/km at 10 to 70 mph: one line per speed, with
    the scatter between roads. The result is cached beside the vehicle's file (NAME.calibration.json) or in the user's
    cache, unless the file has an effect of your own.

      ridelog calibrate --vehicle rav4-2009
      ridelog calibrate --vehicle mycar.yaml --out mycar.csv

    In Python: raises BadInput for numbers out of range, and as ``read_vehicle``. What is found of a model is not kept.
    Source: Blum 2015, section 6.3 (Fig 6.3 to 6.8, 6.16, 6.17).

    >>> found = calibrate(car)
    >>> found.iri_per_accel_rms.slope.round(1).tolist()
    [27.9, 18.2, 13.3, 10.9, 9.5, 7.9, 7.1]
    """

    vehicle: shared_fields.VehicleName
    _: KW_ONLY
    window_m: Annotated[float, question.InPython("length of a window [m], 2 to 200 (default: 7.62, 25 ft)")] = WINDOW_M

    stays: ClassVar[bool] = True

    def files_read(self) -> Sequence[Path]:
        return shared_fields.files_of(self.vehicle)


def _columns(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _check_method(method: str) -> None:
    if method in question.MODAL_METHODS_GONE:
        beside = " with `input_column`" if "x" in method else ""
        raise ValueError("no longer offered, because it missed or invented modes: expected `method` "
                         f"{question.MODAL_METHODS_GONE[method]}{beside}")


@dataclass(frozen=True)
class ModesQuestion(question.Question):
    """Find natural frequencies, damping ratios and mode shapes of a vibration record, each with its standard deviation.

    FILE is CSV with t_s and one column per sensor, evenly sampled: a free decay (push, let go, record) or the response
    to random forces; --input names a column with the force or motion that drives it. You need not pick poles: modes
    chooses the order and the modes by rule, and lists what it rejects, with the reason.

      ridelog modes push.csv --method era
      ridelog modes drive.csv --vehicle mycar.yaml
      ridelog modes --vehicle mycar.yaml --speed 20

    A drive needs the vehicle: the road, and the second axle that follows the first, add peaks to its spectrum that
    are not modes. modes fits its springs, dampers and masses to the spectrum and gives the modes of the fitted car;
    wheelbase, contact patch and the sensor's position stay as in its file. A record without speed_mps needs --speed.

    With --vehicle and no FILE, modes gives those of the vehicle's file with its effects, and standard deviations from
    the standard errors in the file. It linearises nonlinear forces at a speed, on a road of IRI 2.5 m/km.

    In Python: the record has 100 samples or more; modes of a vehicle alone have no channels. Raises BadInput for what
    does not fit together, a record that is too short for it, and as ``read_channels``. Source: P. van Overschee and
    B. de Moor, Subspace Identification (1996); each method's own module below ``logger.modal``.

    >>> t_s = np.arange(1000) / 100
    >>> top = np.exp(-0.02 * 2 * np.pi * 1.5 * t_s) * np.cos(2 * np.pi * 1.5 * t_s)
    >>> noise = 0.01 * np.random.default_rng(1).standard_normal(1000)
    >>> found = modes(make_channels({"top": top + noise}, rate_hz=100.0), "era")
    >>> found.frequency_hz.round(2).tolist(), found.damping_ratio.round(3).tolist()
    ([1.5], [0.02])
    """

    record: Annotated[Union["ChannelRecord", Path, str, None], question.Argument(
        "CSV with t_s and one column per sensor", metavar="FILE", read=Path)] = None
    method: Annotated[str | None, question.Option(
        f"{', '.join(question.MODAL_METHODS)}: era for a free decay, ssi for a random response, n4sid with a measured "
        "input (default: chosen from the record); decrement is Eq 5.2 of Blum 2015, for one mode of a free decay; not "
        "with a vehicle", metavar="NAME", choices=question.MODAL_METHODS, check=_check_method)] = None
    _: KW_ONLY
    columns: Annotated[Sequence[str] | None, question.Option(
        "columns of the sensors (default: all but t_s, the input, and a drive's speed, distance and position)",
        metavar="A,B,...", read=_columns)] = None
    input_column: Annotated[str | None, question.Option(
        "column of the measured input", metavar="COLUMN", flag="--input")] = None
    from_s: Annotated[float | None, question.Option("start of the part to analyse, as t_s [s]", metavar="S")] = None
    to_s: Annotated[float | None, question.Option("end of that part, as t_s [s]", metavar="S")] = None
    vehicle: Annotated[shared_fields.Vehicle | None, question.Option(
        "the modes of a vehicle's file; with a FILE, the vehicle that was driven", metavar="NAME|FILE",
        read=str)] = None
    speed_mps: Annotated[float | None, question.Option(
        f"without a FILE: speed at which nonlinear forces are linearised (default: {COMMON_SPEED_MPS:g}); with a "
        "FILE that has no speed: speed of the drive", question.SPEED, "MPS")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.record is None and self.vehicle is None:
            raise self.complaint("modes: expected a FILE (try 'ridelog modes --help')")
        if self.record is None:
            of_files = ("method", "columns", "input_column", "from_s", "to_s")
            if given := [one for one in of_files if getattr(self, one) is not None]:
                raise self.wrong(given[0], f": expected a FILE with it, not `vehicle` {self.vehicle}")

    def check_written(self, files: Mapping[str, Sequence[Path]]) -> None:
        """Pictures are of a record alone."""
        if self.record is None and any(files.values()):
            raise self.complaint("--out: expected a FILE with it")


COMFORT = question.Verb(ComfortQuestion, "logger.api.rides:comfort", (question.PICTURES,))
CALIBRATE = question.Verb(CalibrateQuestion, "logger.api.calibration:calibrate", (
    question.Out("write the figures of each speed as CSV", metavar="FILE", others=("*",), many=False, is_drawn=False),))
ESTIMATE = question.Verb(EstimateQuestion, "logger.api.drives:estimate", (
    question.Out("write the windows as CSV; FILE.html, .png, .svg or .pdf: pictures; may repeat", metavar="FILE",
                 others=("*",)),
    question.Out("write the estimated profile as CSV", "--profile-out", "FILE", ("*",), many=False, is_drawn=False)))
MODES = question.Verb(ModesQuestion, "logger.api.modal:modes", (question.PICTURES,))


_OBSTACLES = ("add an obstacle to the road [m]; may repeat. bump (Eq 4.41 of Blum 2015): start_m, height_m, width_m; "
              "step: start_m, height_m; ramp: start_m, height_m, length_m; plate: start_m, height_m, length_m[, "
              "edge_m]; pothole: start_m, depth_m, length_m[, edge_m]. "
              'In Python: {"bump": {"start_m": 20, "height_m": 0.08, "width_m": 3.6}}')


_FLAT = question.Range(1.0, 10_000.0, "m")


def _file_or(unit: str) -> Callable[[str], float | Path]:
    """A reader of a number in a unit, or of a file's name."""
    def read(text: str) -> float | Path:
        try:
            return float(text)
        except ValueError:
            if text[:1].isdigit() and not Path(text).exists():
                raise ValueError(f"expected a number in {unit}, without its unit, or a file") from None
            return Path(text)

    return read


@dataclass(frozen=True)
class SimulateQuestion(question.Question):
    """Simulate a drive: what a vehicle's accelerometer would record on a road.

      ridelog simulate --vehicle rav4-2009 --profile road.csv --speed 20 --out drive.csv
      ridelog simulate --vehicle rav4-2009 --profile road.csv --speed 20 --effect wheel_lift \\
          --effect tire_damping:tire_damping_n_s_per_m=200 --out drive.csv
      ridelog simulate --vehicle rav4-2009 --profile 60 --obstacle bump:start_m=20,height_m=0.08,width_m=3.6 \\
          --speed 5 --out run/drive.csv --out run/profile.csv
      ridelog simulate --vehicle ./rig.yaml --excitation run/excitation.csv --rate 500 --out run/drive.csv

    The drive is CSV: t_s,accel_z_mps2,speed_mps,distance_m, then what --output asks for. It starts with the front tires
    at the start of the profile, after a flat road, and ends a second after the last wheel has left it. It is sampled
    behind an anti-alias filter that is flat up to 0.38 of the sample rate. A folder that holds a drive.csv and
    the profile.csv it was driven on is a run. A rig that is driven by time (--excitation) has no speed and no distance;
    its drive.csv lasts as long as the excitation.csv beside it.

    Physical effects are those of the vehicle's file, then those of --effect; docs/reference/effects.md lists them. The
    speed asked for is the true one: with speed_scale the recorded speed differs.

    In Python: a run; speeds may also be times (k,) [s], growing, and speeds (k,) [m/s]. Raises BadInput for what no car
    can do, obstacles that do not lie on the road, and as ``read_vehicle`` and ``read_profile``.

    >>> run = simulate("rav4-2009", random_road(iso_class="B", length_m=100.0), speed_mps=10.0)
    >>> run.accel_z_mps2.shape, round(float(run.accel_z_mps2.std()), 2)
    ((1130,), 0.27)
    >>> braking = simulate("rav4-2009", run.profile, ([0.0, 5.0, 10.0], [12.0, 12.0, 0.0]))
    >>> round(float(braking.distance_m[-1]), 2)
    90.0
    """

    vehicle: shared_fields.VehicleName
    profile: Annotated[Union["Wheelpaths", Path, str, float, None], question.Option(
        f"CSV (distance_m,elevation_m[,elevation_right_m]) or ERD; of two tracks a full car uses both, other cars the "
        f"left one. A number: a flat road of this length, {_FLAT.words}", metavar="FILE|M", read=_file_or("m"))] = None
    speed_mps: Annotated[float | tuple[Any, Any] | Path | None, question.Option(
        f"constant, {question.SPEED.words}; or a CSV with t_s,speed_mps, interpolated linearly: the drive lasts as "
        "long as the file", metavar="MPS|FILE", read=_file_or("m/s"))] = None
    _: KW_ONLY
    obstacles: Annotated[Mapping[str, Mapping[str, float]] | Sequence[str] | None, question.Option(
        _OBSTACLES, metavar="NAME:PARAM=VALUE,...", read=str, many=list, flag="--obstacle")] = None
    rate_hz: Annotated[float, question.Option("samples a second", question.RATE, "HZ")] = 100.0
    noise_mps2: Annotated[float, question.Option("r.m.s. of the sensor's noise [m/s2]", question.ADDED, "MPS2")] = 0.0
    step_mps2: Annotated[float, question.Option("quantisation step of the sensor [m/s2]", question.ADDED, "MPS2")] = 0.0
    seed: Annotated[int, question.Option("seed of the noise (default: 1)", question.Range(0, float("inf")), "N")] = 1
    name: Annotated[str, "of the run; each of several needs its own"] = "simulated"
    excitation: Annotated[Path | None, question.Option(
        "for a test rig, in place of --profile and --speed: what drives it over time, as CSV (t_s and any of "
        "elevation_m, elevation_rear_m and forces, which a run.yaml beside it places)", metavar="FILE",
        read=Path)] = None
    effects: Annotated[Sequence[str], question.Option(
        "a physical effect, or the path of a Python file with one of your own; may repeat. Parameters that you do not "
        "give have their usual values. It replaces the vehicle's own effect of that "
        "name", metavar="NAME[:PARAM=VALUE,...]", read=str, many=list, flag="--effect")] = ()
    outputs: Annotated[Sequence[str], question.Option(
        "further columns; may repeat. wheels: their acceleration; travel: extension of the suspensions; tires: height "
        "of the wheels over the road; body:ahead_m=X,left_m=Y: acceleration of another point of the body, from the "
        "centre of gravity", metavar="WHAT", read=str, many=list, flag="--output")] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        given = {one: getattr(self, one) for one in ("profile", "speed_mps", "obstacles")}
        if self.excitation is not None and (beside := [one for one, value in given.items() if value not in (None, [])]):
            raise self.wrong(beside[0], ": expected none with `excitation`, as a rig has no road")
        if self.excitation is None and (missing := [one for one in ("profile", "speed_mps") if given[one] is None]):
            raise self.complaint(f"simulate: expected {', '.join(f'`{one}`' for one in missing)}")
        for name, within in (("profile", _FLAT), ("speed_mps", question.SPEED)):
            value = getattr(self, name)
            if isinstance(value, int | float) and (words := within.fault(value)):
                raise self.wrong(name, words)

    def named(self) -> str:
        return str(self.excitation or self.profile)

    def files_read(self) -> Sequence[Path]:
        given = (self.profile, self.excitation, self.speed_mps)
        return [*(one for one in given if isinstance(one, Path)), *shared_fields.files_of(self.vehicle)]


SIMULATE = question.Verb(SimulateQuestion, "logger.api.drives:simulation", (
    question.Out("drive to write; a file called profile.csv: the road that was driven, with its obstacles. Both in one "
                 "folder form a run. FILE.html, .png, .svg or .pdf: pictures; may repeat", metavar="FILE",
                 others=("*",), required=True),))


ProfileFile = Annotated[Union["Wheelpaths", Path, str], question.Argument(
    "CSV or ERD file", metavar="PROFILE", read=Path)]


@dataclass(frozen=True)
class ProfileQuestion(question.Question):
    """One about a ``profile``, or its file."""

    profile: ProfileFile


@dataclass(frozen=True)
class IriQuestion(ProfileQuestion):
    """Compute the exact IRI of a measured profile (ASTM E1926; Sayers, TRR 1501, 1995), whole and window by window.

      ridelog iri road.csv --window 0.1mi
      ridelog iri road.csv --localized 2.5 --out iri.html

    PROFILE is CSV (distance_m,elevation_m[,elevation_right_m]; other units by name: distance_ft,elevation_in) or ERD,
    evenly spaced by 300 mm or less and at least 11 m long. With two wheelpaths: the IRI of each, their mean (MRI) and
    that of the half car on both (HRI).

    In Python: raises BadInput for a profile or a window of which there is no IRI, and as ``read_profile``.

    >>> found = iri(random_road(iso_class="B", length_m=400.0, seed=3))
    >>> round(found.iri_m_per_km, 2), found.windows_m_per_km.round(2).tolist()
    (4.44, [4.3, 4.69, 4.44, 4.32])
    """

    window_m: Annotated[float, question.Option(
        "length of a window [m], or with its unit, such as 0.1mi or 25ft (default: 100, as road agencies report)",
        metavar="M")] = 100.0
    resample_m: shared_fields.ResampleM = None
    localized_m_per_km: shared_fields.Localized = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.window_m > 0:
            raise self.wrong("window_m", f" {self.window_m:g}: expected a length above 0 m")


@dataclass(frozen=True)
class ClassifyQuestion(ProfileQuestion):
    """Classify a profile of at least 100 m by ISO 8608: class, degree of roughness and waviness.

      ridelog road classify road.csv
      ridelog road classify road.csv --out road.html

    In Python: raises BadInput for one that is too short or too odd, and as ``read_profile``.

    >>> found = classify(random_road(iso_class="C", length_m=500.0))
    >>> found.road_class, abs(found.waviness - 2.0) < 3 * found.waviness_std
    ('C', True)
    """

    resample_m: shared_fields.ResampleM = None


@dataclass(frozen=True, kw_only=True)
class RandomRoadQuestion(question.Question):
    """Make a random road with the spectrum of ISO 8608: Gd(n) = Gd(n0) (n / n0)^-w (Eq 4.1, 4.2 of Blum 2015).
    The same options give the same road.

      ridelog road generate --class B --length 1000 --out road.csv
      ridelog road generate --iri 2.5 --seed 7 --out smooth.csv

    In Python: raises BadInput for what is none of this.

    >>> random_road(iso_class="B", length_m=20.0)
    Profile
      length                               20  m
      begins at                             0  m
      spacing                            0.05  m
      samples                             401
      wheelpaths                            1
      elevation, standard deviation  0.005887  m
    """

    iso_class: Annotated[str | None, question.Option(
        "class of ISO 8608: the road has the geometric mean of its limits of Gd(n0)", metavar="A-H", read=str.upper,
        choices="ABCDEFGH", flag="--class")] = None
    gd_n0_cm3: Annotated[float | None, question.InPython(
        "degree of roughness Gd(n0), n0 = 0.1 cycles per metre [cm3]", question.ROUGHNESS)] = None
    iri_m_per_km: Annotated[float | None, question.Option(
        "IRI; Gd(n0) follows from Eq 4.40", IRI_RANGE, "M_PER_KM")] = None
    length_m: Annotated[float, question.Option("length of the road [m]", question.LENGTH, "M")] = 1000.0
    spacing_m: Annotated[float, question.InPython("between samples [m]", question.SPACING)] = 0.05
    seed: Annotated[int, question.Option(
        "seed of the random road (default: 1)", question.Range(0, float("inf")), "N")] = 1
    waviness: Annotated[float, question.InPython("w, the slope of the spectrum", question.ROAD_WAVINESS)] = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(one is not None for one in (self.iso_class, self.gd_n0_cm3, self.iri_m_per_km)) != 1:
            raise self.complaint("expected one of `iso_class` and `iri_m_per_km`")
        both = f"`length_m` {self.length_m:g} `spacing_m` {self.spacing_m:g}: expected"
        if self.length_m / self.spacing_m > question.MOST_ROAD_SAMPLES:
            raise self.complaint(f"{both} at most {question.MOST_ROAD_SAMPLES} samples")
        last_m = int(self.length_m / self.spacing_m + 1e-9) * self.spacing_m
        if last_m < question.LENGTH.low:
            raise self.complaint(f"{both} the last sample at {question.LENGTH.low:g} m or more, it lies at {last_m:g} "
                                 "m")


EXACT_IRI = question.Verb(IriQuestion, "logger.api.roads:iri", (question.PICTURES,))
CLASSIFY = question.Verb(ClassifyQuestion, "logger.api.roads:classify", (question.PICTURES,))
GENERATE = question.Verb(RandomRoadQuestion, "logger.api.roads:random_road")


# --- learn-car ---


def _ahead(text: str) -> float:
    name, _, value = text.partition("=")
    try:
        ahead_m = float(value)
    except ValueError:
        ahead_m = float("nan")
    if name.strip() != "ahead_m" or not abs(ahead_m) <= question.WHEELBASE.high:
        raise ValueError(f"expected ahead_m=METRES, from -{question.WHEELBASE.high:g} to {question.WHEELBASE.high:g}")
    return ahead_m


@dataclass(frozen=True)
class LearnCarQuestion(question.LongQuestion):
    """Learn a car that nobody has measured, from ordinary drives over roads that nobody has measured.

    Each DRIVE is a folder of logs (the sidecars keep what is needed), a dump of the box (.dump, .dump.gz), a run's
    folder or its drive.csv (t_s,accel_z_mps2,speed_mps), or a phone's recording as ridelog extract reads it. Twenty
    minutes are enough, with some at 30, 60 and 90 km/h; town helps. Measure the wheelbase, or read it off the car's
    data sheet.

      ridelog learn-car /var/lib/ridelog --wheelbase 2.66 --out mycar.yaml
      ridelog learn-car run1 run2 --wheelbase 2.66 --mass 1450 --sensor ahead_m=0.3 --out mycar.yaml

    It starts from the average of published cars and finds the natural frequencies and damping ratios of body and
    wheels, together with the level and waviness of each road. It holds out each drive in turn to show the error on a
    new drive; the file comes from all drives. Drives show only the ratios of masses, springs and dampers, and the IRI
    needs no more: without --mass a typical mass is assumed. learn-car refuses what does not fit (exit status 1): a
    wrong wheelbase, drives of two cars, readings of another axis. It names a worn damper, friction and a trailer.

    In Python: raises BadInput for drives that cannot be read or are too short, CheckFailed for those that fit no car.
    """

    drives: Annotated[shared_fields.Runs, question.Argument(
        "folder of logs, dump, run's folder, drive.csv or recording of a phone", metavar="DRIVE", read=Path,
        many=list)]
    wheelbase_m: Annotated[float, question.Option("distance between the axles [m]", question.WHEELBASE, "M")]
    _: KW_ONLY
    mass_kg: Annotated[float | None, question.Option(
        "mass of the whole car as driven [kg] (default: a typical one, as the IRI does not need it)", question.CAR_MASS,
        "KG")] = None
    sensor: Annotated[float | None, question.Option(
        "ahead_m=M: how far the sensor sits ahead (+) of the car's middle, to 0.2 m (default: near its centre of "
        "gravity)", metavar="ahead_m=M", read=_ahead)] = None
    compare: Annotated[Path | None, question.Option(
        "an earlier vehicle file of this car: report what has changed", metavar="FILE.yaml", read=Path)] = None


LEARN_CAR = question.Verb(LearnCarQuestion, "logger.api.learn_car:learn_car", (
    question.Out("write the vehicle's file; FILE.html, .png, .svg or .pdf: measured and modelled spectra by speed, "
                 "before and after; may repeat", metavar="mycar.yaml", others=(".yaml", ".yml")),))
