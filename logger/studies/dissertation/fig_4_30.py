"""Fig 4.30: input and output of a bridge's step (4.4.5)."""

import numpy as np
import numpy.typing as npt

from logger.chart_data import Curves, Line
from logger.studies.checks import Statement, Word
from logger.studies.drives import BRIDGE_MPS, STEP_M, Array, Conditions, bridge, rav4, record_of
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table
from logger.vehicle.models import structure_of

_STEP_AT_M, _SECONDS = 10.0, 4.0
_STILL = 0.02  # of the peak: the body has swung out


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    (record,) = (record_of(bridge(_STEP_AT_M), BRIDGE_MPS, _SECONDS, Conditions(noise_mps2=0.0))
                 for _ in effort.each(range(1)))
    wheelbase_m = float(np.max(structure_of(rav4()).behind_m))
    accel, time_s = record.measured_mps2, np.arange(len(record.measured_mps2)) / record.rate_hz
    front_s = _STEP_AT_M / BRIDGE_MPS
    front = (time_s >= front_s) & (time_s < front_s + wheelbase_m / BRIDGE_MPS)
    peaks = [float(np.abs(accel[part]).max()) for part in (front, time_s >= front_s + wheelbase_m / BRIDGE_MPS)]
    shaken_s = float(time_s[np.abs(accel) > _STILL * max(peaks)].max()) - front_s
    table = Table("A step of 38.1 mm at 48.3 km/h (printed as a picture only)", (
        Column("rear axle behind the front [s]", ".3f"), Column("peak from the front axle [m/s2]", ".2f"),
        Column("from the rear axle [m/s2]", ".2f"), Column("shaken for [s]", ".1f")),
        ((wheelbase_m / BRIDGE_MPS, *peaks, shaken_s),))
    verdict = (f"Two steps, {wheelbase_m / BRIDGE_MPS:.2f} s apart, and two blows that the body swings out "
               f"of within {shaken_s:.1f} s. Height and speed of the printed figure are not given, nor "
               "what it looks like; those of the analysis that follows it are taken.")
    pictures = (Picture(Curves("Input", "time [s]", "elevation under the tire [mm]", tuple(
        Line(name, time_s, 1000 * bridge(_STEP_AT_M, STEP_M)(record.distance_m - behind_m))
        for name, behind_m in (("front", 0.0), ("rear", wheelbase_m)))), "the step as the input of the model"),
        Picture(Curves("Output", "time [s]", "acceleration [m/s2]", (Line("body", time_s, accel),)),
                "the simulated response to it"))
    later_s = _blow_s(accel, time_s, ~front) - _blow_s(accel, time_s, front)
    values = (Statement("second blow behind the first, over wheelbase by speed", "a step as the input of both axles",
                        later_s * BRIDGE_MPS / wheelbase_m, 0.9, 1.1, Word.NOT_REPRODUCIBLE),
              Statement("share of the acceleration's energy within 1 s of the step", "easily located by the response",
                        float(np.sum(accel[(time_s >= front_s) & (time_s < front_s + 1)] ** 2) / np.sum(accel**2)), 0.9,
                        word=Word.NOT_REPRODUCIBLE))
    return Result((table,), verdict, pictures, values)


def _blow_s(accel: Array, time_s: Array, part: npt.NDArray[np.bool_]) -> float:
    """When the acceleration is largest within a part of the record [s]."""
    return float(time_s[part][np.abs(accel[part]).argmax()])


STUDY = Study("fig_4_30", "Input and output of a bridge's step", "Fig 4.30, section 4.4.5",
              "Simulated: the car of Table 4.2 over a step of 38.1 mm at 48.3 km/h, no roughness, no noise.", run,
              items=(Item("Fig 4.30", Word.NOT_REPRODUCIBLE,
                          "Height and speed of the figure are not printed; it is simulated under those of Fig 4.31."),))
