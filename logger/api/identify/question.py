"""What ``ridelog identify`` is asked."""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from logger import question
from logger.api import shared_fields

MEASURED, UNMEASURED, SAME = "measured", "unmeasured", "same"


def _obstacle(text: str) -> tuple[str, dict[str, float]]:
    return shared_fields.named_numbers(text, "--obstacle")


@dataclass(frozen=True)
class IdentifyQuestion(question.LongQuestion):
    """Fit vehicle parameters to drives over known roads: a grey-box prediction-error fit.

    Each RUN is a drive.csv, or a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it
    was driven on, or, of a rig, with drive.csv (t_s,accel_z_mps2) and the excitation.csv
    (t_s,elevation_m[,elevation_rear_m]) that drove it. --free names parameters as in the vehicle's file; both.NAME
    means front and rear axle together. Without --free, identify fits what the file calls unknown or gives as 2.45 +-
    2%.

      ridelog identify run --vehicle rav4-2009 --free sprung_mass_kg
      ridelog identify run1 run2 run3 --vehicle mycar.yaml --free sprung_mass_kg,both.suspension_damping_n_s_per_m \\
          --out fitted.yaml

    A fit starts at the values of the vehicle's file and stays within a factor of 20 of them (3 for lengths), or within
    the range that the file gives, as [700, 1000].

    To free a parameter of an effect in the vehicle's file, put the effect's name before it:

      ridelog identify run --vehicle mycar.yaml --free sprung_mass_kg,dry_friction.friction_force_n

    Parameters of the road can be free as well: those of a bump (Eq 4.41 of Blum 2015) or a step, and the scale of the
    recorded speed. A run then needs no profile.csv; the road is flat but for the obstacle, and identify searches for
    its start if you give none. run2.NAME is the parameter of one run, each.NAME a separate one for every run.

      ridelog identify drive.csv --vehicle rav4-2009 --obstacle bump:height_m=0.15,width_m=2.6 --free bump.height_m
      ridelog identify drive.csv --vehicle rav4-2009 --obstacle step:start_m=50,height_m=-0.03 \\
          --free step.height_m,speed_scale

    With no profile at all, --unmeasured-road assumes a random road of ISO 8608, of unknown roughness and of waviness 2
    (fitted if you free road.waviness). Drives over one road at different speeds tell far more (--same-road).

      ridelog identify drive.csv --vehicle rav4-2009 --unmeasured-road --free sprung_mass_kg
      ridelog identify slow.csv fast.csv --vehicle mycar.yaml --same-road --free sprung_mass_kg,both.unsprung_mass_kg

    Every estimate comes with its standard error. identify refuses what the runs do not determine (exit status 1):
    parameters that the sensor does not feel, and parameters of which only a combination can be estimated. Masses,
    springs and dampers share one scale, so one of them has to be known.

    In Python: raises BadInput for what does not fit together, ``NotIdentifiable`` for numbers that the runs do not
    determine. Source: L. Ljung, System Identification (1999), chapters 7 and 9.

    >>> true = car.with_numbers({"sprung_mass_kg": 900.0})
    >>> drive = simulate(true, random_road(iso_class="C", length_m=150.0), 12.0, noise_mps2=0.03)
    >>> found = identify(car, drive, ["sprung_mass_kg"])
    >>> abs(found.parameters["sprung_mass_kg"] - 900.0) < 4 * found.standard_errors["sprung_mass_kg"], found.converged
    (True, True)
    """

    vehicle: shared_fields.VehicleName
    runs: Annotated[shared_fields.Runs, question.Argument(
        "folder with drive.csv and profile.csv (of a rig: excitation.csv), or a drive.csv; all with the same sample "
        "rate",
        metavar="RUN", read=Path, many=list)]
    free: Annotated[Sequence[str] | None, question.Option(
        "parameters to fit: names as in the vehicle's file, dry_friction.friction_force_n of an effect, bump.height_m, "
        "step.start_m, speed_scale or road.waviness of the road (default: what the vehicle's file gives as unknown or "
        "with a tolerance, which is its prior, and its effects)", metavar="PARAM,...",
        read=shared_fields.names_of)] = None
    _: KW_ONLY
    obstacles: Annotated[Mapping[str, Mapping[str, float]] | None, question.Option(
        "what lies on the road [m]; may repeat. bump: height_m, width_m; step, up or with a negative height down: "
        "height_m. Without start_m, identify searches for it; --free takes its parameters as bump.height_m. In "
        "Python: "
        '{"bump": {"height_m": 0.1, "width_m": 3.0}}', metavar="NAME:PARAM=VALUE,...", read=_obstacle, many=dict,
        flag="--obstacle")] = None
    noise: Annotated[str, question.Option(
        "model of the residual: white (output error), ar (innovations form), road (roughness that the profile does "
        "not contain, through the car); auto: the likeliest", choices=question.NOISE_MODELS)] = "auto"
    low_pass_hz: shared_fields.LowPass = None
    tries: Annotated[int, question.InPython("number of additional starting points", question.TRIES)] = 0
    road: Annotated[str, question.Switches(
        "measured: with its profile; unmeasured: each run over a road of its own, of this waviness; same: all over "
        "one", choices=(MEASURED, UNMEASURED, SAME), by_value={
            UNMEASURED: ("unmeasured-road", "the roads were not measured; each run has one of its own"),
            SAME: ("same-road", "the road was not measured; all runs are over the same one; their positions may be off "
                                "by 10 m, their distances by 1 per cent")})] = MEASURED
    waviness: Annotated[float | None, question.InPython(
        "of a road that was not measured (default: 2); to find it, add road.waviness to `free`",
        question.WAVINESS)] = None
    anyway: shared_fields.Anyway = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.waviness is not None and self.road == MEASURED:
            raise self.wrong("waviness", ": expected a road that was not measured (`unmeasured_road` or `same_road`)")


VERB = question.Verb(IdentifyQuestion, "logger.api.identify.answer:identify", (question.Out(
    "write the vehicle with the fitted values; FILE.html, .png, .svg, .pdf: pictures of the residual and of correlated "
    "parameters; may repeat", metavar="FILE", others=("*",)),), "logger.api.identify.answer:refusal_json")
