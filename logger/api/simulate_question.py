"""What ``ridelog simulate`` is asked."""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

from logger.api.question import Option, Out, Question, Verb
from logger.api.ranges import ADDED, RATE, SPEED, Range
from logger.api.terms import Vehicle, VehicleName

if TYPE_CHECKING:
    from logger.store.formats.profile_file import Profile

_OBSTACLES = ("add one to the road [m]; may repeat. bump (Eq 4.41 of Blum 2015): start_m, height_m, width_m; step: "
              "start_m, height_m; ramp: and length_m; plate: start_m, height_m, length_m[, edge_m]; pothole: start_m, "
              'depth_m, length_m[, edge_m]. In Python: {"bump": {"start_m": 20, "height_m": 0.08, "width_m": 3.6}}')


@dataclass(frozen=True)
class SimulateQuestion(Question):
    """What a vehicle's accelerometer would record on a road: a drive, simulated.

      ridelog simulate --vehicle rav4-2009 --profile road.csv --speed 20 --out drive.csv
      ridelog simulate --vehicle rav4-2009 --profile road.csv --speed 20 --effect wheel_lift \\
          --effect tire_damping:tire_damping_n_s_per_m=200 --out drive.csv
      ridelog simulate --vehicle rav4-2009 --flat 60 --obstacle bump:start_m=20,height_m=0.08,width_m=3.6 --speed 5 \\
          --out run/drive.csv --profile-out run/profile.csv
      ridelog simulate --vehicle ./rig.yaml --excitation run/excitation.csv --rate 500 --out run/drive.csv

    The drive is CSV: t_s,accel_z_mps2,speed_mps,distance_m, then what --output asks for. It starts with the front tires
    at the start of the profile, after a flat road, ends a second after the last wheel has left it, and is sampled as a
    recorder does it, behind a filter that is flat up to 0.38 of the sample rate. A folder that holds a drive.csv and
    the profile.csv it was driven on is a run. A rig that is driven by time (--excitation) has no speed and no distance;
    its drive.csv lasts as long as the excitation.csv beside it.

    Physical effects are those of the vehicle's file, then those of --effect; --list-effects lists them. The speed
    asked for is the true one: with speed_scale the drive's own columns say something else.

    In Python: a run. Raises BadInput for what no car can do, obstacles that do not lie on the road, and as
    ``read_vehicle`` and ``read_profile``.

    >>> run = simulate("rav4-2009", random_road(iso_class="B", length_m=100.0), speed_mps=10.0)
    >>> run.accel_z_mps2.shape, round(float(run.accel_z_mps2.std()), 2)
    ((1130,), 0.27)
    >>> braking = simulate("rav4-2009", run.profile, ([0.0, 5.0, 10.0], [12.0, 12.0, 0.0]))
    >>> round(float(braking.distance_m[-1]), 2)
    90.0
    """

    vehicle: VehicleName
    profile: Annotated[Union["Profile", Path, str], "the road [m]; of two tracks a full car uses both, others the left"]
    speed_mps: Annotated[float | tuple[Any, Any], "the same all the way, 0.1 to 100 m/s; or times (k,) [s], growing, "
                                                  "and speeds (k,) [m/s] with straight lines between them"]
    _: KW_ONLY
    obstacles: Annotated[Mapping[str, Mapping[str, float]] | Sequence[str] | None, Option(
        _OBSTACLES, metavar="NAME:PARAM=VALUE,...", read=str, many=list, flag="--obstacle")] = None
    rate_hz: Annotated[float, Option("samples a second", RATE, "HZ")] = 100.0
    noise_mps2: Annotated[float, Option("r.m.s. of the sensor's noise [m/s2]", ADDED, "MPS2")] = 0.0
    step_mps2: Annotated[float, Option("the sensor gives whole multiples of this only [m/s2]", ADDED, "MPS2")] = 0.0
    seed: Annotated[int, Option("another number, another noise (default: 1)", Range(0, float("inf")), "N")] = 1
    name: Annotated[str, "of the run; each of several needs its own"] = "simulated"

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.speed_mps, int | float) and (words := SPEED.fault(self.speed_mps)):
            raise self.wrong("speed_mps", words)


@dataclass(frozen=True)
class SimulateCommand(SimulateQuestion):
    """At the terminal files stand for roads, and more can be asked for."""

    vehicle: Annotated[Vehicle | None, Option(
        "a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)", metavar="NAME|FILE",
        read=str)] = None  # type: ignore[assignment]
    profile: Annotated[Path | None, Option(
        "CSV (distance_m,elevation_m[,elevation_right_m]) or ERD; of two tracks a full car uses both, other cars the "
        "left one", metavar="FILE", read=Path)] = None  # type: ignore[assignment]
    speed_mps: Annotated[float | None, Option(
        "the same all the way [m/s]", SPEED, "MPS")] = None  # type: ignore[assignment]
    _: KW_ONLY
    excitation: Annotated[Path | None, Option(
        "what stands under the wheels of a rig over time instead: CSV (t_s,elevation_m[,elevation_rear_m]); without "
        "--speed", metavar="FILE", read=Path)] = None
    flat_m: Annotated[float | None, Option(
        "a flat road of this length instead [m]", Range(1.0, 10_000.0, "m"), "M")] = None
    speed_file: Annotated[Path | None, Option(
        "CSV with t_s,speed_mps, straight lines between them; the drive lasts as long as the file", metavar="FILE",
        read=Path)] = None
    effects: Annotated[Sequence[str], Option(
        "a physical effect, or the path of a Python file with one of your own; may repeat. What is not said is at its "
        "usual value; takes the place of the vehicle's own effect of that name", metavar="NAME[:PARAM=VALUE,...]",
        read=str, many=list, flag="--effect")] = ()
    outputs: Annotated[Sequence[str], Option(
        "further columns; may repeat. wheels: their acceleration; travel: extension of the suspensions; tires: height "
        "of the wheels over the road; body:ahead_m=X,left_m=Y: acceleration of another point of the body, from the "
        "centre of gravity", metavar="WHAT", read=str, many=list, flag="--output")] = ()
    list_effects: Annotated[bool, Option(
        "print the effects there are, with their parameters, and do nothing else")] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        for ones in (("profile", "excitation", "flat_m"), ("speed_mps", "speed_file")):
            if len(given := [one for one in ones if getattr(self, one) is not None]) > 1:
                raise self.wrong(given[1], f": expected no `{given[0]}` with it")
        beside = [one for one in ("speed_mps", "speed_file", "obstacles") if getattr(self, one) not in (None, [])]
        if self.excitation is not None and beside:
            raise self.wrong(beside[0], ": expected none of it with `excitation`: a rig stands, and has no road")


SIMULATE = Verb(SimulateCommand, "", (
    Out("drive to write; DIR/drive.csv beside DIR/profile.csv makes a run. FILE.html, .png, .svg or .pdf: pictures; "
        "may repeat", metavar="FILE", others=("*",)),
    Out("write the road that was driven as well, with its obstacles", "--profile-out", "FILE", ("*",), many=False,
        is_drawn=False)))
