"""Fig 4.19 and 4.20: a bump's input and output, in a window of 15 m and of 100 m (4.4.1.1)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.checks import Statement, Word, about
from logger.studies.drives import BUMP_HEIGHT_M, BUMP_MPS, Conditions, bump, rav4, record_of, until
from logger.studies.study import Column, Effort, Picture, Result, Study, Table, alike
from logger.vehicle.models import structure_of

WINDOWS_M = (15.0, 100.0)
PRINTED_IRI = 5.0
_BUMP_AT_M = 5.0
_BUMP_ENDS_M = 15.0  # both axles are over it and the body has swung out


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    (whole,) = (record_of(bump(_BUMP_AT_M), BUMP_MPS, (WINDOWS_M[-1] + 1) / BUMP_MPS,
                          Conditions(iri_m_per_km=PRINTED_IRI)) for _ in effort.each(range(1)))
    wheelbase_m = float(np.max(structure_of(rav4()).behind_m))
    rows, pictures = [], []
    values: list[Statement] = []
    road = float(np.std(whole.measured_mps2[whole.distance_m >= _BUMP_ENDS_M]))
    for figure, window in zip(("4.19", "4.20"), WINDOWS_M, strict=True):
        record = until(whole, window)
        time_s = np.arange(len(record.distance_m)) / record.rate_hz
        over = record.distance_m < _BUMP_ENDS_M
        rms = [float(np.sqrt(np.mean(record.measured_mps2[part] ** 2))) if part.any() else None
               for part in (over, ~over)]
        share = float(np.sum(record.measured_mps2[over] ** 2) / np.sum(record.measured_mps2**2))
        rows.append((window, float(time_s[-1]), float(np.abs(record.measured_mps2).max()), *rms, 100 * share))
        inputs = {name: 1000 * bump(_BUMP_AT_M)(record.distance_m - behind_m)
                  for name, behind_m in (("front", 0.0), ("rear", wheelbase_m))}
        pictures += [
            Picture(Curves(f"Input in a window of {window:g} m (Fig {figure})", "time [s]",
                           "elevation under the tire [mm]",
                           tuple(Line(name, time_s, one) for name, one in inputs.items())),
                    "the bump under the front and under the rear tires, as functions of time"),
            Picture(Curves(f"Output in a window of {window:g} m (Fig {figure})", "time [s]", "acceleration [m/s2]",
                           (Line("body", time_s, record.measured_mps2),)),
                    "the acceleration on a road that is rough around the bump")]
        behind_s = float(time_s[inputs["rear"].argmax()] - time_s[inputs["front"].argmax()])
        values += about(f"Fig {figure}", [
            Statement("length of the record [m]", f"a range of {window:g} m", float(record.distance_m[-1]),
                      window - 0.1,
                      window, Word.NOT_REPRODUCIBLE),
            Statement("rear bump's top behind the front's, over wheelbase by speed", "one input for each axle",
                      behind_s * BUMP_MPS / wheelbase_m, 0.97, 1.03, Word.NOT_REPRODUCIBLE),
            Statement("peak over the r.m.s. that the road leaves behind the bump", "the road's roughness is noise that "
                      "is added", float(np.abs(record.measured_mps2).max()) / road, 3.0, word=Word.NOT_REPRODUCIBLE)])
    table = Table("Response in the two windows (printed as pictures only)", (
        Column("window [m]", ".0f"), Column("lasts [s]", ".1f"), Column("peak [m/s2]", ".2f"),
        Column("r.m.s. over the bump [m/s2]", ".2f"), Column("r.m.s. behind it [m/s2]", ".2f"),
        Column("share of the power that is the bump's [%]", ".0f")), tuple(rows))
    verdict = (f"As the text describes it: bumps of {1000 * BUMP_HEIGHT_M:.0f} mm, the rear axle's "
               f"{wheelbase_m / BUMP_MPS:.2f} s behind the front's, and a response that stands far above the road's "
               f"shaking; in 100 m {rows[1][-1]:.0f} % of its power are still the bump's. The source's own bump and "
               "road of these figures are not given, so no number can be compared.")
    return Result((table,), verdict, tuple(pictures), tuple(values))


STUDY = Study("fig_4_19", "A bump's input and output in windows of 15 and 100 m", "Fig 4.19, section 4.4.1.1",
              "Simulated as in the source: the bump of 5.5.2 (the text gives no size) at 16.1 km/h on a road of IRI 5 "
              "m/km that the input leaves out; sensor noise 0.05 m/s2.", run,
              items=alike(("Fig 4.19", "Fig 4.20"), Word.NOT_REPRODUCIBLE,
                          "Bump, speed and road of the figures are not printed; simulated, the response is as "
                          "described."))
