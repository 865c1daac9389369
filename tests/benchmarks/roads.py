"""Random roads: what they cost, whether they are what they should be, and the relation of Gd(n0) and IRI."""

from __future__ import annotations

import sys
import time

import numpy as np
import numpy.typing as npt

from logger.roads import elevation_spectrum as spectrum
from logger.roads import iso8608
from logger.roads.elevation_spectrum import Roughness, classify
from logger.roads.iri import iri, rectified_slope

from .figures import Figures

Array = npt.NDArray[np.float64]

SPACING_M = 0.05


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    cost(figures)
    spectra(figures)
    classes(figures)
    repetition(figures)
    relation(figures)
    table_4_3(figures)
    asked_for(figures)
    spread(figures)
    return 1 if figures.missed else 0


def cost(figures: Figures) -> None:
    """Against the sum of cosines taken as Eq 4.1 is written, on the same kilometre."""
    fast_s = []
    for seed in range(3):
        started_s = time.perf_counter()
        road = iso8608.generate(64, 1000, SPACING_M, seed)
        fast_s.append(time.perf_counter() - started_s)
    step = 1 / 1091.0
    n = np.arange(12, int(2.83 / step)) * step
    phase = np.random.default_rng(1).uniform(0, 2 * np.pi, len(n))
    amplitude = np.sqrt(2 * step * iso8608.displacement_psd(n, 64))
    x = SPACING_M * np.arange(len(road))
    started_s = time.perf_counter()
    plain = np.zeros(len(x))
    for one, height, turn in zip(n, amplitude, phase, strict=True):
        plain += height * np.cos(2 * np.pi * one * x - turn)
    plain_s = time.perf_counter() - started_s
    figures.at_least("1 km: sum of cosines over Fourier transform", plain_s / sorted(fast_s)[1], 50, "x")
    started_s = time.perf_counter()
    road = iso8608.generate(64, 10_000, SPACING_M, 1)
    figures.at_most("10 km at 50 mm generated", time.perf_counter() - started_s, 0.5, "s")
    started_s = time.perf_counter()
    classify(road, SPACING_M)
    figures.at_most("10 km at 50 mm classified", time.perf_counter() - started_s, 0.5, "s")


def spectra(figures: Figures) -> None:
    """Level and slope of the fitted spectrum, mean over 20 roads of 1 km."""
    for waviness in (1.5, 2.0, 2.5, 3.0):
        reported = [classify(iso8608.generate(256, 1000, SPACING_M, seed, waviness), SPACING_M) for seed in range(20)]
        level = np.exp(np.mean([np.log(one.gd_n0_cm3 / 256) for one in reported]))
        figures.at_most(f"waviness {waviness:g}: error of the level", 100 * abs(level - 1), 5, "%")
        slope = np.mean([one.waviness for one in reported])
        figures.at_most(f"waviness {waviness:g}: error of the slope", 100 * abs(slope / waviness - 1), 5, "%")


def classes(figures: Figures) -> None:
    """Of each class 100 roads; and stretches of one long road, which chance makes more unlike each other."""
    for number, (letter, gd_n0_cm3) in enumerate(iso8608.CLASS_GD_N0_CM3.items()):
        reported = [classify(iso8608.generate(gd_n0_cm3, 1000, SPACING_M, 100 * number + seed), SPACING_M)
                for seed in range(100)]
        figures.at_least(f"class {letter} found again, 1 km", sum(one.road_class == letter for one in reported), 95,
        "/100")
    for length_m, goal in ((200, 95), (100, 90)):
        reported = [classify(one, SPACING_M) for one in stretches(256, length_m)]
        hits = sum(one.road_class == "C" for one in reported)
        figures.at_least(f"class C found again, stretches of {length_m} m", hits, goal, "/100")
        named = sum("C" in one.classes for one in reported)
        figures.at_least(f"class C among those named, stretches of {length_m} m", named, 95, "/100")
        figures.at_most(f"error over promised error, {length_m} m", rms_of_promised(reported, 256), 1.2, "")


def stretches(gd_n0_cm3: float, length_m: float) -> list[Array]:
    """A hundred stretches of one road."""
    size = round(length_m / SPACING_M)
    road = iso8608.generate(gd_n0_cm3, 101 * length_m, SPACING_M, 77)
    return [road[start:start + size + 1] for start in range(0, 100 * size, size)]


def rms_of_promised(reported: list[Roughness], gd_n0_cm3: float) -> float:
    """Root mean square of the errors of Gd(n0), each in its own standard errors; 1 is right."""
    off = [np.log(one.gd_n0_cm3 / gd_n0_cm3) / (one.gd_n0_std_cm3 / one.gd_n0_cm3) for one in reported]
    return float(np.sqrt(np.mean(np.square(off))))


def repetition(figures: Figures) -> None:
    """Largest autocorrelation from 200 m to 5 km; with 1000 equal steps of Eq 4.1 as printed it is about 0.9."""
    road = iso8608.generate(100, 10_000, SPACING_M, 5)
    x = np.arange(len(road))
    for name, row, goal in (("heights", road - np.polyval(np.polyfit(x, road, 1), x), 0.5),
                            ("slopes", np.diff(road), 0.05)):
        power = np.abs(np.fft.rfft(row, 2 * len(row))) ** 2
        likeness = np.fft.irfft(power)[: len(row)] / (row @ row)
        beyond = np.abs(likeness[round(200 / SPACING_M): round(5000 / SPACING_M)])
        figures.at_most(f"10 km: largest autocorrelation of {name}", float(beyond.max()), goal, "")


def relation(figures: Figures) -> None:
    """Eq 4.37 to 4.39, Fig 4.16, 4.17: four sets of 100 roads, here of 1 km."""
    print("IRI = c Gd^b                       c       b       spread (dissertation: 0.5386, 0.5)")
    gd_n0_cm3 = np.geomspace(2, 4096, 100)
    all_values = []
    for number in range(4):
        found = [iri(iso8608.generate(gd, 1000, SPACING_M, 1000 * number + seed), SPACING_M)
                 for seed, gd in enumerate(gd_n0_cm3)]
        all_values.append(found)
        print_fit(f"  set {number + 1}", gd_n0_cm3, np.array(found))
    exponent, constant = print_fit("  all", np.tile(gd_n0_cm3, 4), np.concatenate(all_values))
    cut = [iri(one, SPACING_M) * np.sqrt(gd / 64)
           for gd, one in zip(gd_n0_cm3, stretches(64, 1000), strict=True)]
    print_fit("  stretches of one long road", gd_n0_cm3, np.array(cut))
    print(f"  computed without roads       {spectrum.iri_per_root_gd():.4f}  0.5     "
          f"{spectrum.relative_spread(1000):.4f}")
    figures.at_most("exponent off 0.5", abs(exponent - 0.5), 0.005, "")
    figures.at_most("constant off 0.5386", 100 * abs(constant / iso8608.IRI_PER_ROOT_GD - 1), 1.5, "%")
    figures.at_most("constant off the computed one", 100 * abs(constant / spectrum.iri_per_root_gd() - 1), 0.5, "%")


def print_fit(name: str, gd_n0_cm3: Array, iri_m_per_km: Array) -> tuple[float, float]:
    """Print the power law through the points and their scatter about it; gives exponent and constant."""
    exponent, log_constant = np.polyfit(np.log(gd_n0_cm3), np.log(iri_m_per_km), 1)
    scatter = np.std(np.log(iri_m_per_km) - exponent * np.log(gd_n0_cm3))
    print(f"{name:30s} {np.exp(log_constant):.4f}  {exponent:.4f}  {scatter:.4f}")
    return float(exponent), float(np.exp(log_constant))


def table_4_3(figures: Figures) -> None:
    """Mean exact IRI of ten roads of 1 km at the limits of the classes."""
    for gd_n0_cm3, printed in ((32, 3.05), (128, 6.09), (512, 12.19), (2048, 24.37)):
        found = np.mean([iri(iso8608.generate(gd_n0_cm3, 1000, SPACING_M, seed), SPACING_M) for seed in range(10)])
        off = 100 * abs(found / printed - 1)
        figures.at_most(f"Table 4.3, Gd {gd_n0_cm3}: IRI {found:.2f} for {printed}", off, 1.5, "%")


def asked_for(figures: Figures) -> None:
    """Fig 4.18: two roads of 1 km for each IRI from 1 to 20."""
    wanted = np.tile(np.arange(1.0, 21.0), 2)
    found = np.array([iri(iso8608.generate(iso8608.gd_n0_from_iri(value), 1000, SPACING_M, seed), SPACING_M)
                      for seed, value in enumerate(wanted)])
    alike = float(np.corrcoef(wanted, found)[0, 1])
    figures.at_least("Fig 4.18: correlation of IRI asked for and got", alike, 0.999, "")
    figures.at_most("Fig 4.18: farthest off", 100 * float(np.abs(found / wanted - 1).max()), 3, "%")


def spread(figures: Figures) -> None:
    """Spread of the IRI of stretches of a road, computed and measured on 80 km."""
    for waviness in (2.0, 3.0):
        slope = rectified_slope(iso8608.generate(64, 80_000, SPACING_M, 3, waviness), SPACING_M)[2000:]
        for length_m in (20, 100, 500):
            size = round(length_m / SPACING_M)
            means = slope[: len(slope) // size * size].reshape(-1, size).mean(axis=1)
            measured, computed = means.std() / means.mean(), spectrum.relative_spread(length_m, waviness)
            figures.at_most(f"waviness {waviness:g}, {length_m} m: spread {computed:.4f}, driven {measured:.4f}",
                            100 * abs(measured / computed - 1), 15, "%")


if __name__ == "__main__":
    sys.exit(main())
