"""Chapter 4: cars, and roads made at random. Names of one item end in its number.

Table 4.1: the quarter car, and its natural frequencies (4.3.3).

Table 4.2: the half car, and its natural frequencies (4.3.3).

Table 4.3: degree of roughness and IRI of ISO 8608's classes, and the relation between them (4.3.4).

Fig 4.3 to 4.5: roads of two qualities, and how high roads are by their degree of roughness (4.2.2).

Fig 4.16 and 4.17: IRI of 400 random roads by their degree of roughness, and Eq 4.39 (4.3.4).

Fig 4.18: roads generated for an IRI, and the IRI that they have (4.3.4).
"""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads import iso8608
from logger.roads.elevation_spectrum import classify, iri_of_road, relative_spread
from logger.roads.iri import iri
from logger.studies.drives import rav4
from logger.studies.study import (
    Cell,
    Check,
    Column,
    Item,
    Picture,
    Result,
    Statement,
    Study,
    Table,
    Value,
    Word,
    Workload,
    about,
    alike,
)
from logger.vehicle.models import GOLDEN_CAR, quarter_car, structure_of
from logger.vehicle.modes import modes, undamped_frequencies_hz
from logger.vehicle.structure import Structure

COLUMNS = (Column("motion"), Column("printed [Hz]", ".1f"), Column("undamped, coupled [Hz]", ".3f"),
           Column("springs and tires in series [Hz]", ".3f"), Column("damped, coupled [Hz]", ".3f"),
           Column("printed damping", ".2f"), Column("in series, damping", ".3f"), Column("coupled, damping", ".3f"))


def _t4_1(effort: Workload) -> Result:
    printed_hz = (1.2, 11.0)
    car = quarter_car(GOLDEN_CAR)
    (rows,) = (quoted(car, ("body", "wheel"), printed_hz, (0.40, None)) for _ in effort.each(range(1)))
    verdict = ("The printed frequencies are those of the coupled car without its damper, to the last digit. The "
               "printed damping ratio is nearly that of a body on spring and tire in series, with the damper parallel "
               "to both: 0.395, printed 0.39. In the coupled car, whose wheel moves too, the damping ratio of the "
               "body is a sixth smaller.")
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


T4_1 = Study("table_4_1", "Natural frequencies of the quarter car (the Golden Car)", "Table 4.1, section 4.3.3",
              "The eigenvalues of Table 4.1's car.", _t4_1,
              items=(Item("Table 4.1", Word.AGREES,
                          "The frequencies agree to the last printed digit, the damping ratio within 0.005."),))


def _t4_2(effort: Workload) -> Result:
    printed_hz = (1.1, 11.0)
    printed_mass_kg = 875.0
    names, (bounce_hz, hop_hz) = ("body bounces", "body pitches", "wheels", "wheels"), printed_hz
    (rows,) = (quoted(structure_of(rav4()), names, (bounce_hz, None, hop_hz, None), (0.30, None, None, None))
               for _ in effort.each(range(1)))
    curb_kg, person_kg = 1524.07, 72.57
    by_eq = (curb_kg / 1.15 + 2 * person_kg) / 2
    verdict = ("1.1 and 11 Hz are the undamped frequencies of bounce and wheels; the pitch, 1.45 Hz, is not named. "
               "The damping ratio of 0.30 is 0.29 with springs and tires in series, 0.28 on the springs alone, "
               "rounded. The mass does not follow from the text: by Eq 4.36, half of the car with two people has "
               f"{by_eq:.0f} kg, not {printed_mass_kg:.0f}; the published 875 kg is used. The inertia is in kg m2, not "
               "kg/m2; and the pitch rows of Eq 4.23 to 4.25 have wrong signs, those of Appendix A.2 are right.")
    values = (*quoted_values(rows, damping_within=0.015),
              Value("half of the car with two people, Eq 4.36 [kg]", printed_mass_kg, by_eq, 1.0, Word.MISPRINT,
                    of_print=True))
    return Result((Table("Vibrations of the half car", COLUMNS, rows),), verdict, (), values)


T4_2 = Study("table_4_2", "Natural frequencies of the half car (RAV4)", "Table 4.2, section 4.3.3",
              "The eigenvalues of Table 4.2's car.", _t4_2,
              items=(Item("Table 4.2", Word.MISPRINT,
                          "Frequencies and damping agree; the mass does not follow from Eq 4.36, and the inertia's "
                          "unit is kg m2."),))


PRINTED_T4_3 = (("A", 32.0, 3.05), ("B", 128.0, 6.09), ("C", 512.0, 12.19), ("D", 2048.0, 24.37))


def _t4_3(effort: Workload) -> Result:
    length_m, spacing_m = 1000.0, 0.05
    roads = effort.count(60, 4)
    # One seed is one set of phases: the roads of all classes are alike but for their level.
    found = np.array([[iri(iso8608.generate(gd, length_m, spacing_m, seed), spacing_m) for _, gd, _ in PRINTED_T4_3]
                      for seed in effort.each(range(roads))])
    mean, std = found.mean(axis=0), found.std(axis=0)
    gds = np.array([gd for _, gd, _ in PRINTED_T4_3])
    rows = tuple((name, gd, limit, float(one), float(spread), iri_of_road(gd, length_m).value)
                 for (name, gd, limit), one, spread in zip(PRINTED_T4_3, mean, std, strict=True))
    table = Table("Upper limits of the classes", (
        Column("class"), Column("printed Gd(n0) [cm3]", ".0f"), Column("printed IRI [m/km]", ".2f"),
        Column(f"ours, mean of {roads} roads of 1 km [m/km]", ".2f"),
        Column("standard deviation between roads [m/km]", ".2f"), Column("ours, computed [m/km]", ".3f")), rows)
    power = float(np.polyfit(np.log(gds), np.log(mean), 1)[0])
    factor = float((mean / np.sqrt(gds)).mean())
    relation = Table("IRI = c Gd^b", (Column("number"), Column("printed, Eq 4.39", ".4f"),
                                      Column("ours, generated", ".4f"), Column("ours, computed", ".4f")),
                     (("c", iso8608.IRI_PER_ROOT_GD, factor, iri_of_road(1.0, length_m).value), ("b", 0.5, power, 0.5)))
    verdict = (f"The relation agrees: {factor:.4f} beside the printed {iso8608.IRI_PER_ROOT_GD}, and the power is one "
               "half because the IRI's car is linear. The rest is the choice of roads: computed for waves of 0.011 to "
               "2.83 cycle/m, the factor is 0.543. The relation holds only for a waviness of 2 and long roads; roads "
               "of 100 m scatter by 10 % about it.")
    picture = Picture(Curves("IRI of roads by degree of roughness", "root of Gd(n0) [cm^1.5]", "IRI [m/km]", (
        Line("Eq 4.39", np.sqrt(gds), iso8608.IRI_PER_ROOT_GD * np.sqrt(gds)),
        Line("ours", np.sqrt(gds), mean, dots=True))),
        "no figure, a table of the upper limits of classes A to D")
    # Sixty roads leave an average in doubt by half a per cent, a few by more; the choice of waves makes one per cent.
    within = 0.01 + 3 * iri_of_road(1.0, length_m).std / iri_of_road(1.0, length_m).value / roads**0.5
    values = (*(Value(f"class {name}, upper limit [m/km]", limit, float(one), within * limit)
                for (name, _, limit), one in zip(PRINTED_T4_3, mean, strict=True)),
              Value("c of IRI = c Gd^b", iso8608.IRI_PER_ROOT_GD, factor, within * iso8608.IRI_PER_ROOT_GD),
              Value("b of IRI = c Gd^b", 0.5, power, 1e-3))
    return Result((table, relation), verdict, (picture,), values)


T4_3 = Study("table_4_3", "Degree of roughness and IRI, and Eq 4.39", "Table 4.3, section 4.3.4",
              "Random roads of ISO 8608 as in the source, of 1 km; exact IRI of ASTM E1926.", _t4_3,
              items=(Item("Table 4.3", Word.AGREES, "The relation agrees within the choice of random roads."),))


_FIGURES = {16.0: ("Fig 4.3", "Fig 4.5"), 256.0: ("Fig 4.4", "Fig 4.5")}


def _f4_3(effort: Workload) -> Result:
    printed = ((16.0, "very good"), (256.0, "poor"))
    printed_poor_cm3 = (512.0, 2048.0)  # Class D, a poor road by 4.3.4.
    gd_cm3 = (1.0, 4.0, 16.0, 64.0, 256.0, 1024.0)
    length_m, spacing_m = 1000.0, 0.1
    tolerance = 0.05  # of the mean over roads; at Gd of one road's length the longest waves are not averaged out
    roads = effort.count(60, 12)
    rows = []
    values: list[Check] = []
    for gd in effort.each(gd_cm3):
        rms_mm = np.array([1000 * float(np.std(iso8608.generate(gd, length_m, spacing_m, seed)))
                           for seed in range(roads)])
        expected = 1000 * _rms_m(gd)
        quality = dict(printed).get(gd)
        rows.append((gd, iso8608.road_class(gd), quality, expected, float(rms_mm.mean()), float(rms_mm.std())))
        values += about(_FIGURES.get(gd, ("Fig 4.5",)), [
            Value(f"r.m.s. elevation at {gd:.0f} cm3, of Eq 4.2 and ours [mm]", expected, float(rms_mm.mean()),
                  tolerance * expected)])
    values += about("Fig 4.4", [Statement("Gd of the road [cm3]", "poor, as a road of class D in 4.3.4",
                                          printed[1][0],
                                          *printed_poor_cm3, Word.MISPRINT)])
    # Without 2 pi every wave is 2 pi times as long, and there are 2 pi times as many in a step of wave number.
    asked = printed[1][0]
    values += about("Eq 4.1", [Value(
        f"Gd(n0) of a road made for {asked:.0f} cm3, by Eq 4.1 as printed [cm3]", asked / (2 * np.pi),
        classify(iso8608.generate(asked, length_m, spacing_m, 0), spacing_m).gd_n0_cm3, asked / 4,
        Word.MISPRINT)])
    table = Table(f"R.m.s. elevation of {roads} roads of 1 km", (
        Column("Gd(n0) [cm3]", ".0f"), Column("class"), Column("printed quality"),
        Column("sum of Eq 4.2's amplitudes [mm]", ".2f"), Column("ours, mean [mm]", ".2f"),
        Column("standard deviation between roads [mm]", ".2f")), tuple(rows))
    verdict = ("The r.m.s. elevation of generated roads is that of Eq 4.2's amplitudes, in proportion to the square "
               "root of the degree of roughness. Of Fig 4.5 the text says that its means are those of earlier work "
               "and that its scatter is large; here roads of 1 km with all waves of Eq 4.2 scatter by 2 %. A road of "
               "256 cm3 is of class C, which the text calls poor here; in 4.3.4 it calls class D poor. Its ISO 8606 "
               "is ISO 8608. The argument of Eq 4.1 lacks 2 pi (Appendix A has it), its phases are uniform, not "
               "normal, and N waves at equal steps repeat after one over the step. Ours chooses the step for the "
               "road's length, so that nothing repeats.")
    place = np.arange(0, 200.0, 0.5)
    shown = tuple(Line(f"{gd:.0f} cm3, {quality}", place, 1000 * iso8608.generate(gd, 200.0, 0.5, 0)[: len(place)])
                  for gd, quality in printed)
    gds = np.array(gd_cm3)
    means, stds = (np.array([row[at] for row in rows], dtype=float) for at in (4, 5))
    pictures = (Picture(Curves("Two roads (Fig 4.3, 4.4)", "distance [m]", "elevation [mm]", shown),
                        "two figures of generated profiles, 16 cm3 and 256 cm3"),
                Picture(Curves("R.m.s. elevation and its scatter (Fig 4.5)", "Gd(n0) [cm3]", "r.m.s. elevation [mm]", (
                    Line("ours", gds, means, stds), Line("Eq 4.2", gds, np.array([1000 * _rms_m(gd) for gd in gd_cm3]),
                                                         dots=True)), log_x=True, log_y=True),
                    "r.m.s. elevations of generated profiles from 1 to 1024 cm3, their means near those of Da Silva "
                    "(2004), with a large scatter"))
    return Result((table,), verdict, pictures, tuple(values))


def _rms_m(gd_n0_cm3: float) -> float:
    """Root of the integral of Eq 2.1 with a waviness of 2 over the waves of 4.2.1: what Eq 4.2 adds up to."""
    return float(np.sqrt(gd_n0_cm3 * iso8608.CM3_M3 * iso8608.REFERENCE_N0_CPM**2
                         * (1 / iso8608.LOWEST_CPM - 1 / iso8608.HIGHEST_CPM)))


F4_3 = Study("fig_4_3", "Generated roads and their r.m.s. elevation", "Fig 4.3, section 4.2.2",
              "Random roads of 1 km; the printed comparison with a figure of Da Silva (2004) has no numbers, so ours "
              "are compared with the sum of the amplitudes of Eq 4.2, worked out by hand.", _f4_3,
              items=(Item("Fig 4.3", Word.AGREES,
                          "A generated road of 16 cm3 has the r.m.s. elevation of Eq 4.2 and is of class A."),
                     Item("Fig 4.4", Word.MISPRINT, "A road of 256 cm3 is of class C; 4.3.4 calls class D poor."),
                     Item("Fig 4.5", Word.AGREES,
                          "The mean elevations are those of Eq 4.2, in proportion to the root of the degree of "
                          "roughness."),
                     Item("Eq 4.1", Word.MISPRINT, "Its argument lacks 2 pi, which Appendix A has: n is in cycle/m.")))


def _f4_16(effort: Workload) -> Result:
    printed_power = 0.5
    range_cm3 = (2.0, 4096.0)
    sets, length_m, spacing_m = 4, 500.0, 0.1
    roads = effort.count(100, 12)
    gd = np.geomspace(*range_cm3, roads)
    found = np.array([[iri(iso8608.generate(one, length_m, spacing_m, number * roads + place), spacing_m)
                       for place, one in enumerate(gd.tolist())] for number in effort.each(range(sets))])
    fits = [_power_law(gd, one) for one in found]
    power, factor = _power_law(np.tile(gd, sets), found.ravel())
    # From road to road the IRI of so short a road has this spread, so the regression has these standard errors.
    spread = iri_of_road(1.0, length_m).std / iri_of_road(1.0, length_m).value
    terms = np.column_stack([np.ones(sets * roads), np.log(np.tile(gd, sets))])
    factor_std, power_std = (spread * np.sqrt(np.diag(np.linalg.inv(terms.T @ terms)))).tolist()
    values = about(("Fig 4.16", "Fig 4.17"), [
        Value("c of IRI = c Gd^b", iso8608.IRI_PER_ROOT_GD, factor, 0.01 + 3 * factor * factor_std),
        Value("b of IRI = c Gd^b", printed_power, power, 3 * power_std)])
    table = Table(f"Power laws through {roads} roads each", (Column("set"), Column("c", ".4f"), Column("b", ".4f")),
                  (*((f"ours, {number + 1}", one[1], one[0]) for number, one in enumerate(fits)),
                   ("ours, all", factor, power), ("printed, Eq 4.39", iso8608.IRI_PER_ROOT_GD, printed_power),
                   ("ours, computed", iri_of_road(1.0, length_m).value, 0.5)))
    verdict = (f"Four sets of {roads} roads scatter about a power law, {factor:.3f} Gd^{power:.3f} here beside 0.5386 "
               "Gd^0.5, which is a straight line on logarithmic axes as printed. The tolerance is three standard "
               "errors of the regression (the length of the printed roads is not given; ours have 500 m and differ by "
               f"{100 * spread:.0f} % from road to road), and 0.01 for the choice of waves: computed over 0.011 to "
               "2.83 cycle/m the factor is 0.543.")
    dots = tuple(Line(f"set {number + 1}", gd, one, dots=True) for number, one in enumerate(found))
    law = Line("Eq 4.39", gd, iso8608.IRI_PER_ROOT_GD * gd**printed_power)
    pictures = tuple(Picture(Curves(title, "Gd(n0) [cm3]", "IRI [m/km]", (*dots, law), log_x=logarithmic,
                                    log_y=logarithmic), printed)
                     for title, logarithmic, printed in (
                         ("IRI by degree of roughness (Fig 4.16)", False, "four sets of 100 dots and their trendline"),
                         ("The same on logarithmic axes (Fig 4.17)", True, "the same, on a straight line")))
    return Result((table,), verdict, pictures, values)


def _power_law(gd: np.ndarray, iri_m_per_km: np.ndarray) -> tuple[float, float]:
    """Power and factor of Eq 4.37."""
    power, level = np.polyfit(np.log(gd), np.log(iri_m_per_km), 1)
    return float(power), float(np.exp(level))


F4_16 = Study("fig_4_16", "IRI of 400 random roads by their degree of roughness", "Fig 4.16, section 4.3.4",
              "Four sets of 100 random roads of 2 to 4096 cm3 as in the source, each with phases of its own; exact IRI "
              "of ASTM E1926.", _f4_16,
              items=alike(("Fig 4.16", "Fig 4.17"), Word.AGREES,
                          "The power law through the roads agrees with Eq 4.39 within their random scatter."))


def _f4_18(effort: Workload) -> Result:
    wanted_m_per_km = tuple(float(one) for one in range(1, 21))
    length_m, spacing_m = 500.0, 0.1
    wanted = np.array(effort.some(wanted_m_per_km, 10))
    found = np.array([[iri(iso8608.generate(iso8608.gd_n0_from_iri(one), length_m, spacing_m, 1000 * number + place),
                           spacing_m)
                       for place, one in enumerate(wanted.tolist())] for number in effort.each(range(2))])
    slopes = [float(one @ wanted / (wanted @ wanted)) for one in found]
    alike_sets = [float(np.corrcoef(wanted, one)[0, 1]) for one in found]
    # A slope is a mean of the roads' relative errors with weights that grow as the square of the IRI.
    chance = relative_spread(length_m) * float(np.sqrt((wanted**4).sum()) / (wanted**2).sum())
    values: tuple[Check, ...] = (*(Value(f"set {number + 1}, IRI found per IRI wanted", 1.0, slope, 0.01 + 3 * chance)
                for number, slope in enumerate(slopes)),
              Statement("correlation, the smaller of both sets", "highly linear", min(alike_sets), least=0.95))
    table = Table("IRI of generated roads", (Column("printed: wanted [m/km]", ".0f"), Column("set 1 [m/km]", ".2f"),
                                             Column("set 2 [m/km]", ".2f")),
                  tuple((one, *pair) for one, pair in zip(wanted.tolist(), found.T.tolist(), strict=True)))
    spread = relative_spread(length_m)
    verdict = (f"As printed, highly linear: correlation {min(alike_sets):.3f} and {max(alike_sets):.3f}, slopes "
               f"{slopes[0]:.3f} and {slopes[1]:.3f}. A road of 500 m generated for an IRI has that IRI within "
               f"{100 * spread:.0f} % r.m.s., which is why the source shows two sets; the tolerance is three standard "
               "errors of the slope, and 1 % for Eq 4.40. The exact IRI of ASTM E1926, which agrees with the "
               "published check profile, replaces ProVAL's.")
    picture = Picture(Curves("IRI of roads generated for an IRI", "IRI wanted [m/km]", "IRI [m/km]", (
        Line("as wanted", wanted, wanted), *(Line(f"set {number + 1}", wanted, one, dots=True)
                                             for number, one in enumerate(found)))),
        "two sets of roads, their IRI by ProVAL against the one wanted, highly linear")
    return Result((table,), verdict, (picture,), values)


F4_18 = Study(
    "fig_4_18", "IRI of roads generated for a given IRI", "Fig 4.18, section 4.3.4",
    "Two sets of random roads of 500 m for an IRI of 1 to 20 m/km by Eq 4.40; exact IRI in place of ProVAL.", _f4_18,
    items=(Item("Fig 4.18", Word.AGREES, "Roads generated for an IRI have it, within the random scatter of roads of "
                                         "that length."),))

STUDIES = (T4_1, T4_2, T4_3, F4_3, F4_16, F4_18)
