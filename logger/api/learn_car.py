"""A car that nobody measured, learned from ordinary drives: answer, words and page."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.csv_recording import CsvSettings, recorded_csv
from logger.api.drive_questions import LearnCarQuestion
from logger.api.extraction import even_drives, recorded_dump
from logger.api.inputs import Model, read_vehicle
from logger.api.shared_fields import each
from logger.api.shown import CommandResult
from logger.bounds import CONFLICT_SIGMA, UNUSUAL_SIGMA
from logger.chart_data import Chart, Curves, Line
from logger.errors import BadInput, CheckFailed, as_bad_input
from logger.estimation import drive_spectra
from logger.estimation.rms_calibration import SPEEDS_MPS
from logger.identification.unknown_car import (
    COORDINATES,
    Array,
    CarKnowledge,
    LearnedCar,
    UnknownCar,
    iri_errors,
    iri_ratio,
    misfit,
    reading_power,
)
from logger.printable import counted
from logger.question import function
from logger.report.blocks import Blocks, Hint, Lines, Section, Table
from logger.report.quantities import measured
from logger.runs import READING
from logger.service.config import GRAVITY_TOLERANCE_G, Config
from logger.shipped import vehicle_names, vehicle_path
from logger.store.formats import drive_file, vehicle_file
from logger.store.formats.record_file import TIME, VERTICAL, even_rate_hz
from logger.store.formats.vehicle_file import CarModel, write_model
from logger.store.log.log_name import CAR, OwnFile, inside_of, log_name
from logger.store.log.sidecar import read_sidecar
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.named_parameters import changed, read
from logger.vehicle.published_cars import (
    NUMBERS,
    USUAL_MASS_KG,
    WHEELBASE_ERROR,
    coordinates_of,
    number_errors,
    share_of,
)
from logger.vehicle.vehicle import GENERIC

_GIVEN_STD_M, _USUAL_STD_M = 0.1, 0.2
"""Standard error of where the sensor sits before the middle between the axles; and where nothing is said, within the
front of the cabin."""
_FEWEST_BLOCKS = 60
"""Two minutes of steady driving (a judgement: less says little more than the prior)."""
_TWO_CARS = 5.0
"""Logarithm of how many times likelier two cars are than one: very strong evidence (R. Kass and A. Raftery, Journal of
the American Statistical Association 90, 1995). Drives of one simulated car had -12 and less, of two 90 and more."""
_CHANGED = 2.64
"""Standard errors: one of six numbers is so far off by chance in one case of 20."""
_NO_CAR = 31.3
"""Squared distance from published cars, in their spread (chi square with 11 degrees: one car in 1000). Of 2000
simulated linear cars none came to 15, of six with friction of 60 N one to 20.5."""
_LEANING = 0.5
"""Share of the car's braking that an axis feels which leans by 30 degrees. Simulated and real vertical axes felt -0.1
to 0.02, swapped ones 0.77 to 1.04 (a minute of comma2k19: 0.01 and 0.77)."""
_MOST_BLOCKS = 20_000
"""Eleven hours of steady driving, some 300 MB: more says nothing new."""
_MOST_GROUPS, _LOOSE = 8, 0.1
"""Of many drives, groups that are compared; and how well the wheelbase is known there, as a share."""
_MISFIT = 1.25
"""Four standard errors of a right car's 1, out of 129 means. Simulated cars had 0.9 to 1.0, one with a trailer of 1200
kg 1.6."""
_LIMP, _ONE_SPEED = 0.1, 1.5
"""A damping ratio below it is that of a worn damper (new ones have 0.2 to 0.4); a ratio of speeds that is too small to
tell the car's frequencies from the road's waves."""
_COMPARED = (*(f"{end}.{name}" for end in ("front", "rear") for name in ("bounce_hz", "damping_ratio", "hop_hz")),
             "wheelbase_m")


@dataclass(frozen=True, eq=False, repr=False)
class LearnedVehicle(CommandResult):
    """A car out of its drives.

    model              the vehicle, with standard errors
    parameters         ``NUMBERS`` by name, with ``standard_errors``
    iri_std            what is left unknown of an IRI by speed, as a share; ``iri_std_before`` of any car of this
                       wheelbase
    """
    model: CarModel
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    iri_std: Mapping[float, float]
    iri_std_before: Mapping[float, float]
    spectra: tuple[Chart, ...]
    comments: str

    title = "A car learned from its drives"

    def charts(self) -> Sequence[Chart]:
        """Measured and modelled spectra by speed, before and after."""
        return self.spectra

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the vehicle's file. The car is called as its file, so that a fleet tells its cars apart; but what a box
        learns again and again has one name."""
        name = self.model.vehicle.name if path.stem in vehicle_names() or CAR.fullmatch(path.name) else path.stem
        write_model(path, replace(self.model, vehicle=replace(self.model.vehicle, name=name)), self.comments)

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """What to do with it."""
        files = [path for path in written.get("--out", ()) if path.suffix in (".yaml", ".yml")]
        if not files:
            return "Next: --out mycar.yaml writes the vehicle's file."
        return f"Next: copy {files[0]} to the box, and name it in its settings: vehicle: /etc/ridelog/{files[0].name}"


# --- drives ---


def read_drives(source: drive_file.Drive | Path | str, tell: Any) -> list[drive_file.Drive]:
    """The drives of a dump, a run or a phone's recording. BadInput for one that cannot be read."""
    if not isinstance(source, str | Path):
        return [source]
    path = Path(source)
    if not path.exists():
        raise BadInput(f"{path}: expected a dump, a run's folder or a recording of a phone, found no such file")
    if path.name.endswith((".dump", ".dump.gz")):
        recorded = recorded_dump(path, None, GENERIC, tell)
        _check_gravity(path, float(recorded.readings.accel_mps2[recorded.readings.present].mean()))
        return even_drives(recorded, path)
    if path.name == drive_file.DRIVE or (path / drive_file.DRIVE).exists() or _is_drive(path):
        return [_read_run(path)]
    return even_drives(recorded_csv(path, CsvSettings(), Config(), tell), path)


def _check_gravity(source: Path, felt_mps2: Any) -> None:
    """CheckFailed where the axis of a recording that should point up does not feel gravity."""
    if isinstance(felt_mps2, float) and not abs(felt_mps2 / STANDARD_GRAVITY_MPS2 - 1) <= GRAVITY_TOLERANCE_G:
        raise CheckFailed(f"{source}: its vertical_axis feels {felt_mps2 / STANDARD_GRAVITY_MPS2:.2f} g on average, "
                          "not 1 g: it is another axis. Set vertical_axis in the settings, and leave this drive out")


def _check_braking(name: str, drive: drive_file.Drive) -> None:
    """CheckFailed where the vertical axis of a drive without gravity feels the car brake: means of its readings over
    blocks follow the change of the speed."""
    length = round(drive_spectra.BLOCK_S * drive.rate_hz)
    ends = np.arange(0, len(drive.speed_mps), length)
    gained = np.diff(drive.speed_mps[ends]) / drive_spectra.BLOCK_S
    felt = drive.accel_z_mps2[:len(gained) * length].reshape(-1, length).mean(axis=1)
    known = np.isfinite(felt + gained)
    if known.sum() < 3 or not np.ptp(gained[known]):
        return
    from scipy.special import ndtr, stdtrit

    felt, gained = felt[known] - felt[known].mean(), gained[known] - gained[known].mean()
    share = float(felt @ gained / (gained @ gained))
    std = float(np.sqrt(((felt - share * gained) ** 2).sum() / (len(felt) - 2) / (gained @ gained)))
    sure = float(stdtrit(len(felt) - 2, ndtr(CONFLICT_SIGMA)))  # a few blocks hardly show their own errors
    if abs(share) > max(_LEANING, sure * std):
        raise CheckFailed(f"{name}: its vertical axis feels {measured(abs(share), std)} times the car's braking: it is "
                          "another axis, or the sensor leans by 30 degrees or more")


def _is_drive(path: Path) -> bool:
    """Whether a table has the columns of a drive."""
    if not path.is_file():
        return False
    try:
        return {drive_file.SPEED, VERTICAL} <= set(drive_file.header_of(path))
    except BadInput:
        return False


def _read_run(path: Path) -> drive_file.Drive:
    """A run whose distance may be missing."""
    table = path / drive_file.DRIVE if path.is_dir() else path
    file, columns = drive_file.read_columns(table, timed=True, more=(drive_file.SPEED,))
    drive = drive_file.drive_of(path, even_rate_hz(columns[TIME], file),
                                {drive_file.DISTANCE: columns[drive_file.SPEED], **columns})
    return replace(drive, facts=drive_file.facts_beside(table))


def spectra_of(drive: drive_file.Drive) -> drive_spectra.DriveSpectra:
    """The blocks of a drive, with what is known of its sensor."""
    facts = drive.facts
    known = [one for one in (facts.noise_mps2, facts.step_mps2 and facts.step_mps2 / 12**0.5) if one]
    noise = 2 * sum(one**2 for one in known) / drive.rate_hz if known else np.nan
    usable = np.isfinite(drive.accel_z_mps2) if drive.usable is None else drive.usable == READING
    return drive_spectra.drive_spectra(drive.accel_z_mps2, drive.speed_mps, usable, drive.rate_hz, noise,
                                       (facts.pass_band_hz or (0.0, np.inf))[1])


# --- the answer ---


@dataclass(frozen=True, eq=False)
class _Used:
    """A drive that has blocks."""
    name: str
    seconds: float
    spectra: drive_spectra.DriveSpectra
    vehicle: str = ""  # that the settings named, where it is known


def _of_logs(source: drive_file.Drive | Path | str) -> list[_Used] | None:
    """What the sidecars of a log, or of a folder of logs, keep of their drives; None where there are no logs. BadInput
    where they keep nothing."""
    if not isinstance(source, str | Path):
        return None
    path = Path(source)
    if path.is_dir():
        logs = [one for one in sorted(inside_of(path)) if (own := OwnFile.of(one.name)) and own.kind == ".csv"]
    else:
        logs = [path] if path.exists() and log_name(path) else []
    found: dict[tuple[Path, int], _Used] = {}
    for log in logs:  # the last file of a session has what is kept of all of it
        name = log_name(log)
        try:
            content = read_sidecar(log) or {}
            if name is not None and (fields := content.get(drive_spectra.DRIVE_SPECTRA)):
                spectra = drive_spectra.spectra_of_fields(fields)
                _check_gravity(log, fields.get("felt_mps2"))
                vehicle = content.get("vehicle")
                found[log.parent, name.session] = _Used(
                    log.name, len(spectra) * fields.get("every", 1) * drive_spectra.BLOCK_S / 2, spectra,
                    str(vehicle.get("name", "")) if isinstance(vehicle, dict) else "")
        except (OSError, ValueError) as error:
            raise BadInput(f"{log}: its sidecar cannot be used: {error}: leave the log out") from None
    if logs and not found:
        raise BadInput(f"{path}: expected logs whose sidecars keep spectra of the drives, found none in "
                       f"{counted(len(logs), 'file')}: older versions of ridelog kept none; give the dumps of these "
                       "drives")
    return list(found.values()) or None


def _thinned(used: list[_Used]) -> list[_Used]:
    """The drives with as many blocks in all as memory is meant for, spread over each."""
    every = -(-sum(len(one.spectra) for one in used) // _MOST_BLOCKS)
    return used if every < 2 else [replace(one, spectra=one.spectra.part(slice(None, None, every))) for one in used]


def _used(question: LearnCarQuestion) -> list[_Used]:
    given = each(question.drives)
    if not given:
        raise BadInput("learn-car: expected a drive, found none")
    paths = [Path(one).resolve() for one in given if isinstance(one, str | Path)]
    if again := next((one for one in paths if paths.count(one) > 1), None):
        raise BadInput(f"{again}: expected every drive once, found it twice")
    found = []
    for source in given:
        if (kept := _of_logs(source)) is not None:
            found += kept
            continue
        drives = read_drives(source, question.progress)
        for number, drive in enumerate(drives, 1):
            name = Path(drive.path).name + (f" ({number})" if len(drives) > 1 else "")
            _check_braking(name, drive)
            found.append(_Used(name, len(drive.accel_z_mps2) / drive.rate_hz, spectra_of(drive)))
        question.progress(f"read {source if isinstance(source, str | Path) else 'a drive'}")
    blocks = sum(len(one.spectra) for one in found)
    if blocks < _FEWEST_BLOCKS:
        driven_s = sum(one.seconds for one in found)
        raise BadInput(f"learn-car: expected at least two minutes of steady driving, found {2 * blocks} s in "
                       f"{driven_s:.0f} s of drives: drive for twenty minutes, some of it at 30, 60 and 90 km/h")
    return _thinned([one for one in found if len(one.spectra)])


@function(LearnCarQuestion)
def learn_car(question: LearnCarQuestion) -> LearnedVehicle:
    used = _used(question)
    knowledge = CarKnowledge(question.wheelbase_m, ahead_m=question.sensor,
                             ahead_std_m=_USUAL_STD_M if question.sensor is None else _GIVEN_STD_M)
    question.progress("finding the car")
    problem, car = UnknownCar(drive_spectra.joined([one.spectra for one in used]), knowledge).learn()
    question.progress("checking it")
    motion = problem.motion(car)
    by_motion, alike = problem.by_motion(car, np.full(len(motion), np.median(motion)))
    nonlinear = alike < -_TWO_CARS
    if nonlinear:  # two cars, of which one drove rough roads only, are each linear within their drives
        drive = problem.spectra.drive
        medians = np.array([np.median(motion[drive == one]) for one in range(problem.drives)])
        nonlinear = problem.by_motion(car, medians[drive])[1] < -_TWO_CARS
    unseen = _checked_drives(used, knowledge, car.x, -alike if nonlinear else 0.0, question.progress)
    _check_car(problem, car)
    _check_wheelbase(problem, car)
    missing, covariance = list(_uneven_dampers(car)), car.covariance
    if alike < -_TWO_CARS:
        much, little = by_motion
        missing, off = [_not_linear(much, little), *missing], much.x - little.x
        covariance = covariance + np.outer(off, off)
    return _answer(question, used, problem, replace(car, covariance=covariance), missing, unseen)


def _uneven_dampers(car: LearnedCar) -> Iterator[str]:
    """What is said where the wheels' hop has the harmonics of uneven dampers."""
    at = COORDINATES.index("dampers.unevenness")
    uneven = float(np.exp(car.x[at]))
    std = uneven * float(car.std[at])
    if uneven > CONFLICT_SIGMA * std and uneven >= 1:  # such a damper would push the wheel on
        yield ("The harmonics of wheel hop are too strong even for dampers that act in one direction only. "
               "A measured street and ridelog diagnose may show what causes them.")
    elif uneven > CONFLICT_SIGMA * std:
        least = uneven - 2 * std
        factor = (measured((1 + uneven) / (1 - uneven), 2 * std / (1 - uneven) ** 2) if uneven + 2 * std < 1 else
                  f"at least {(1 + least) / (1 - least):.2g}")
        yield (f"The dampers are asymmetric, by a factor of {factor} between bump and rebound. A measured street and "
               "ridelog diagnose show which is harder (damper_asymmetry).")


def _not_linear(much: LearnedCar, little: LearnedCar) -> str:
    """What is said of a car that answers otherwise where its suspensions move much."""
    name = _most_apart(much, little, _COMPARED[:-1])
    at = COORDINATES.index(name)
    like = "friction" if much.x[at] < little.x[at] else "a progressive spring or damper"
    return (f"This car is nonlinear: its {_words_of(name)} is {_value(much, name)} where its suspensions move fast and "
            f"{_value(little, name)} where they move slowly, as with {like}. The standard errors include the "
            "difference. To find the effect, drive a measured street and run ridelog diagnose.")


def _most_apart(one: LearnedCar, other: LearnedCar, names: Sequence[str]) -> str:
    """Of some numbers the one by which two cars differ most, in standard errors."""
    at = [COORDINATES.index(name) for name in names]
    return names[int(np.argmax((abs(one.x - other.x) / np.hypot(one.std, other.std))[at]))]


def _check_wheelbase(problem: UnknownCar, car: LearnedCar) -> None:
    """CheckFailed where the interference between the axles is that of another wheelbase."""
    at = COORDINATES.index("wheelbase_m")
    free = UnknownCar(problem.spectra, replace(problem.knowledge, wheelbase_std=0.2))
    found = free.fit_of([car.x, *(_moved(car.x, at, step) for step in (-0.1, 0.1))])
    off, std = float(found.x[at] - np.log(problem.knowledge.wheelbase_m)), float(found.std[at])
    if abs(off) > max(CONFLICT_SIGMA * std, UNUSUAL_SIGMA * WHEELBASE_ERROR):
        metres = float(np.exp(found.x[at]))
        raise CheckFailed(f"--wheelbase {problem.knowledge.wheelbase_m:g}: expected the distance that the drives show, "
                          f"{measured(metres, max(metres * std, 0.005))} m: measure it again, hub to hub on one side "
                          "(a trailer, or drives of two cars, cause this as well)")


def _moved(x: Array, at: int, step: float) -> Array:
    moved = x.copy()
    moved[at] += step
    return moved


def _checked_drives(used: Sequence[_Used], knowledge: CarKnowledge, start: Array, nonlinear: float, tell: Any
                    ) -> list[tuple[drive_spectra.DriveSpectra, LearnedCar]]:
    """Each drive, or each group of many, with the car of the others. CheckFailed where one is of another car than the
    rest. ``nonlinear``: logarithm of how many times likelier than a linear car one is that depends on how fast its
    suspensions move: it explains drives that differ."""
    groups: list[list[_Used]] = []
    most = -(-sum(len(one.spectra) for one in used) // _MOST_GROUPS)
    for one in used:
        if groups and sum(len(each.spectra) for each in groups[-1]) < max(
                _FEWEST_BLOCKS // 2, most if len(used) > _MOST_GROUPS else 0):
            groups[-1].append(one)
        else:
            groups.append([one])
    if len(groups) < 2:
        return []
    loose = replace(knowledge, wheelbase_std=_LOOSE)
    found = []
    for number, group in enumerate(groups):
        others = [one for other in groups[:number] + groups[number + 1:] for one in other]
        tell(f"checking {group[0].name}")
        spectra = drive_spectra.joined([one.spectra for one in group])
        own = UnknownCar(spectra, loose).fit_of([start, loose.mean])
        rest = UnknownCar(drive_spectra.joined([one.spectra for one in others]), loose).fit_from(start)
        found.append((own.log_evidence + rest.log_evidence, group, others, spectra, own, rest))
    evidence, group, others, _, own, rest = max(found, key=lambda one: one[0])
    one_car = UnknownCar(drive_spectra.joined([one.spectra for one in used]), loose).fit_from(start)
    if evidence - one_car.log_evidence > max(_TWO_CARS, nonlinear):
        name = _most_apart(own, rest, _COMPARED)
        those = "this drive is" if len(group) == 1 else f"this and the {len(group) - 1} drives after it are"
        as_what = "the others" if len(others) > 1 else others[0].name
        raise CheckFailed(
            f"{group[0].name}: {those} not from the same car as {as_what}: its {_words_of(name)} is "
            f"{_value(own, name)}, not {_value(rest, name)}. "
            "Learn each car from its own drives (a trailer, a full boot or other tires make another car)")
    return [(spectra, rest) for _, _, _, spectra, _, rest in found]


def _value(car: LearnedCar, name: str) -> str:
    at = COORDINATES.index(name)
    value = float(np.exp(car.x[at]))
    return f"{value:.3g} ± {value * float(car.std[at]):.1g} {_WORDS[name.rpartition('.')[2]][1]}".strip()


_WORDS = {"bounce_hz": ("body bounce", "Hz"), "damping_ratio": ("damping ratio", ""), "hop_hz": ("wheel hop", "Hz"),
          "unsprung_to_sprung": ("unsprung / sprung mass", ""), "rear_share": ("share of weight on the rear axle", ""),
          "dynamic_index": ("dynamic index of pitch", ""), "wheelbase_m": ("wheelbase", "m"),
          "contact_patch_m": ("contact patch", "m")}
"""Of each coordinate the words and the unit."""


def _words_of(name: str) -> str:
    """With its end of the car: "front body bounce"."""
    end, _, number = name.rpartition(".")
    return f"{end} {_WORDS[number][0]}".strip()


def _with_unit(number: str) -> str:
    words, unit = _WORDS[number]
    return f"{words} [{unit}]" if unit else words


def _check_car(problem: UnknownCar, car: LearnedCar) -> None:
    """CheckFailed where the numbers together are as far from those of published cars as no car's; a worn damper is no
    reason."""
    off = (car.x - problem.knowledge.mean) / problem.knowledge.std
    kept = [at for at, name in enumerate(NUMBERS) if off[at] > -2 or not name.endswith("damping_ratio")]
    far = (car.x - problem.knowledge.mean)[kept]
    if far @ np.linalg.solve(problem.knowledge.covariance[np.ix_(kept, kept)], far) > _NO_CAR:
        most = max(kept, key=lambda at: abs(off[at]))
        raise CheckFailed(f"learn-car: no car fits these drives: {_words_of(NUMBERS[most])} would be "
                          f"{abs(off[most]):.1f} standard deviations from that of published cars. Is vertical_axis the "
                          "one that points up, is the sensor bolted to the body, were they driven without a trailer?")


def _answer(question: LearnCarQuestion, used: Sequence[_Used], problem: UnknownCar, car: LearnedCar,
            missing: Sequence[str], unseen: Sequence[tuple[drive_spectra.DriveSpectra, LearnedCar]]) -> LearnedVehicle:
    knowledge, own = problem.knowledge, len(NUMBERS)
    errors = _unseen_errors(knowledge, unseen)
    noise = float(np.nanmedian(problem.noise) * np.exp(car.x[-1]))
    level = float(np.exp(np.median(car.roads.level)))
    now, ever = (dict(zip(SPEEDS_MPS, map(float, iri_errors(knowledge, x, covariance, SPEEDS_MPS, noise, level)),
                          strict=True))
                 for x, covariance in ((car.x, car.covariance), (knowledge.mean, knowledge.covariance)))
    mass = USUAL_MASS_KG if question.mass_kg is None else _sprung_side_kg(question.mass_kg, car.x)
    vehicle = knowledge.car(car.x, mass, "learned-car")
    model = Model(vehicle, errors=number_errors(lambda x: knowledge.car(x, mass, ""), car.x, car.covariance))
    shown = [*NUMBERS, "wheelbase_m"]
    values = {name: _shown(name, float(car.x[at])) for at, name in enumerate(shown)}
    deviations = {name: _slope(name, values[name]) * float(car.std[at]) for at, name in enumerate(shown)}
    unknown = list(_not_identifiable(problem, car))
    moved = list(_changes(question, car)) if question.compare else []
    misfits = list(_misfits(used, knowledge, car, SPEEDS_MPS, noise, level))
    seconds = sum(one.seconds for one in used)
    as_json = {
        "parameters": values, "standard_errors": deviations, "sensor_ahead_of_middle_m": float(car.x[own + 1]),
        "drives": len(used), "seconds": seconds, "blocks": len(problem.spectra),
        "speed_low_mps": float(problem.spectra.speed_mps.min()),
        "speed_high_mps": float(problem.spectra.speed_mps.max()),
        "iri": [{"speed_mps": speed, "std_share": now[speed], "std_share_before": ever[speed]} for speed in SPEEDS_MPS],
        "kept_back": errors, "sprung_mass_kg": mass, "mass_is_convention": question.mass_kg is None,
        "converged": car.is_converged, "not_identifiable": unknown,
        "effects_missing": list(missing), "changes": moved, "other_than_settings": misfits}
    content = Blocks([Lines([*_head(used, problem, seconds)]), _table(values, deviations),
            Hint("Usual cars: bounce at 1 to 1.5 Hz, damping ratios 0.2 to 0.4, wheel hop at 10 to 14 Hz."),
            Section("Standard error of the IRI because of the car [%]", [
                Table(("at km/h", *(f"{3.6 * speed:.0f}" for speed in now)), [
                    ("any car of this wheelbase", *(f"{100 * value:.0f}" for value in ever.values())),
                    ("this car", *(f"{100 * value:.1f}" for value in now.values()))])]),
            Lines([*_kept_lines(errors), _mass_line(question, mass), *_warnings(problem, car, values, deviations),
                   *missing, *unknown, *moved, *misfits])])
    comments = "".join(f"# {line}\n".replace("# \n", "#\n") for line in [
        f"Learned by ridelog learn-car from {len(used)} drives, {seconds / 60:.0f} min.", *str(content).split("\n")])
    return LearnedVehicle(content, as_json, model, values, deviations, now, ever,
                          tuple(_charts(problem, car)), comments)


def _unseen_errors(knowledge: CarKnowledge, unseen: Sequence[tuple[drive_spectra.DriveSpectra, LearnedCar]]
                   ) -> dict[str, Any]:
    """How far drives are from any car of this wheelbase, and from the one that was learned from the others."""
    found = [[misfit(UnknownCar(spectra, knowledge), x) for x in (knowledge.mean, rest.x)] for spectra, rest in unseen]
    before, after = np.sqrt(np.mean(np.square(found), axis=0)).tolist() if found else (None, None)
    return {"drives": len(found), "misfit_before": before, "misfit_after": after}


def _shown(name: str, coordinate: float) -> float:
    return share_of(coordinate) if name == "rear_share" else float(np.exp(coordinate))


def _slope(name: str, value: float) -> float:
    return value * (1 - value) if name == "rear_share" else value


def _sprung_side_kg(mass_kg: float, x: Array) -> float:
    """Sprung mass of one side of a car that weighs so much with its wheels."""
    share = _shown("rear_share", float(x[NUMBERS.index("rear_share")]))
    ratios = [float(np.exp(x[NUMBERS.index(f"{end}.unsprung_to_sprung")])) for end in ("front", "rear")]
    return mass_kg / 2 / (1 + ratios[0] * (1 - share) + ratios[1] * share)


# --- words ---


def _head(used: Sequence[_Used], problem: UnknownCar, seconds: float) -> Iterator[str]:
    speeds = problem.spectra.speed_mps
    many = f"{len(used)} drives" if len(used) > 1 else "1 drive"
    yield (f"{many}, {seconds / 60:.0f} min; {2 * len(speeds) / 60:.0f} min of them at nearly steady speed, "
           f"{3.6 * speeds.min():.0f} to {3.6 * speeds.max():.0f} km/h")


def _table(values: Mapping[str, float], deviations: Mapping[str, float]) -> Table:
    cells = {name: measured(value, deviations[name]) for name, value in values.items()}
    by_axle = [one.removeprefix("front.") for one in cells if one.startswith("front.")]
    return Table(("", "front", "rear"), [
        *((_with_unit(name), cells[f"front.{name}"], cells[f"rear.{name}"]) for name in by_axle),
        *((_with_unit(name), "", cells[name]) for name in cells if "." not in name)])


def _kept_lines(errors: Mapping[str, Any]) -> Iterator[str]:
    if not errors["drives"]:
        yield "Only one drive: give another, so that each can check the car learned from the other."
        return
    yield ("Check: each drive in turn is compared with the car learned from the others. The misfit of its spectra is "
           f"{errors['misfit_after']:.1f} times that of chance (ideal: 1), and {errors['misfit_before']:.1f} times for "
           "the average car of this wheelbase.")


def _mass_line(question: LearnCarQuestion, mass: float) -> str:
    if question.mass_kg is None:
        return ("Drives show only the ratios of masses, springs and dampers, and the IRI needs no more. Assumed: a "
                f"sprung mass of {mass:.0f} kg per side; --mass gives that of your car.")
    return (f"Masses, springs and dampers are those of a car of {question.mass_kg:g} kg: a sprung mass of {mass:.0f} "
            "kg per side.")


def _warnings(problem: UnknownCar, car: LearnedCar, values: Mapping[str, float], deviations: Mapping[str, float]
              ) -> Iterator[str]:
    for end in ("front", "rear"):
        name = f"{end}.damping_ratio"
        if values[name] + deviations[name] < _LIMP:
            yield (f"The {end} damping ratio of {values[name]:.2f} is that of a worn damper (new ones: 0.2 to 0.4): "
                   "have it checked.")
    if (off := misfit(problem, car.x)) > _MISFIT:
        yield (f"No two-axle car explains the spectra (misfit {off:.1f} times that of chance): was there a trailer or "
               "a shifting load, or is the sensor loose or on another axis?")
    if not car.is_converged:
        yield "The search did not converge: parameters may be off by more than their standard errors; give more drives."


def _not_identifiable(problem: UnknownCar, car: LearnedCar) -> Iterator[str]:
    """What the drives cannot tell, a line each."""
    low, high = np.quantile(problem.spectra.speed_mps, (0.05, 0.95))
    if high < _ONE_SPEED * low:
        yield (f"All drives at one speed ({3.6 * low:.0f} to {3.6 * high:.0f} km/h): springs and the road's waviness "
               "cannot be separated; add one at 30 and one at 90 km/h.")
    elif 3.6 * high < 60:
        yield "No drive was faster than 60 km/h: add one at 90 km/h, where springs and dampers show best."
    prior = problem.knowledge.std
    unknown = [name for at, name in enumerate(NUMBERS) if car.std[at] > 0.8 * prior[at]]
    if unknown:
        yield (f"These drives do not show the {', the '.join(map(_words_of, unknown))}: there the values and errors "
               "are those of published cars.")


def _changes(question: LearnCarQuestion, car: LearnedCar) -> Iterator[str]:
    """What has changed since another file was learned."""
    assert question.compare is not None
    before = read_vehicle(question.compare)
    with as_bad_input(question.compare):
        x = coordinates_of(before.vehicle)
    spread = _coordinate_errors(before)
    found = []
    for name in _COMPARED[:-1]:
        at = NUMBERS.index(name)
        change, std = float(car.x[at] - x[at]), float(np.hypot(car.std[at], spread[at]))
        if abs(change) > _CHANGED * std:
            found.append(f"{_words_of(name)} {100 * np.expm1(change):+.0f} % (± {100 * std:.0f})")
    yield (f"Changed since {question.compare}: {', '.join(found)}." if found else
           f"Nothing has changed since {question.compare} by more than chance.")


def _misfits(used: Sequence[_Used], knowledge: CarKnowledge, car: LearnedCar, speeds_mps: Sequence[float], noise: float,
             level: float) -> Iterator[str]:
    """Vehicles that the settings of the drives named and that are not this car: their IRI is off by more than this
    car's error lets it be."""
    said = {one.vehicle for one in used if one.vehicle in vehicle_names()} - {GENERIC}
    if not said:
        return
    errors = iri_errors(knowledge, car.x, car.covariance, speeds_mps, noise, level)
    for name in sorted(said):
        try:
            x = np.append(coordinates_of(vehicle_file.read_vehicle(vehicle_path(name))), car.x[len(NUMBERS):])
        except ValueError:  # a quarter car says nothing of two axles
            continue
        bias = np.array([iri_ratio(reading_power(knowledge, x, speed), reading_power(knowledge, car.x, speed), speed,
                                   noise, level) for speed in speeds_mps])
        at = int(np.argmax(abs(np.log(bias)) / errors))
        if abs(np.log(bias[at])) < CONFLICT_SIGMA * errors[at]:
            continue
        numbers = [NUMBERS.index(one) for one in _COMPARED[:-1]]
        most = NUMBERS[max(numbers, key=lambda one: abs(x[one] - car.x[one]) / car.std[one])]
        yield (f"These drives do not fit {name}, the vehicle in the settings: {_words_of(most)} is "
               f"{_value(car, most)}, "
               f"not {np.exp(x[NUMBERS.index(most)]):.3g}; its IRI is {100 * (bias[at] - 1):+.0f} % off at "
               f"{3.6 * speeds_mps[at]:.0f} km/h.")


def _coordinate_errors(model: CarModel) -> Array:
    """Standard errors of a model's coordinates, out of those of its numbers; 0 where it says none."""
    if model.errors is None:
        return np.zeros(len(NUMBERS))
    names = [name for name in model.errors.standard_errors if not name.startswith("sensor.")]
    kept = [at for at, name in enumerate(model.errors.standard_errors) if name in names]
    deviations = np.array([model.errors.standard_errors[name] for name in names])
    covariance = model.errors.matrix()[np.ix_(kept, kept)] * np.outer(deviations, deviations)
    slopes = np.zeros((len(NUMBERS), len(names)))
    for at, name in enumerate(names):
        value = read(model.vehicle, name)
        low, high = (coordinates_of(changed(model.vehicle, {name: value * (1 + step)})) for step in (-1e-5, 1e-5))
        slopes[:, at] = (high - low) / (2e-5 * value)
    return np.sqrt(np.diag(slopes @ covariance @ slopes.T))


def _charts(problem: UnknownCar, car: LearnedCar) -> Iterator[Chart]:
    """Measured and expected spectra of thirds of the speeds."""
    f_hz, speeds = drive_spectra.middles_hz(), problem.spectra.speed_mps
    edges = np.quantile(speeds, (0.0, 1 / 3, 2 / 3, 1.0))
    start = problem.knowledge.mean
    before, _ = problem.with_blocks(start, problem.start(start))
    cars = {"average car": (start, before), "this car": (car.x, car.roads)}
    for low, high in pairwise(edges):
        group = (speeds >= low) & (speeds <= high)
        seen = (problem.weight[group] > 0).all(axis=0)
        lines = [Line("measured", f_hz[seen], problem.power[group].mean(axis=0)[seen], dots=True)]
        for name, (x, roads) in cars.items():
            road, noise = problem.expected_power(x, roads)
            lines.append(Line(name, f_hz[seen], (road + noise)[group].mean(axis=0)[seen]))
        yield Curves(f"Spectra at {3.6 * low:.0f} to {3.6 * high:.0f} km/h", "frequency [Hz]",
                     "power spectral density [(m/s2)2/Hz]", tuple(lines), log_x=True, log_y=True)
