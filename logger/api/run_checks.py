"""Runs for the lab: read, and checked together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from logger.errors import BadInput

if TYPE_CHECKING:
    from logger.runs import Array, Bools, Run
    from logger.simulation.simulated_runs import SimulatedRuns
    from logger.store.formats.drive_file import Drive, DriveOnRoad
    from logger.vehicle.vehicle import Vehicle

_SAME_RATE = 1e-3  # times that are written to a millisecond leave the rate of a few seconds so uncertain
# What the lab looks at of a car lies below 40 Hz: a record of nearly twice this rate or more is thinned to about it.
_RATE_HZ, _NEARLY = 100.0, 0.25
LEAST_S = 5.0
# The lab looks up to 0.37 of the rate (lab/stretches.py): wheels that hop at 10 to 18 Hz are seen from 50 samples a
# second on. A recorder's clock may be off by a per cent.
_LEAST_RATE_HZ, _CLOCK = 50.0, 0.01
_MOST_MEAN_MPS2 = 2.0
_LEAST_MPS2 = 1e-5  # no sensor is so quiet
_BACK_M = 1.0  # a distance that was set right may fall, or leap, so far
_DISAGREE, _DISAGREE_M = 0.5, 5.0


def checked_runs(drives: Sequence[DriveOnRoad], thin: bool = True, vehicle: Vehicle | None = None) -> SimulatedRuns:
    """Runs of one sample rate; of about 100 samples a second, or as many as the ``vehicle`` needs, if they have many
    more and may be thinned (``thin``).

    Raises BadInput for one that is not what ``check_record`` asks for, or stands nowhere on its own profile.
    """
    from logger.profiles.track import Track
    from logger.simulation.simulated_runs import SimulatedRuns, steps_hz
    from logger.store.formats.drive_file import DRIVE

    for number, drive in enumerate(drives):
        file = drive.path / DRIVE if drive.path.is_dir() else drive.path
        if isinstance(drive.track, Track):
            first_m, last_m = float(drive.distance_m.min()), float(drive.distance_m.max())
            if last_m < drive.track.start_m or first_m > drive.track.end_m:
                raise BadInput(f"{file}: expected distances on the profile, {drive.track.start_m:g} to "
                               f"{drive.track.end_m:g} m, found {first_m:g} to {last_m:g} m")
        check_record(drive, file, drives[:number])
        if not drive.track.timed:
            check_distances(drive, file)
    runs = [run for one in drives for run in driven_stretches(one)]
    kept = thinned_runs(runs, vehicle) if thin else runs
    return SimulatedRuns(kept) if vehicle is None else SimulatedRuns(kept, steps_hz(vehicle))


def check_distances(drive: Drive, file: Path) -> None:
    """Raise BadInput for distances that are none: they fall, leap, or have nothing to do with the speed."""
    import numpy as np

    from logger.bounds import SPEED
    from logger.roads.plausible import likely_unit

    distance_m = drive.distance_m
    for wrong, words in (
        (np.diff(distance_m) > SPEED.largest / drive.rate_hz + _BACK_M, "that grow steadily"),
        (np.maximum.accumulate(distance_m)[:-1] - distance_m[1:] > _BACK_M, "that grow, as the car drives forward"),
    ):
        if wrong.any():
            at = int(np.argmax(wrong))
            raise BadInput(f"{file}:{at + 3}: expected distances {words}, found {distance_m[at + 1]:.6g} m after "
                           f"{distance_m[:at + 1].max():.6g} m")
    way_m, by_speed_m = float(distance_m[-1] - distance_m[0]), float(drive.speed_mps.sum() / drive.rate_hz)
    if abs(way_m - by_speed_m) > _DISAGREE * max(way_m, by_speed_m) + _DISAGREE_M:
        raise BadInput(f"{file}: expected speed_mps [m/s] and distance_m [m] to agree, found {by_speed_m:.4g} m of way "
                       f"by the one and {way_m:.4g} m by the other ({likely_unit(by_speed_m, way_m)})")


def driven_stretches(drive: DriveOnRoad) -> list[Run]:
    """The parts of a drive in which the car moved, or stood on a rig, and there were readings (``driven_parts``), each
    a run; of one that stood or had none nowhere the whole. A part says in its name which seconds it is of. BadInput as
    ``driven_parts``."""
    from logger.runs import Run

    parts = driven_parts(drive, drive.track.timed)
    whole = len(parts) == 1 and parts[0] == slice(0, len(drive.time_s))
    cut_s = (len(drive.time_s) - sum(part.stop - part.start for part in parts)) / drive.rate_hz
    return [Run(str(drive.path) if whole else
                f"{drive.path} ({drive.time_s[part.start]:.0f} to {drive.time_s[part.stop - 1]:.0f} s)",
                drive.rate_hz, drive.accel_z_mps2[part], drive.distance_m[part], drive.speed_mps[part],
                drive.track.begun(part.start / drive.rate_hz), facts=drive.facts,
                usable=drive.marks(part), more=_more(drive, part), cut_s=cut_s if part is parts[0] else 0.0)
            for part in parts]


def driven_parts(drive: Drive, on_rig: bool = False) -> list[slice]:
    """Where in a drive the car moved, or stood ``on_rig``, and there were readings.

    A gap between readings is left in a part, as samples that nobody read: a cut there would lose the next ``SKIP_S`` as
    well. One that lasts longer than that is cut out, and so are those at the ends of a part.

    Raises BadInput where no part has readings for ``LEAST_S``.
    """
    import numpy as np

    from logger.dsp.repeated_samples import stretches_of
    from logger.lab.likelihood.lag import SLOWEST_MPS
    from logger.runs import NO_READING, SKIP_S

    driven = (drive.speed_mps >= SLOWEST_MPS) | on_rig
    read = driven if drive.usable is None else driven & (drive.usable != NO_READING)
    kept = read.copy()
    for gap in map(slice, *stretches_of(driven & ~read)):
        between = gap.start > 0 and gap.stop < len(read) and read[gap.start - 1] and read[gap.stop]
        kept[gap] = between and gap.stop - gap.start <= SKIP_S * drive.rate_hz
    parts = [part for part in map(slice, *stretches_of(kept))
             if np.count_nonzero(read[part]) >= LEAST_S * drive.rate_hz]
    if not parts:
        moving = "" if on_rig else f" at {SLOWEST_MPS:g} m/s or faster"
        raise BadInput(f"{drive.path}: expected {LEAST_S:g} s with readings{moving}, without a break of more than "
                       f"{SKIP_S:g} s")
    return parts


def _more(drive: Drive, part: slice) -> Array:
    """The other signals (s, n) of a part of a drive, without their means."""
    import numpy as np

    columns = [drive.more[one.name][part] for one in drive.facts.signals]
    return np.stack([one - one.mean() for one in columns]) if columns else np.empty((0, 0))


def thinned_runs(runs: Sequence[Run], vehicle: Vehicle | None = None) -> list[Run]:
    """Runs of one rate, of about 100 samples a second, or as many as the ``vehicle`` needs, if they had many more. What
    is thinned is no longer rounded; a sample is as usable as the least of those beside it.

    Little of a car's motion lies where the recorder's filter begins; what jerks a rig of little mass is there as well,
    so that its record goes through the filter that its model goes through.
    """
    import numpy as np

    from logger.dsp.whole_record import thinned
    from logger.vehicle.simulate import resampled

    factor = int(runs[0].rate_hz / _needed_hz(vehicle) + _NEARLY)
    if factor < 2:
        return list(runs)

    def fewer(one: Run, samples: Array) -> Array:
        return resampled(samples, factor) if one.timed else thinned(samples, factor)

    return [replace(one, rate_hz=one.rate_hz / factor, measured_mps2=fewer(one, one.measured_mps2),
                    distance_m=one.distance_m[::factor], speed_mps=one.speed_mps[::factor],
                    facts=replace(one.facts, step_mps2=None), usable=_thinned_marks(one.usable, factor),
                    more=np.array([fewer(one, samples) for samples in one.more])) for one in runs]


def _thinned_marks(usable: Array | None, factor: int) -> Array | None:
    """What every ``factor``-th sample is (n,), with those within reach of it: none where one has no reading, else
    clipped where one is."""
    import numpy as np

    from logger.runs import CLIPPED, NO_READING, READING

    if usable is None:
        return None

    def near(mark: float) -> Bools:
        around = np.pad(np.asarray(usable == mark, bool), factor)
        return np.asarray(np.lib.stride_tricks.sliding_window_view(around, 2 * factor + 1)[::factor].max(axis=1))

    return np.where(near(NO_READING), NO_READING, np.where(near(CLIPPED), CLIPPED, READING))


def _needed_hz(vehicle: Vehicle | None) -> float:
    """Samples a second that the lab needs: what it looks at reaches an octave above the vehicle's quickest vibration.
    """
    from logger.lab.likelihood.whittle import HIGHEST_OF_RATE
    from logger.vehicle.models import structure_of
    from logger.vehicle.modes import undamped_frequencies_hz

    if vehicle is None:
        return _RATE_HZ
    return max(_RATE_HZ, 2 * float(undamped_frequencies_hz(structure_of(vehicle))[-1]) / HIGHEST_OF_RATE)


def check_record(drive: Drive, file: Path, others: Sequence[Drive]) -> None:
    """Raise BadInput for a drive of fewer than 50 samples a second, that is shorter than 5 s, has another rate than the
    others, recorded nothing, or repeats samples."""
    import numpy as np

    from logger.bounds import time_hint
    from logger.dsp.repeated_samples import find_repeats
    from logger.runs import READING, SKIP_S

    if drive.rate_hz < (1 - _CLOCK) * _LEAST_RATE_HZ:
        raise BadInput(f"{file}: expected {_LEAST_RATE_HZ:g} samples a second or more, to see the wheels hop, found "
                       f"{drive.rate_hz:.4g}{time_hint(drive.rate_hz)}")
    lasts_s = len(drive.time_s) / drive.rate_hz
    if lasts_s < LEAST_S:
        raise BadInput(f"{file}: expected a drive of {LEAST_S:g} s or longer, found {lasts_s:.3g} s")
    if others and abs(drive.rate_hz / others[0].rate_hz - 1) > _SAME_RATE:
        raise BadInput(f"{file}: expected {others[0].rate_hz:g} samples a second, as in {others[0].path}, found "
                       f"{drive.rate_hz:g}")
    counted = drive.accel_z_mps2[int(SKIP_S * drive.rate_hz):]
    if np.ptp(counted) == 0:
        found = f"{counted[0]:g} m/s2 all along" if counted[0] else "zeros only"
        raise BadInput(f"{file}: expected accelerations after the first {SKIP_S:g} s, found {found}")
    if counted.std() < _LEAST_MPS2:
        raise BadInput(f"{file}: expected accelerations in m/s2, found none above {np.abs(counted).max():.2g}")
    if abs(counted.mean()) > _MOST_MEAN_MPS2:
        raise BadInput(f"{file}: expected gravity to be removed, found {counted.mean():.3g} m/s2 on average")
    # What was laid across gaps is on no step of a coarse sensor, and one at the end of its range rightly stays there.
    read = drive.accel_z_mps2 if drive.usable is None else drive.accel_z_mps2[drive.usable == READING]
    if repeats := find_repeats(read[:, None]):
        raise BadInput(f"{file}: {repeats.complaint}: write a record only as often as the sensor is read")
