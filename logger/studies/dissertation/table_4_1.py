"""Table 4.1: the quarter car, and its natural frequencies (4.3.3)."""

import numpy as np

from logger.studies.checks import Value, Word
from logger.studies.study import Cell, Column, Effort, Item, Result, Study, Table
from logger.vehicle.modes import modes, undamped_frequencies_hz
from logger.vehicle.quarter_car import GOLDEN_CAR, structure
from logger.vehicle.structure import Structure

PRINTED_HZ, PRINTED_DAMPING = (1.2, 11.0), 0.40
COLUMNS = (Column("motion"), Column("printed [Hz]", ".1f"), Column("undamped, coupled [Hz]", ".3f"),
           Column("springs and tires in series [Hz]", ".3f"), Column("as it rings [Hz]", ".3f"),
           Column("printed damping", ".2f"), Column("in series, damping", ".3f"), Column("as it rings, damping", ".3f"))


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    car = structure(GOLDEN_CAR)
    (rows,) = (quoted(car, ("body", "wheel"), PRINTED_HZ, (PRINTED_DAMPING, None)) for _ in effort.each(range(1)))
    verdict = ("The printed frequencies are those of the coupled car without its damper, to their last figure. The "
               "printed damping ratio is, nearly, that of a body on spring and tire in series with the damper beside "
               "them: 0.395, which rounds to 0.39. As the car rings, its wheel swinging along, the body's damping is a "
               "sixth less.")
    return Result((Table("Vibrations of the Golden Car", COLUMNS, rows),), verdict, (), quoted_values(rows))


def quoted_values(rows: tuple[tuple[Cell, ...], ...], damping_within: float = 0.01) -> tuple[Value, ...]:
    """The printed frequencies beside the undamped ones, and damping ratios beside those in series, of rows as
    ``quoted`` gives them; tolerances are half of the printed last figure, 1.2 Hz and 11 Hz."""
    values = []
    for name, printed_hz, coupled_hz, _series, _rings, printed_damping, damping, _ringing in rows:
        if isinstance(printed_hz, float) and isinstance(coupled_hz, float):
            values.append(Value(f"{name} [Hz]", printed_hz, coupled_hz, 0.05 if printed_hz < 10 else 0.5))
        if isinstance(printed_damping, float) and isinstance(damping, float):
            values.append(Value(f"{name}, damping ratio", printed_damping, damping, damping_within))
    return tuple(values)


def quoted(car: Structure, names: tuple[str, ...], printed_hz: tuple[float | None, ...],
           printed_damping: tuple[float | None, ...]) -> tuple[tuple[Cell, ...], ...]:
    """Rows of ``COLUMNS``: each vibration in the ways of quoting it, the slowest first, bodies before wheels."""
    bodies = len(car.mass) - len(car.behind_m)
    above, wheels = slice(None, bodies), slice(bodies, None)
    stiffness = car.stiffness[above, above] - car.stiffness[above, wheels] @ np.linalg.solve(
        car.stiffness[wheels, wheels], car.stiffness[wheels, above])
    k, c, m = (np.diag(matrix)[:bodies] for matrix in (stiffness, car.damping, car.mass))
    nothing: list[float | None] = [None] * (len(car.mass) - bodies)
    in_series = zip((*(np.sqrt(k / m) / (2 * np.pi)).tolist(), *nothing),
                    (*(c / (2 * np.sqrt(k * m))).tolist(), *nothing), strict=True)
    return tuple((name, hz, coupled, series_hz, mode.damped_frequency_hz, damping, series_damping, mode.damping_ratio)
                 for name, hz, coupled, (series_hz, series_damping), mode, damping in zip(
                     names, printed_hz, undamped_frequencies_hz(car).tolist(), in_series, modes(car), printed_damping,
                     strict=True))


STUDY = Study("table_4_1", "Natural frequencies of the quarter car (the Golden Car)", "Table 4.1, section 4.3.3",
              "The eigenvalues of Table 4.1's car.", run,
              items=(Item("Table 4.1", Word.AGREES,
                          "The frequencies agree to their last printed figure, the damping ratio within 0.005."),))
