"""Chapter 6: roughness and comfort from acceleration. Names of one item end in its number.

Fig 6.3 to 6.8: r.m.s. acceleration by roughness at each speed, with passengers and with twice the mass (6.3).

Fig 6.9 to 6.15: IRI from acceleration beside the exact one, at seven speeds and in windows (6.3.1).

Fig 6.16, 6.17: comfort by roughness and speed (6.4).

Fig 6.19 to 6.24 and Table D.1: 37 road segments at their speeds, as a map of roughness and one of comfort (6.5).
"""

from collections.abc import Sequence

import numpy as np

from logger.chart_data import Curves, Field, Line
from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.estimation import rms_calibration
from logger.profiles.track import Track
from logger.roads.iri import iri
from logger.roads.iso8608 import IRI_PER_ROOT_GD
from logger.roads.sections import ROAD_RANGES
from logger.runs import Run
from logger.studies.dissertation.chapter_2 import PRINTED_RANGES
from logger.studies.drives import (
    PS_2119,
    Array,
    Conditions,
    Figures,
    comfort_shares,
    drive_over,
    mean_window_by_rms,
    per_window,
    places_m,
    random_road,
    rav4,
    rms_error,
    whole_road_by_rms,
)
from logger.studies.study import (
    Cell,
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
from logger.units import FOOT_M, KMH_MPS, MPH_MPS, WINDOW_M
from logger.vehicle.linearise import known_vehicle

SPEEDS_MPH = tuple(range(10, 71, 10))
PRINTED_GD_CM3 = (2.0, 4096.0)


def _f6_6(effort: Workload) -> Result:
    speeds = np.array(SPEEDS_MPH) * MPH_MPS
    cars = (rav4(), rms_calibration.loaded(rav4(), passengers=2),
            rms_calibration.loaded(rav4(), sprung_mass_factor=2.0))
    own, two, heavy = (rms_calibration.rms_relation(known_vehicle(car), None, speeds).iri_per_accel_rms for car in cars)
    settings = rms_calibration.CalibrationSettings(tuple(speeds.tolist()), roads=effort.count(120, 10))
    (drives,) = (rms_calibration.calibrate(known_vehicle(rav4()), None, settings) for _ in effort.each(range(1)))
    rows = tuple((float(mph), slope, line.iri_per_accel_rms.slope, 100 * line.window_iri_per_accel_rms.spread,
                  *map(float, others)) for mph, slope, line, *others in
                 zip(SPEEDS_MPH, own.tolist(), drives, 100 * (two / own - 1), 100 * (heavy / own - 1), strict=True))
    table = Table("IRI per r.m.s. acceleration [m/km per m/s2] (printed as pictures only)", (
        Column("speed [mph]", ".0f"), Column("computed", ".3f"), Column("from drives", ".3f"),
        Column("spread of 25 ft windows [%]",
               ".0f"), Column(f"two people of {rms_calibration.PASSENGER_KG:g} kg more [%]", "+.1f"),
        Column("twice the mass [%]", "+.1f")), rows)
    verdict = ("Fig 6.3, a diagram, leads from the response through the vehicle to the IRI; the rest agrees with the "
               "figures: r.m.s. acceleration grows with the root of Gd(n0), whatever the length of the road, so the "
               "trendlines are straight and parallel on logarithmic axes; with Eq 4.39 that gives one line through "
               "the origin for each speed, flatter at higher speeds; more mass lowers the acceleration at every "
               "speed, so a given reading means a rougher road. The printed pictures have no numbers in the text. The "
               "line holds for long roads of waviness 2; windows of 25 ft scatter about it, and on a road of another "
               "waviness it drifts with speed (6.3.1, Fig 6.11). ridelog estimate is the better relation that the "
               "source asks for.")
    factors = [one.accel_rms_per_root_gd.slope for one in drives]
    by_gd = Table("R.m.s. acceleration by degree of roughness: a factor times the root of Gd(n0) (Fig 6.4, 6.5)", (
        Column("speed [mph]", ".0f"), Column("printed"), Column("factor [m/s2 per cm^1.5]", ".4f"),
        Column("spread of 1 km roads [%]", ".1f"), *(Column(f"at {gd:g} cm3 [m/s2]", ".3f") for gd in PRINTED_GD_CM3)),
        tuple((float(mph), "a power trendline", factor, 100 * one.accel_rms_per_root_gd.spread,
               *(factor * gd**0.5 for gd in PRINTED_GD_CM3))
              for mph, factor, one in zip(SPEEDS_MPH, factors, drives, strict=True)))
    gd_cm3 = np.geomspace(*PRINTED_GD_CM3, 40)
    rms = tuple(Line(f"{mph} mph", gd_cm3, factor * np.sqrt(gd_cm3))
                for mph, factor in zip(SPEEDS_MPH, factors, strict=True))
    axes, gd_axes = ("r.m.s. acceleration [m/s2]", "IRI [m/km]"), ("Gd(n0) [cm3]", "r.m.s. acceleration [m/s2]")
    less = "less response at every roughness and speed than in Fig 6.6"
    loads = tuple(Picture(Curves(f"{figure}: IRI by r.m.s., {what}", *axes, _fan(slopes)), less) for figure, what,
                  slopes in (("Fig 6.7", "two people more", two), ("Fig 6.8", "twice the mass", heavy)))
    pictures = (Picture(Curves("Fig 6.4: r.m.s. acceleration by degree of roughness", *gd_axes, rms),
                        "dots of simulated roads and a power trendline for each speed, higher at higher speeds"),
                Picture(Curves("Fig 6.5: the same, logarithmic", *gd_axes, rms, log_x=True, log_y=True),
                        "the same, as straight lines"),
                Picture(Curves("Fig 6.6: IRI by r.m.s. acceleration", *axes, _fan(own)),
                        "a straight line through the origin for each speed"), *loads)
    return Result((table, by_gd), verdict, pictures, (
        *about(("Fig 6.4", "Fig 6.5"), [
            Statement("exponent of the r.m.s. in Gd(n0), one road scaled to both ends of the range",
                      "a nonlinear power trendline", _power(), 0.49, 0.51),
            Statement("smallest ratio of the r.m.s. from one speed to the next", "larger response at higher speeds",
                      float(np.min(np.array(factors[1:]) / factors[:-1])), 1.0),
            Statement("r.m.s. of 1 km roads over that of infinite ones, the value farthest from 1",
                      "independent of the length",
                      float(max(np.array(factors) * own / IRI_PER_ROOT_GD, key=lambda one: abs(one - 1))), 0.95,
                      1.05)]),
        *about("Fig 6.6", [
            Statement("R2 of the line through drives, the smallest of all speeds", "a direct linear relation",
                      min(one.iri_per_accel_rms.r2 for one in drives), 0.95),
            Statement("largest ratio of the slope from one speed to the next",
                      "flatter at higher speeds, as in Fig 6.4",
                      float(np.max(own[1:] / own[:-1])), most=1.0)]),
        *(one for item, slopes in (("Fig 6.7", two), ("Fig 6.8", heavy)) for one in about(item, [
            Statement("smallest change of IRI per r.m.s. [%]", "less acceleration regardless of roughness or speed",
                      100 * float(np.min(slopes / own - 1)), 1.0)])),
        *about("Fig 6.8", [Statement("smallest change over that of two people", "an exaggerated case",
                                     float(np.min((heavy / own - 1) / (two / own - 1))), 2.0)])))


def _power() -> float:
    """Of the r.m.s. acceleration by the degree of roughness, of one road twice as far up and down, stepped in time."""
    ends = [IRI_PER_ROOT_GD * gd**0.5 for gd in PRINTED_GD_CM3]
    rms = [drive_over(random_road(iri, 100.0, 1), SPEEDS_MPH[3] * MPH_MPS, Conditions(0.0)).measured_mps2.std()
           for iri in ends]
    return float(np.log(rms[1] / rms[0]) / np.log(PRINTED_GD_CM3[1] / PRINTED_GD_CM3[0]))


def _fan(slopes: Array) -> tuple[Line, ...]:
    levels_mps2 = np.array([0.0, 2.0])
    return tuple(Line(f"{mph} mph", levels_mps2, slope * levels_mps2)
                 for mph, slope in zip(SPEEDS_MPH, slopes.tolist(), strict=True))


F6_6 = Study("fig_6_6", "IRI per r.m.s. acceleration at each speed, and the effect of load",
              "Fig 6.6 (6.3 to 6.8), section 6.3",
              "Computed from the half car of Table 4.2 and the spectrum of ISO 8608, and from simulated drives over "
              "random roads of 1 km; the source's roads have 100 m and 2 to 4096 cm3, which makes no difference for a "
              "linear car.", _f6_6,
              items=(Item("Fig 6.3", Word.NOT_REPRODUCIBLE,
                          "A diagram without values: from the response through the vehicle to the IRI."),
                     *alike(("Fig 6.4", "Fig 6.5"), Word.AGREES,
                            "The r.m.s. grows with the square root of the degree of roughness, and with the speed, as "
                            "drawn."),
                     Item("Fig 6.6", Word.AGREES,
                          "One line through the origin for each speed, flatter at higher speeds."),
                     *alike(("Fig 6.7", "Fig 6.8"), Word.AGREES, "More mass makes each line steeper.")))


PRINTED = {10: "too high", 40: "accurate", 70: "too low"}
WAVINESS = (1.6, 2.0, 2.4)
_IRI, _LENGTH_M_F6_9 = 2.5, 305.0


def _f6_9(effort: Workload) -> Result:
    windows_m = (100 * FOOT_M, 25 * FOOT_M)
    windowed_mph = 40
    speeds, roads = effort.some(SPEEDS_MPH), effort.count(6, 1)
    road = random_road(_IRI, _LENGTH_M_F6_9, 1, WAVINESS[0])
    ours = [per_window(drive_over(road, mph * MPH_MPS, PS_2119), PS_2119) for mph in effort.each(speeds)]
    drift = np.array([[_bias_percent(mph, waviness, roads) for waviness in WAVINESS] for mph in speeds])
    own = np.array([100 * (one.iri_m_per_km.mean() / one.exact_m_per_km.mean() - 1) for one in ours])
    table = Table("IRI of a whole road beside the exact one, by speed", (
        Column("speed [mph]", ".0f"), Column("printed, by r.m.s. (Fig 6.11)"),
        *(Column(f"by r.m.s., waviness {waviness:g} [%]", "+.1f") for waviness in WAVINESS),
        Column(f"ridelog estimate, waviness {WAVINESS[0]:g} [%]", "+.1f")), tuple(
        (float(mph), PRINTED.get(mph, "between"), *map(float, row), float(one))
        for mph, row, one in zip(speeds, drift, own, strict=True)))
    drive = drive_over(road, windowed_mph * MPH_MPS, PS_2119)
    cut = [per_window(drive, PS_2119, window_m) for window_m in windows_m]
    windows = Table(f"IRI per window at {windowed_mph} mph, beside the exact one", (
        Column("window [m]", ".2f"), Column("printed"), Column("windows", ".0f"),
        Column("spread of the exact IRI [m/km]", ".2f"), Column("r.m.s. error by r.m.s. relation [m/km]", ".2f"),
        Column("r.m.s. error, ridelog estimate [m/km]", ".2f"),
        Column("exact within two standard errors [%]", ".0f")),
        tuple(_row_f6_9(window_m, one) for window_m, one in zip(windows_m, cut, strict=True)))
    verdict = ("The printed drift appears, and has a cause. On a road of waviness 2, for which the line of Fig 6.6 "
               f"was made, the relation stays within {np.abs(drift[:, 1]).max():.0f} %; on one of waviness "
               f"{WAVINESS[0]:g}, with more short waves, it reads {drift[0, 0]:+.0f} % at {speeds[0]} mph and "
               f"{drift[-1, 0]:+.0f} % at {speeds[-1]}, with the printed signs, and on one of waviness "
               f"{WAVINESS[-1]:g} the reverse: a slow car responds to short waves, a fast one to long waves, and one "
               "number per window cannot show which the road had. ridelog estimate infers the road wave by wave and "
               f"stays within {np.abs(own).max():.0f} % at every speed; in windows of 25 ft its error is "
               f"{rms_error(cut[1].iri_m_per_km, cut[1].exact_m_per_km):.2f} m/km beside "
               f"{rms_error(cut[1].by_rms_m_per_km, cut[1].exact_m_per_km):.2f}.")
    place_m = places_m(road)
    shown = (place_m >= 0) & (place_m <= _LENGTH_M_F6_9)
    x_mph = np.array(speeds, dtype=float)
    pictures = (
        Picture(Curves("Fig 6.9: the profile", "distance [m]", "elevation [mm]",
                       (Line("profile", place_m[shown], 1000 * road.elevation_m[shown]),)),
                "a profile measured by a high-speed profiler, from ProVAL"),
        Picture(Curves(f"Fig 6.10: the response at {windowed_mph} mph", "distance [m]", "acceleration [m/s2]",
                       (Line("response", drive.distance_m, drive.measured_mps2),)),
                "the simulated response of the half car to that profile"),
        Picture(Curves("Fig 6.11: error of the IRI by speed", "speed [mph]", "error [%]",
                       (*(Line(f"waviness {waviness:g}", x_mph, drift[:, index])
                          for index, waviness in enumerate(WAVINESS)), Line("ridelog estimate", x_mph, own)),
                       level=(0.0, "exact")),
                "the IRI by the relation, higher at 10 mph than at 70"),
        *(Picture(_compared(f"{figures}: windows of {window_m:.2f} m at {windowed_mph} mph", one),
                  "the exact IRI and the approximated one along the road, and one against the other")
          for figures, window_m, one in zip(("Fig 6.12, 6.13", "Fig 6.14, 6.15"), windows_m, cut, strict=True)))
    return Result((table, windows), verdict, pictures, (
        *about("Fig 6.11", [
            Statement(f"bias of the relation at {speeds[0]} mph, waviness {WAVINESS[0]:g} [%]", "overestimates at low "
                      "speed", float(drift[0, 0]), 1.0),
            Statement(f"bias of the relation at {speeds[-1]} mph [%]", "underestimates at high speed",
                      float(drift[-1, 0]), most=-1.0),
            Statement("range of the bias over the speeds, ridelog's over the relation's",
                      "the IRI should not depend on "
                      "the speed", float(np.ptp(own) / np.ptp(drift[:, 0])), 0.0, 0.5, Word.BETTER)]),
        *(one for items, found in zip((("Fig 6.12", "Fig 6.13"), ("Fig 6.14", "Fig 6.15")), cut, strict=True)
          for one in about(items, [
              Statement(f"bias of the relation at {windowed_mph} mph [%]",
                        "shows the accuracy of the use of acceleration",
                        100 * float(found.by_rms_m_per_km.mean() / found.exact_m_per_km.mean() - 1), -15.0, 15.0),
              Statement("r.m.s. error of a window, ridelog's over the relation's", "accurate at 40 mph", rms_error(
                  found.iri_m_per_km, found.exact_m_per_km) / rms_error(found.by_rms_m_per_km, found.exact_m_per_km),
                        0.0, 0.8, Word.BETTER)]))))


def _bias_percent(mph: int, waviness: float, roads: int) -> float:
    """Mean error of the relation over whole roads [%]."""
    found = []
    for seed in range(1, roads + 1):
        road = random_road(_IRI, _LENGTH_M_F6_9, seed, waviness)
        drive = drive_over(road, mph * MPH_MPS, Conditions(0.0))
        inside: Array = road.elevation_m[round(-road.start_m / road.spacing_m):][
            : round(_LENGTH_M_F6_9 / road.spacing_m)]
        found.append(whole_road_by_rms(drive) / iri(inside, road.spacing_m))
    return 100 * (float(np.mean(found)) - 1)


def _row_f6_9(window_m: float, cut: Figures) -> tuple[Cell, ...]:
    within = np.abs(cut.iri_m_per_km - cut.exact_m_per_km) < 2 * cut.iri_std_m_per_km
    return (window_m, "picture", float(len(within)), float(cut.exact_m_per_km.std()),
            rms_error(cut.by_rms_m_per_km, cut.exact_m_per_km), rms_error(cut.iri_m_per_km, cut.exact_m_per_km),
            float(100 * within.mean()))


def _compared(title: str, cut: Figures) -> Curves:
    return Curves(title, "distance [m]", "IRI [m/km]", (
        Line("exact", cut.middle_m, cut.exact_m_per_km),
        Line("ridelog estimate", cut.middle_m, cut.iri_m_per_km, cut.iri_std_m_per_km),
        Line("r.m.s. relation", cut.middle_m, cut.by_rms_m_per_km)))


F6_9 = Study("fig_6_9", "IRI from acceleration beside the exact one, by speed and in windows",
              "Fig 6.9 (to 6.15), section 6.3.1",
              "The source simulates its half car over a ProVAL profile that it does not name. Random roads of 305 m, "
              "IRI 2.5 m/km and three wavinesses replace it here; the car of Table 4.2 with a PS-2119.",
              _f6_9,
              items=(*alike(("Fig 6.9", "Fig 6.10"), Word.NOT_REPRODUCIBLE,
                            "The profile is not named; a random road replaces it."),
                     Item("Fig 6.11", Word.BETTER,
                          "The drift with speed appears as printed and comes from the road's waviness; ridelog's "
                          "estimate does not drift."),
                     *alike([f"Fig 6.{number}" for number in range(12, 16)], Word.BETTER,
                            "At 40 mph the relation is right on average; the errors of ridelog's windows are half as "
                            "large.")))


def _f6_16(effort: Workload) -> Result:
    settings = rms_calibration.CalibrationSettings(roads=effort.count(60, 10))
    (lines,) = (rms_calibration.calibrate(known_vehicle(rav4()), None, settings) for _ in effort.each(range(1)))
    mph = np.round(np.array(rms_calibration.SPEEDS_MPS) / MPH_MPS)
    per_iri = np.array([one.a_w_per_iri.slope for one in lines])
    levels = np.array(rms_calibration.LEVELS_IRI)
    a_w = np.outer(per_iri, levels)
    road = random_road(5.0, 305.0, 3)
    stepped = {number: per_window(drive_over(road, rms_calibration.SPEEDS_MPS[number], PS_2119), PS_2119)
               for number in (1, 3)}
    checks = {number: float(np.sqrt(np.mean(one.a_w_mps2**2)) / one.exact_m_per_km.mean())
              for number, one in stepped.items()}
    table = Table("Weighted acceleration by speed (printed as pictures only)", (
        Column("speed [mph]", ".0f"), Column("a_w per IRI [m/s2 per m/km]", ".4f"),
        Column("spread of 1 km roads [%]", ".0f"), Column("one road in the time domain", ".4f"),
        *(Column(f"IRI {level:g}") for level in (1, 2, 4, 8)),
        Column("a little uncomfortable from IRI [m/km]", ".1f")), tuple(
        (float(mph[number]), one.a_w_per_iri.slope, 100 * one.a_w_per_iri.spread, checks.get(number),
         *(comfort_word(one.a_w_per_iri.slope * level).replace("_", " ").replace(" uncomfortable", "")
           for level in (1, 2, 4, 8)),
         COMFORT_WORDS[-2][0] / one.a_w_per_iri.slope) for number, one in enumerate(lines)))
    verdict = ("Discomfort grows in proportion to roughness, and with speed, as the text says. The printed pictures "
               "have no numbers in the text. For this car a straight line through the origin holds for each speed, "
               f"because it is linear; from 10 to 70 mph it becomes {per_iri[-1] / per_iri[0]:.1f} times as steep, not "
               "seven times: on a road of waviness 2 the excitation grows with the square root of the speed, 2.6 "
               "times. Most of the rest is the tire, whose contact patch of 250 mm averages out the short waves that "
               "would excite a slow car's wheels.")
    pictures = (
        Picture(Curves("Fig 6.16: comfort by IRI at each speed", "IRI [m/km]", "a_w [m/s2]",
                       tuple(Line(f"{one:.0f} mph", levels, row) for one, row in zip(mph, a_w, strict=True)),
                       level=(COMFORT_WORDS[-2][0], "a little uncomfortable")),
                "a_w by IRI from 1 to 10 m/km at 10 to 70 mph"),
        Picture(Field("Fig 6.17: the same over IRI and speed", "IRI [m/km]", "speed [mph]", levels, mph, a_w,
                      "a_w [m/s2]", 1.2),
                "the same as a surface in three dimensions"))
    return Result((table,), verdict, pictures, about(("Fig 6.16", "Fig 6.17"), [
        Statement("smallest rise of a_w per IRI from one speed to the next [m/s2 per m/km]", "the faster, the less "
                  "comfortable", float(np.diff(per_iri).min()), 1e-3),
        Statement("R2 of a_w by IRI through the origin, the smallest of all speeds",
                  "the rougher, the less comfortable", min(one.a_w_per_iri.r2 for one in lines), 0.95),
        Statement("a road simulated in the time domain, over the line: the value farthest from 1",
                  "a half car is simulated on generated profiles",
                  max((check / float(per_iri[number]) for number, check in checks.items()),
                      key=lambda one: abs(one - 1)), 0.85, 1.15)]))


F6_16 = Study("fig_6_16", "Comfort by roughness and speed", "Fig 6.16 (and 6.17), section 6.4",
              "As in the source: the half car of Table 4.2 over random roads of IRI 1 to 10 m/km at 10 to 70 mph, "
              "weighted with Wk; here 60 roads of 1 km. In addition one road of IRI 5 m/km is simulated in the time "
              "domain.",
              _f6_16, items=alike(("Fig 6.16", "Fig 6.17"), Word.AGREES, "Discomfort grows in proportion to "
                                  "roughness, and with speed; the text gives no numbers of the figures."))


PRINTED_MPH = {**dict.fromkeys(range(1, 38), 20), **dict.fromkeys(range(1, 5), 30), **dict.fromkeys((5, 8, 9), 25),
               22: 15}
"""Table D.1: the speed on each segment."""
PRINTED_KMH = {30: 48.28, 25: 40.23, 20: 32.19, 15: 24.14}
PRINTED_SLOW_KMH = 32.2
PRINTED_COMFORT = {"not_uncomfortable": "a majority", **dict.fromkeys(
    ("a_little_uncomfortable", "fairly_uncomfortable", "uncomfortable"), "a place (Table 6.5)")}
LOW_PASS_HZ = 15.0
_MEDIAN_IRI, _WAVINESS = 2.5, 1.7
_WINDOWS = 24
_LENGTH_M_F6_23 = _WINDOWS * WINDOW_M + 1.0


def _f6_23(effort: Workload) -> Result:
    # Where each word of Table 2.5 begins [m/s2], the second colour scale; the first has the ranges of Table 2.3.
    printed_limits = (0.0, 0.315, 0.5, 0.8, 1.25, 2.0)
    shown = 5
    segments = effort.some(sorted(PRINTED_MPH))
    found = {one: _driven(one) for one in effort.each(segments)}
    speeds = [mph for mph in PRINTED_KMH if any(PRINTED_MPH[one] == mph for one in segments)]
    again = {mph: _biases_percent(mph, [one for one in PRINTED_MPH if PRINTED_MPH[one] == mph], effort)
             for mph in PRINTED_KMH}
    by_speed = Table("Roughness by speed: windows of 25 ft", (
        Column("printed speed [mph]", ".0f"), Column("segments", ".0f"), Column("exact mean IRI [m/km]", ".2f"),
        Column("printed, by r.m.s."),
        Column("by r.m.s. [%]", "+.1f"), Column("ridelog estimate [%]", "+.1f"),
        Column("by r.m.s. on more roads [%]", "+.1f"), Column("its standard error [%]", ".1f"),
        Column("further roads", ".0f"),
        Column("r.m.s. error by r.m.s. [m/km]", ".2f"), Column("ridelog estimate [m/km]", ".2f")), tuple(
        _row_f6_23(mph, [one for number, one in found.items() if PRINTED_MPH[number] == mph], again[mph])
        for mph in speeds))
    a_w = np.concatenate([one.a_w_mps2 for one in found.values()])
    shares = comfort_shares(a_w)
    comfort = Table("Comfort of all windows", (Column("word of Table 2.5"), Column("printed (6.5.2)"),
                                              Column("ours [% of windows]", ".1f")), tuple(
        (word.replace("_", " "), PRINTED_COMFORT.get(word, "not named"), share)
        for word, share in shares.items()))
    slow, fast = (np.concatenate([again[mph] for mph, kmh in PRINTED_KMH.items()
                                  if (kmh < PRINTED_SLOW_KMH) is is_slow])
                  for is_slow in (True, False))
    slow_mean, slow_std = float(slow.mean()), _standard_error(slow)
    few = [mph for mph, kmh in PRINTED_KMH.items() if kmh < PRINTED_SLOW_KMH]
    counts = {mph: list(PRINTED_MPH.values()).count(mph) for mph in PRINTED_KMH}
    verdict = ("Table D.1 agrees with itself: its two columns give the same speeds. The records were never published, "
               "so the maps cannot be repeated; on simulated roads the same steps give maps of the same kind. The "
               f"text finds the IRI overestimated below {PRINTED_SLOW_KMH:g} km/h. By Table D.1 that is "
               f"{sum(counts[mph] for mph in few)} segments, {counts[20]} at 20 mph and only one at 15; {counts[25]} "
               f"are driven at 25 and {counts[30]} at 30 mph. That is too few to be sure of a mean: over {len(slow)} "
               f"further roads of waviness {_WAVINESS:g} at the slow speeds the relation reads {slow_mean:+.1f} ± "
               f"{slow_std:.1f} %, at the fast ones {fast.mean():+.1f} ± {_standard_error(fast):.1f} %. The cause is "
               "that of Fig 6.11; the 15 Hz low-pass removes a part of it. The waviness was chosen: on roads of "
               "waviness 2 there would be no such error (Fig 6.9). That a majority of windows is comfortable agrees: "
               f"{shares['not_uncomfortable']:.0f} % here, for roads of a median IRI of {_MEDIAN_IRI:g} m/km. Better: "
               "each window's IRI has a standard error, and ridelog report draws both maps for drives with GPS.")
    example = found[min(segments, key=lambda number: abs(number - shown))]
    colours = "the colours of the scale, every 25 ft along an example"
    pictures = (
        Picture(Curves(f"Fig 6.21: IRI along segment {shown}", "distance [m]", "IRI [m/km]", (
            Line("exact", example.middle_m, example.exact_m_per_km),
            Line("ridelog estimate", example.middle_m, example.iri_m_per_km, example.iri_std_m_per_km),
            Line("r.m.s. relation", example.middle_m, example.by_rms_m_per_km))), f"the IRI in {colours}"),
        Picture(Curves(f"Fig 6.22: comfort along segment {shown}", "distance [m]", "a_w [m/s2]",
                       (Line("a_w", example.middle_m, example.a_w_mps2),), level=(0.315, "a little uncomfortable")),
                f"the comfort in {colours}"),
        Picture(_map("Fig 6.23: the roughness map as strips", {
            number: one.by_rms_m_per_km for number, one in found.items()}, "IRI [m/km]", 6.0),
                "37 streets in and around College Park (Fig 6.19), coloured by roughness"),
        Picture(_map("Fig 6.24: the comfort map as strips", {
            number: one.a_w_mps2 for number, one in found.items()}, "a_w [m/s2]", 0.5),
                "the same streets, coloured by comfort"))
    return Result((by_speed, comfort, _scales()), verdict, pictures, (
        *about("Fig 6.20", [
            *(Value(f"{kind}, {end} [m/km]", printed, ours, 0.0)
              for (low, high, kind), (_, *ends) in zip(ROAD_RANGES, PRINTED_RANGES, strict=True)
              for end, printed, ours in zip(("from", "to"), ends, (low, high), strict=True)),
            *(Value(f"{word.replace('_', ' ')}, from [m/s2]", printed, limit, 0.0)
              for (limit, word), printed in zip(reversed(COMFORT_WORDS), printed_limits, strict=True))]),
        *about(("Fig 6.21", "Fig 6.22"), [Value("length of a window [m]", 7.62, float(np.diff(
            example.edges_m).mean()), 1e-6, Word.NOT_REPRODUCIBLE)]),
        *about("Fig 6.23", [
            Statement(f"bias of the r.m.s. relation below {PRINTED_SLOW_KMH:g} km/h less two standard errors, "
                      f"{len(slow)} roads [%]",
                      "overestimated when driving slower than 32.2 km/h", slow_mean - 2 * slow_std, 0.0,
                      word=Word.NOT_REPRODUCIBLE),
            Statement("bias of the r.m.s. relation at 25 and 30 mph [%]", "reasonable at high speeds",
                      float(fast.mean()), -10.0, 10.0,
                      Word.NOT_REPRODUCIBLE)]),
        *about("Fig 6.24", [Statement("windows that are not uncomfortable [%]",
                                      "a majority of the roads is comfortable",
                                      shares["not_uncomfortable"], 50.0, word=Word.NOT_REPRODUCIBLE)]),
        *about("Table D.1", [Value(f"{mph} mph [km/h]", kmh, mph * MPH_MPS / KMH_MPS, 0.005)
                             for mph, kmh in PRINTED_KMH.items()])))


def _biases_percent(mph: int, segments: Sequence[int], effort: Workload) -> Array:
    """Errors of the windows' mean by the r.m.s. relation on further roads of the segments of a speed (n,) [%]."""
    # further roads of each segment, and of all slow ones together; then the r.m.s. relation alone
    roads_each, fewest = 4, 24
    edges_m: Array = WINDOW_M * np.arange(_WINDOWS + 1.0)
    slow = PRINTED_KMH[mph] < PRINTED_SLOW_KMH
    roads = max(2, effort.count(roads_each * len(segments)), fewest * slow * (len(segments) > 1))
    found = []
    for number in range(roads):
        segment, draw = segments[number % len(segments)], 1 + number // len(segments)
        road, drive, _ = _drive(segment, draw=draw)
        inside = road.elevation_m[round(-road.start_m / road.spacing_m):][: round(_LENGTH_M_F6_23 / road.spacing_m) + 1]
        found.append(mean_window_by_rms(drive, edges_m, LOW_PASS_HZ) / iri(inside, road.spacing_m))
    return 100 * (np.array(found) - 1)


def _standard_error(values: Array) -> float:
    return float(values.std(ddof=1) / len(values) ** 0.5)


def _scales() -> Table:
    """Fig 6.20, as numbers."""
    comfort = list(reversed(COMFORT_WORDS))
    return Table("Fig 6.20: the two scales, six colours each (printed as a picture of colours)", (
        Column("road of Table 2.3"), Column("printed IRI from [m/km]", ".2f"), Column("to", ".2f"),
        Column("comfort of Table 2.5"), Column("a_w from [m/s2]", ".3f")), tuple(
        (kind, low, high, word.replace("_", " "), limit)
        for (low, high, kind), (limit, word) in zip(ROAD_RANGES, comfort, strict=True)))


def _drive(segment: int, draw: int = 0) -> tuple[Track, Run, Conditions]:
    """A road for a segment, the drive over it at the segment's speed, and the sensor's conditions."""
    rng = np.random.default_rng([segment, draw] if draw else segment)
    iri_m_per_km = _MEDIAN_IRI * float(np.exp(0.4 * rng.standard_normal()))
    road = random_road(iri_m_per_km, _LENGTH_M_F6_23, 100 + segment + 1000 * draw, _WAVINESS)
    conditions = PS_2119.on(iri_m_per_km, segment + 1000 * draw)
    return road, drive_over(road, PRINTED_MPH[segment] * MPH_MPS, conditions), conditions


def _driven(segment: int) -> Figures:
    _, drive, conditions = _drive(segment)
    return per_window(drive, conditions, low_pass_hz=LOW_PASS_HZ)


def _row_f6_23(mph: int, found: list[Figures], again: Array) -> tuple[Cell, ...]:
    exact, by_rms, ours = (np.concatenate([getattr(one, name) for one in found])
                           for name in ("exact_m_per_km", "by_rms_m_per_km", "iri_m_per_km"))
    slow = PRINTED_KMH[mph] < PRINTED_SLOW_KMH
    return (float(mph), float(len(found)), float(exact.mean()), "too high" if slow else "reasonable",
            *(100 * float(one.mean() / exact.mean() - 1) for one in (by_rms, ours)), float(again.mean()),
            _standard_error(again), float(len(again)), *(rms_error(one, exact) for one in (by_rms, ours)))


def _map(title: str, values: dict[int, Array], name: str, top: float) -> Field:
    grid = np.array([one[:_WINDOWS] for one in values.values()])
    return Field(title, "distance along the segment [m]", "segment of Table D.1",
                 WINDOW_M * np.arange(0.5, grid.shape[1]), np.array(list(values), dtype=float), grid, name, top)


F6_23 = Study("fig_6_23", "37 road segments at their speeds: a map of roughness and one of comfort",
              "Fig 6.23 (6.19 to 6.24, and Table D.1), section 6.5",
              "The source measured, and its records were never published; nor are the segments' lengths given. "
              "Simulated: 37 random roads of 183 m, median IRI 2.5 m/km, waviness 1.7, each at its speed of Table D.1; "
              "the car of Table 4.2 with a PS-2119, 15 Hz low-pass, windows of 25 ft.", _f6_23,
              items=(Item("Fig 6.19", Word.NOT_REPRODUCIBLE,
                          "A map of the places, which were published in no other form."),
                     Item("Fig 6.20", Word.AGREES,
                          "Our words change at the limits of Tables 2.3 and 2.5, on which the scales are based; the "
                          "colours are not given."),
                     *alike(("Fig 6.21", "Fig 6.22"), Word.NOT_REPRODUCIBLE,
                            "The record was never published; a simulated one is cut into the same windows."),
                     Item("Fig 6.23", Word.NOT_REPRODUCIBLE,
                          "Places and records were never published; on simulated roads of waviness 1.7 the r.m.s. "
                          "relation reads too high at the slow speeds."),
                     Item("Fig 6.24", Word.NOT_REPRODUCIBLE,
                          "Places and records were never published; on simulated roads a majority of windows is "
                          "comfortable."),
                     Item("Table D.1", Word.AGREES, "Its two columns give the same speeds.")))

STUDIES = (F6_6, F6_9, F6_16, F6_23)
