"""What the lab's verbs are asked: compare, diagnose, add-effect, learn, plan and lab."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

from logger import question
from logger.api import shared_fields

if TYPE_CHECKING:
    from logger.store.formats.profile_file import Wheelpaths


PAGE = question.Out("write a page with pictures; may repeat", others=("*",), is_drawn=False)


@dataclass(frozen=True, kw_only=True)
class LabQuestion(question.LongQuestion):
    """What the lab's verbs have in common; each has a ``vehicle``, ``runs`` and maybe ``effect_files`` as well."""

    tolerance: shared_fields.Tolerance = None
    low_pass_hz: shared_fields.LowPass = None
    anyway: shared_fields.Anyway = False

    def files_read(self) -> Sequence[Path]:
        given: Any = self
        return [*super().files_read(), *shared_fields.files_of(given.vehicle)]

    def command(self, words: str, in_lab: bool = True) -> str:
        """A command line about the same vehicle and runs; of a verb of the lab with the same options."""
        given: Any = self
        said = [f"--vehicle {given.vehicle}"]
        if in_lab:
            said += [f"{flag} {value}" for flag, value in (
                ("--tolerance", self.tolerance), ("--low-pass", self.low_pass_hz)) if value is not None]
            said += ["--anyway"] * self.anyway
        return f"ridelog {words.format(' '.join(said))} {' '.join(map(str, shared_fields.paths_of(given.runs)))}"


@dataclass(frozen=True)
class CompareQuestion(LabQuestion):
    """Compare a vehicle's model with measurements: the error, where it is largest, and what kind of physics is missing.

    Each RUN is a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was driven on,
    or, of a rig, drive.csv (t_s,accel_z_mps2) and the excitation.csv (t_s,elevation_m[,elevation_rear_m]) that drove
    it. Runs are of one sample rate of 50 Hz or more, and of 5 s or longer (on quick rigs less).

      ridelog compare --vehicle mycar.yaml run1 run2
      ridelog compare --vehicle mycar.yaml run1 run2 --out compare.html

    NRMSE is rms(measured - model) / rms(measured) after the first 2 s of each run. Then compare refits the car's
    parameters and the distances within their usual errors and analyses the residual: only what is left then is evidence
    of physics that the model lacks. ridelog diagnose finds which.

    In Python: raises BadInput where these do not fit together, and as ``read_vehicle`` and ``read_run``.

    >>> found = compare(car, runs)
    >>> found.refitted_error < found.error, found.missing
    (True, True)
    """

    vehicle: shared_fields.VehicleName
    runs: shared_fields.TrackedRuns


@dataclass(frozen=True)
class DiagnoseQuestion(LabQuestion):
    """Find which physical effect a vehicle's model lacks: diagnose tries every known effect, and the evidence decides.

    Each RUN is a folder as in ridelog compare.

      ridelog diagnose --vehicle mycar.yaml run1 run2
      ridelog diagnose --vehicle mycar.yaml run1 run2 --effect-file my_effect.py --out diagnosis.html

    NRMSE is rms(measured - model) / rms(measured) on held-out stretches: diagnose holds out three sets in turn. It
    first refits the car's parameters (within --tolerance) and the distances (as far as the runs show them to be off),
    so that no small error passes for an effect. It takes seconds to minutes and needs pip install 'ridelog[lab]'.

    With --same-road each RUN is a drive.csv, or a folder with one; diagnose does not read a profile.csv in it. The runs
    are drives over the same road at different speeds, with distances counted from the same place (to about 3 m). Runs
    extracted without a profile count from their own start; diagnose aligns them by their positions. It refuses drives
    over two roads. NRMSE is then that of each drive over the road as estimated from the others.

    In Python: raises BadInput as ``compare``, for effects that there are not, and where the compiler is missing.

    >>> found = diagnose(car, runs, candidates=["sensor_gain", "sensor_offset", "time_offset"])
    >>> found.verdict, found.unexplained
    (('sensor_gain',), False)
    >>> found.candidates[0].effect, round(found.candidates[0].parameters["gain"], 1)
    ('sensor_gain', 1.1)
    """

    vehicle: shared_fields.VehicleName
    runs: shared_fields.TrackedRuns
    _: KW_ONLY
    candidates: shared_fields.Candidates = None
    effect_files: shared_fields.EffectFiles = ()
    list_all: Annotated[bool, "list all candidates, not only the first 8"] = False
    same_road: Annotated[bool, question.Option(
        "without a profile: two runs or more (folders, or drive.csv files) over one road at different speeds; "
        "nonlinear effects are tried in linearised form")] = False


@dataclass(frozen=True)
class AddEffectQuestion(LabQuestion):
    """Add a physical effect to a vehicle: fit it with the car's parameters to all runs, and show what that changed.

      ridelog add-effect dry_friction --vehicle mycar.yaml --out mycar-2.yaml run1 run2
      ridelog add-effect dry_friction+damper_asymmetry --vehicle mycar.yaml --out mycar-2.yaml run1 run2
      ridelog add-effect sensor_bandwidth:order=2,cutoff_hz=20 --vehicle mycar.yaml --out mycar-2.yaml run1 run2
      ridelog add-effect ./my_effect.py --vehicle mycar.yaml --out mycar-2.yaml run1 run2

    add-effect fits several effects together. The fit begins at the values that you give (PARAM=VALUE) and searches for
    the other start values. The new vehicle file holds the effects with their standard errors, the refitted parameters
    and the history of the model. The old file stays unchanged unless --out names it.

    In Python: raises BadInput as ``compare``, and for an effect that there is not, that the model has, or that cannot
    be there.

    >>> found = add_effect("sensor_gain", car, runs, start={"gain": 1.1})
    >>> found.helps, found.error_after < 0.5 * found.error_before
    (True, True)
    >>> [one.effect.name for one in found.model.effects]
    ['sensor_gain']
    """

    name: Annotated[Path | str, question.Argument(
        "an effect that comes with ridelog, or the path of the Python file of one of your own",
        metavar="NAME[:PARAM=VALUE,...][+NAME...]", read=str)]
    vehicle: shared_fields.VehicleName
    runs: shared_fields.TrackedRuns
    _: KW_ONLY
    start: Annotated[Mapping[str, float] | None,
                     "values by parameter name, where the fit begins; each effect takes its own"] = None

    @property
    def names(self) -> list[str]:
        """Of the effects, as they were asked for one by one: those of files may have a plus in them."""
        return [str(self.name)] if Path(self.name).is_file() else re.split(r"[+](?=[^\d.]|\.{0,2}/)", str(self.name))

    def files_read(self) -> Sequence[Path]:
        own = [Path(one.partition(":")[0]) for one in self.names]
        read = [one for one in super().files_read() if one not in shared_fields.files_of(self.vehicle)[:1]]
        return [*read, *(one for one in own if one.is_file())]


@dataclass(frozen=True)
class LearnQuestion(LabQuestion):
    """Learn a law (a force characteristic) from runs that no known effect explains.

      ridelog learn --vehicle mycar.yaml --out law.py run1 run2
      ridelog learn --vehicle mycar.yaml --out law.py --out law.html run1 run2

    First learn tries every known effect, as ridelog diagnose does. If these explain the residual, or nothing is
    missing, it learns nothing and writes no file. Otherwise it tries families of laws (forces that depend on travel,
    rate or tire deflection, hysteresis, a mass on a spring, ...) by the same evidence, which penalises each parameter.
    It writes the law as an effect of your own: one Python file that compare, simulate, diagnose --effect-file and
    add-effect read. It takes minutes and needs pip install 'ridelog[lab]'. Then:

      ridelog add-effect ./law.py --vehicle mycar.yaml --out with-law.yaml run1 run2

    In Python: raises BadInput as ``diagnose``.

    >>> learn(car, runs).family is None    # a known effect explains it: the sensor's gain
    True
    """

    vehicle: shared_fields.VehicleName
    runs: shared_fields.TrackedRuns
    _: KW_ONLY
    effect_files: shared_fields.EffectFiles = ()

    def check_written(self, files: Mapping[str, Sequence[Path]]) -> None:
        """A page alone would lose the law."""
        if all(path.suffix.lower() == ".html" for path in files["--out"]):
            raise self.complaint("--out: expected the law's file as well, such as law.py")


@dataclass(frozen=True)
class PlanQuestion(LabQuestion):
    """Predict which physical effects runs, or planned drives, could show and distinguish, and which further drive would
    add most.

    Each RUN is a folder as in 'ridelog compare'. Planned drives cover a whole profile, one at each speed, with 100
    samples a second and for 5 s or longer.

      ridelog plan --vehicle mycar.yaml --profile road.csv --speed 8 --speed 15
      ridelog plan --vehicle mycar.yaml run1 run2 --out plan.html

    Detectability and isolability are in standard deviations, for each effect at its usual strength, with the car's
    parameters and the distances free within their tolerance. plan also tries further drives over the known road: other
    speeds, a speed bump or a plank, a second sensor. It needs pip install 'ridelog[lab]'.

    In Python: raises BadInput as ``diagnose``, where there is neither a run nor a planned drive, and for a drive that
    is shorter than 5 s.

    >>> found = plan(car, profile=runs[0].profile, speeds_mps=[9.0], candidates=["sensor_gain", "sensor_offset"])
    >>> found.isolability["sensor_offset"]["sensor_gain"] > 6
    True
    >>> found.next[0].more_named > 0
    True
    """

    vehicle: shared_fields.VehicleName
    runs: Annotated[shared_fields.Runs, question.Argument(
        "folder with drive.csv and profile.csv (of a rig: excitation.csv)", metavar="RUN", read=Path, many=list)] = ()
    _: KW_ONLY
    profile: Annotated[Union["Wheelpaths", Path, str, None], question.Option(
        "the road of planned and further drives (default: that of the longest run)", metavar="FILE",
        read=Path)] = None
    speeds_mps: Annotated[Sequence[float], question.Option(
        "plan a drive over the whole profile at this speed [m/s]; may repeat", question.SPEED, "MPS", many=list,
        flag="--speed")] = ()
    noise_mps2: Annotated[float | None, question.Option(
        "r.m.s. of the sensor's noise [m/s2] (default: that of the runs; without runs 0.05)", question.READING_NOISE,
        "MPS2")] = None
    step_mps2: Annotated[float, question.Option(
        "quantisation step of the planned sensor [m/s2]", question.ADDED, "MPS2")] = 0.0
    candidates: shared_fields.Candidates = None
    effect_files: shared_fields.EffectFiles = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.speeds_mps and self.profile is None:
            raise self.wrong("speeds_mps", ": expected `profile` with it, the road to be driven")
        if again := [one for number, one in enumerate(self.speeds_mps) if one in self.speeds_mps[:number]]:
            raise self.wrong("speeds_mps", f" {again[0]:g}: expected each speed once")


@dataclass(frozen=True)
class LabLoopQuestion(LabQuestion):
    """Compare, diagnose, add what is missing and compare again, until nothing is missing: the lab's whole loop.

      ridelog lab --vehicle mycar.yaml run1 run2
      ridelog lab --vehicle mycar.yaml run1 run2 --yes --out lab

    lab asks before it adds an effect: yes, no, or the name of another one; it adds six at most. If no effect explains
    the residual, it offers to learn a law, as ridelog learn does. DIR gets a vehicle file for each step (vehicle-1.yaml
    ...), the law (law.py), and story.html with the whole story. It takes minutes and needs pip install 'ridelog[lab]'.

    In Python: raises BadInput as ``diagnose`` and ``add_effect``, for a folder that there cannot be, and for an answer
    that is no effect; OSError for files that cannot be written.

    >>> story = lab(car, runs, folder / "lab", candidates=["sensor_gain", "time_offset"])
    >>> [one.effect for one in story.additions], story.comparisons[-1].missing
    (['sensor_gain'], False)
    >>> [one.effect.name for one in read_vehicle(folder / "lab" / "vehicle-1.yaml").effects]
    ['sensor_gain']
    """

    vehicle: shared_fields.VehicleName
    runs: shared_fields.TrackedRuns
    out: Annotated[Path | str, question.Option(
        "folder for the vehicle files and the page", metavar="DIR", read=Path)] = Path("ridelog-lab")
    _: KW_ONLY
    ask: Annotated[Callable[[str], str | None],
                   "takes the name of an effect found missing, and returns the name of the one to add, or None to add "
                   "none; without it everything missing is added"] = str
    candidates: shared_fields.Candidates = None
    effect_files: shared_fields.EffectFiles = ()
    learns: Annotated[bool, "whether a law is learned at all"] = True


COMPARE = question.Verb(CompareQuestion, "logger.api.lab.compare:compare", (question.Out(
    "write a page with pictures; .png, .svg or .pdf: the pictures alone; may repeat", others=("*",)),))
DIAGNOSE = question.Verb(DiagnoseQuestion, "logger.api.lab.diagnose:diagnose", (PAGE,))
ADD_EFFECT = question.Verb(AddEffectQuestion, "logger.api.lab.compare:add_effect", (question.Out(
    "the new vehicle file", metavar="V2.yaml", others=("*",), many=False, is_drawn=False, required=True),))
LEARN = question.Verb(LearnQuestion, "logger.api.lab.learn:learn", (
    question.Out("the law's file; FILE.html: a page with pictures; may repeat", metavar="LAW.py",
                 others=(".py", ".html"), is_drawn=False, required=True),))
PLAN = question.Verb(PlanQuestion, "logger.api.lab.plan:plan", (PAGE,))
LAB = question.Verb(LabLoopQuestion, "logger.api.lab.loop:lab")
