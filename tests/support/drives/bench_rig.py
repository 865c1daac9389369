"""A bench quarter car of 2.5 kg on a shaker, from Newton's laws and an integrator of scipy's.

It shares nothing with ridelog: two masses, two springs, a damper, and dry friction that grows to its force within a
tenth of a millimetre a second. The recorder samples at 500 Hz behind an FIR low pass of scipy's that is flat to 190 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.signal import chirp

from .course import Course, integrated

Array = npt.NDArray[np.float64]

RATE_HZ = 500.0
SLIP_MPS = 1e-4


@dataclass(frozen=True)
class Rig:
    """Masses [kg], springs [N/m], the damper [N s/m], dry friction [N] in the suspension, the
    suspension's hardening [N/m3], friction of wheel and body against their guides [N], the tire's damper [N s/m], and
    the play of the suspension's spring, either way [m].
    """

    body_kg: float = 2.5
    wheel_kg: float = 0.4
    spring: float = 900.0
    damper: float = 12.0
    tire: float = 5400.0
    friction_n: float = 0.0
    cubic: float = 0.0
    wheel_guide_n: float = 0.0
    body_guide_n: float = 0.0
    tire_damper: float = 0.0
    gap_m: float = 0.0

    def vehicle_yaml(self, off: float = 1.0) -> str:
        """Its file, with masses and springs that are ``off`` by a factor; of friction it says nothing."""
        return (f"name: bench\nmodel: quarter_car\nsprung_mass_kg: {self.body_kg * off}\nfront:\n"
                f"  unsprung_mass_kg: {self.wheel_kg}\n  suspension_stiffness_n_per_m: {self.spring / off}\n"
                f"  suspension_damping_n_s_per_m: {self.damper}\n  tire_stiffness_n_per_m: {self.tire}\n"
                "contact_patch_m: 0\neffects: []\n")


@dataclass(frozen=True, eq=False)
class Recorded:
    """At RATE_HZ: times, the table's height, accelerations of body and wheel, extension of the suspension."""

    time_s: Array
    elevation_m: Array
    body_mps2: Array
    wheel_mps2: Array
    travel_m: Array


def random_table(lasts_s: float, seed: int, rms_m: float = 0.002) -> Array:
    """Height of the table (n,) at RATE_HZ [m]: random between 1 and 25 Hz, falling by 1 / f."""
    n = round(lasts_s * RATE_HZ)
    rng = np.random.default_rng(seed)
    f_hz = np.fft.rfftfreq(n, 1 / RATE_HZ)
    size = np.where((f_hz > 1.0) & (f_hz < 25.0), 1 / np.maximum(f_hz, 1.0), 0.0)
    z = np.fft.irfft(size * np.exp(2j * np.pi * rng.random(len(f_hz))), n)
    return np.asarray(z * rms_m / z.std() * np.minimum(np.arange(n) / RATE_HZ, 1.0))


def swept_table(lasts_s: float, from_hz: float = 1.0, to_hz: float = 25.0, at_one_hz_m: float = 0.004) -> Array:
    """Height of the table (n,) at RATE_HZ [m]: a sweep whose height falls by 1 / f."""
    t = np.arange(round(lasts_s * RATE_HZ)) / RATE_HZ
    f_hz = from_hz * (to_hz / from_hz) ** (t / lasts_s)
    return np.asarray(at_one_hz_m / f_hz * chirp(t, from_hz, lasts_s, to_hz, "logarithmic", phi=-90.0)
                      * np.minimum(t, 1.0))


def shaken(rig: Rig, elevation_m: Array) -> Recorded:
    """What sensors on the rig say, without noise."""
    time_s = np.arange(len(elevation_m)) / RATE_HZ
    table = Course(RATE_HZ, elevation_m)

    def forces(t: Any, x: Any) -> tuple[Any, Any]:
        travel, rate = x[0] - x[1], x[2] - x[3]
        between = (rig.spring * (travel - np.clip(travel, -rig.gap_m, rig.gap_m)) + rig.cubic * travel**3
                   + rig.damper * rate + rig.friction_n * np.tanh(rate / SLIP_MPS))
        tire = rig.tire * (table(t) - x[1]) + rig.tire_damper * (table(t, 1) - x[3])
        return (-between - rig.body_guide_n * np.tanh(x[2] / SLIP_MPS),
                between + tire - rig.wheel_guide_n * np.tanh(x[3] / SLIP_MPS))

    def motion(t: float, x: list[float]) -> list[float]:
        on_body, on_wheel = forces(t, x)
        return [x[2], x[3], on_body / rig.body_kg, on_wheel / rig.wheel_kg]

    dense = 4
    fine_s = np.arange((len(time_s) - 1) * dense + 1) / RATE_HZ / dense
    x = integrated(motion, 4, fine_s, 1e-7, 1e-10, 0.002)
    on_body, on_wheel = forces(fine_s, x)
    body, wheel = on_body / rig.body_kg, on_wheel / rig.wheel_kg
    return Recorded(time_s, elevation_m, *(_sampled(one, dense) for one in (body, wheel, x[0] - x[1])))


def _sampled(fine: Array, dense: int) -> Array:
    """Every ``dense``-th sample behind a low pass of linear phase."""
    from scipy.signal import firwin

    taps = firwin(201, 220.0, fs=RATE_HZ * dense)
    padded = np.pad(fine, 100, mode="edge")
    return np.asarray(np.convolve(padded, taps, "valid")[::dense])


def write_run(folder: Path, seen: Recorded, noise_mps2: float, seed: int, more: dict[str, Array] | None = None) -> None:
    """A run's folder, with noise on the body's acceleration; ``more`` columns as they are."""
    rng = np.random.default_rng(seed)
    columns = {"t_s": seen.time_s, "accel_z_mps2": seen.body_mps2 + rng.normal(0, noise_mps2, len(seen.time_s)),
               **(more or {})}
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder / "drive.csv", columns)
    _write(folder / "excitation.csv", {"t_s": seen.time_s, "elevation_m": seen.elevation_m})


def _write(path: Path, columns: dict[str, Array]) -> None:
    np.savetxt(path, np.stack(list(columns.values()), axis=1), "%.9g", ",", header=",".join(columns), comments="")
