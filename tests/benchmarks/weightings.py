"""The weightings' sections beside the formula, the plain bilinear transform, the standard's numbers and sosfilt.

    python -m tests.benchmarks.weightings [--rate HZ] [--svg PICTURE.svg]

Prints, per weighting, the error of our sections and of the bilinear ones; the printed one-third-octave factors and the
saw-tooth bursts of ISO 8041 beside ours; and samples per second of each streaming filter. The picture shows every
weighting and the two errors. Exit 1 when a goal is missed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np
from scipy import signal

from logger.dsp.design import design_error, design_sections
from logger.dsp.filters import BlockFilter, frequency_response
from logger.dsp.weightings.weighting import DELAY_SAMPLES, Sections, Weighting
from logger.plugins import catalogue

from .figures import Figures

Array = np.ndarray

# Printed factors times 1000 at nominal frequencies [Hz] (ISO 2631-1 Table 3). Wd at 10 Hz is printed 212, for 202.
THIRDS = {
    "wk": {0.5: 418, 1: 482, 2: 531, 4: 967, 6.3: 1054, 8: 1036, 10: 988, 16: 768, 20: 636, 25: 513, 31.5: 405,
           40: 314, 63: 186, 80: 132},
    "wd": {0.5: 853, 1: 1011, 2: 890, 4: 512, 6.3: 323, 8: 253, 10: 212, 16: 125, 20: 100, 25: 80, 31.5: 63.2,
           40: 49.4, 63: 29.5, 80: 21.1},
    "wf": {0.1: 695, 0.125: 895, 0.16: 1006, 0.2: 992, 0.25: 854, 0.315: 619, 0.5: 224, 1: 23.5},
}
# Saw-tooth bursts of ISO 8041: weighted r.m.s. [m/s2] for so many teeth every 10 s.
TEETH = (1, 2, 4, 8, 16, inf)
BURSTS = {"wk": (0.0299, 0.0411, 0.0577, 0.0814, 0.115, 0.362),
          "wd": (0.00669, 0.00906, 0.0116, 0.0148, 0.0197, 0.0590)}
FINE_HZ = 20_000
LENGTH_S = 60


@dataclass(frozen=True)
class Row:
    """One weighting at one rate: our sections, and the bilinear transform of the formula."""

    weighting: Weighting
    rate_hz: float
    ours: Sections
    bilinear: Array

    @property
    def band_hz(self) -> Array:
        ends = (0.02, 5.0) if self.weighting.name == "wf" else (0.1, 0.4 * self.rate_hz)
        return np.geomspace(*ends, 1000)

    def errors_db(self, f_hz: Array) -> tuple[Array, Array]:
        """Of ours and of the bilinear sections."""
        formula = np.abs(self.weighting.response(f_hz))
        magnitudes = (np.abs(frequency_response(rows, f_hz, self.rate_hz)) for rows in (self.ours, self.bilinear))
        first, second = (20 * np.log10(magnitude / formula) for magnitude in magnitudes)
        return first, second


def bilinear_sections(weighting: Weighting, rate_hz: float) -> Array:
    """Every factor of the formula by the plain bilinear transform."""
    rows = []
    for numerator, denominator in weighting.factors():
        b, a = signal.bilinear(numerator, denominator, rate_hz)
        rows.append([*np.pad(b, (0, 3 - len(b))), *a])
    return np.array(rows)


def print_errors(rows: list[Row], figures: Figures) -> None:
    print("\nerror against the formula, at its worst within the band")
    print(f"{'':4} {'band Hz':>12} {'sections':>9} {'ours dB':>10} {'bilinear dB':>12} {'our phase, lower half':>22}")
    for row in rows:
        band = row.band_hz
        ours, bilinear = (np.abs(error).max() for error in row.errors_db(band))
        phase = design_error(row.weighting, row.ours, row.rate_hz, band[band <= band[-1] / 2]).phase_deg
        print(f"{row.weighting.name:4} {band[0]:5g} - {band[-1]:4g} {len(row.ours):9d} {ours:10.5f} {bilinear:12.3f} "
              f"{phase:18.3f} deg")
    worst = max(np.abs(row.errors_db(row.band_hz)[0]).max() for row in rows)
    figures.at_most("worst error of the seven weightings", worst, 0.02, "dB")


def print_thirds(rows: list[Row]) -> None:
    print("\none-third-octave factors x 1000; deviation of ours and of the bilinear sections from the printed value")
    for row in rows:
        for f_hz, printed in THIRDS.get(row.weighting.name, {}).items():
            if f_hz > 0.4 * row.rate_hz:
                continue
            at = np.array([f_hz])
            formula = 1000 * abs(row.weighting.response(at)[0])
            ours, bilinear = (1000 * abs(frequency_response(s, at, row.rate_hz)[0]) for s in (row.ours, row.bilinear))
            print(f"{row.weighting.name:4} {f_hz:6g} Hz  printed {printed:7g}  formula {formula:8.2f}  "
                  f"ours {ours:8.2f} ({ours / printed - 1:+7.2%})  "
                  f"bilinear {bilinear:8.2f} ({bilinear / printed - 1:+7.2%})")


def saw_teeth(teeth: float) -> Array:
    """The burst signal at FINE_HZ [m/s2]."""
    t_s = np.arange(FINE_HZ * LENGTH_S) / FINE_HZ
    phase = (t_s if teeth == inf else t_s % 10.0) / (2 * np.pi / 100)
    return np.where(phase < teeth, 2 * ((phase + 0.5) % 1.0) - 1.0, 0.0)


def band_limited(wave: Array, rate_hz: float) -> Array:
    """What is left of it in a record at ``rate_hz``: nothing from half the rate on."""
    count = round(len(wave) * rate_hz / FINE_HZ)
    return np.fft.irfft(np.fft.rfft(wave)[: count // 2 + 1], count) * count / len(wave)


def print_bursts(rows: list[Row], figures: Figures) -> None:
    rate_hz = rows[0].rate_hz
    print(f"\nsaw-tooth bursts of ISO 8041, weighted r.m.s. [m/s2]: whole record at {FINE_HZ} Hz, and our sections "
          f"on a record band-limited for {rate_hz:g} Hz")
    worst = 0.0
    for row in (row for row in rows if row.weighting.name in BURSTS):
        for teeth, printed in zip(TEETH, BURSTS[row.weighting.name], strict=True):
            wave = saw_teeth(teeth)
            exact = np.sqrt(np.mean(row.weighting.weigh(wave, FINE_HZ) ** 2))
            record = np.append(band_limited(wave, rate_hz), np.zeros(DELAY_SAMPLES))
            ours = np.sqrt(np.mean(BlockFilter(row.ours).process(record)[DELAY_SAMPLES:] ** 2))
            print(f"{row.weighting.name:4} {teeth:4g} teeth  printed {printed:8.5f}  exact {exact:8.5f} "
                  f"({exact / printed - 1:+6.2%})  sections {ours:8.5f} ({ours / printed - 1:+6.2%})")
            worst = max(worst, abs(exact / printed - 1))
    figures.at_most("worst deviation of the exact weighting", 100 * worst, 1.5, "%")


def print_speed(rows: list[Row]) -> None:
    record = np.random.default_rng(1).standard_normal(360_000)
    print("\nsamples per second, a record of 360,000: ours in blocks of 50 and whole (best of 3), scipy.signal.sosfilt")
    for row in rows:
        sos = np.array(row.ours)
        pieces = np.split(record[:36_000], 720)

        def in_blocks(sos: Array = sos, pieces: list[Array] = pieces) -> None:
            stream = BlockFilter(sos)
            for piece in pieces:
                stream.process(piece)

        def whole(sos: Array = sos) -> None:
            BlockFilter(sos).process(record)

        def by_sosfilt(sos: Array = sos) -> None:
            signal.sosfilt(sos, record)

        print(f"{row.weighting.name:4} {len(sos)} sections  blocks {36_000 / best_s(in_blocks):.3g}  "
              f"whole {len(record) / best_s(whole):.3g}  sosfilt {len(record) / best_s(by_sosfilt):.3g}")


def best_s(work: Callable[[], None]) -> float:
    """Shortest of three runs [s]."""
    times = []
    for _ in range(3):
        started_s = time.perf_counter()
        work()
        times.append(time.perf_counter() - started_s)
    return min(times)


WIDE, HIGH, MARGIN = 440, 190, 46


def picture(rows: list[Row]) -> str:
    """SVG: left each weighting [dB], right the size of both errors [dB, logarithmic]."""
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * WIDE} {HIGH * len(rows) + 24}" '
             'font-family="sans-serif" font-size="11"><rect width="100%" height="100%" fill="#fff"/>',
             f'<text x="{MARGIN}" y="14">formula (grey), our sections (blue), bilinear (red), '
             f'at {rows[0].rate_hz:g} Hz; left: magnitude, right: error and the 0.02 dB wanted</text>']
    for number, row in enumerate(rows):
        f_hz = np.geomspace(0.02, 0.49 * row.rate_hz, 400)
        formula = 20 * np.log10(np.abs(row.weighting.response(f_hz)))
        ours, bilinear = row.errors_db(f_hz)
        top = 24 + number * HIGH
        parts += panel(0, top, f_hz, (-60, 5), f"{row.weighting.name.capitalize()} [dB]", (-60, -40, -20, 0),
                       [(formula, "#bbb", 5), (formula + ours, "#2f6db5", 1.5), (formula + bilinear, "#d0402b", 1)])
        size = [np.log10(np.maximum(np.abs(error), 1e-6)) for error in (ours, bilinear)]
        parts += panel(WIDE, top, f_hz, (-6, 2), "log10 |error / dB|", (-6, -4, -2, 0, 2),
                       [(size[0], "#2f6db5", 1.5), (size[1], "#d0402b", 1),
                        (np.full(len(f_hz), np.log10(0.02)), "#888", 0.7)])
    return "".join([*parts, "</svg>"])


def panel(left: float, top: float, f_hz: Array, span: tuple[float, float], title: str, ticks: tuple[float, ...],
          lines: list[tuple[Array, str, float]]) -> list[str]:
    """One pair of axes, frequency logarithmic."""
    def x(f: Array) -> Array:
        return left + MARGIN + (WIDE - MARGIN - 10) * np.log(f / f_hz[0]) / np.log(f_hz[-1] / f_hz[0])

    def y(value: Array) -> Array:
        return top + 18 + (HIGH - 44) * (span[1] - np.clip(value, *span)) / (span[1] - span[0])

    parts = [f'<text x="{left + MARGIN}" y="{top + 13}" font-weight="bold">{title}</text>']
    for tick in ticks:
        at = float(y(np.array(tick)))
        parts.append(f'<path d="M{left + MARGIN} {at:.1f}H{left + WIDE - 10}" stroke="#ddd"/>'
                     f'<text x="{left + MARGIN - 6}" y="{at + 4:.1f}" text-anchor="end">{tick:g}</text>')
    decades = np.array([f for f in (0.1, 1.0, 10.0, 100.0) if f < f_hz[-1]])
    parts += [f'<text x="{at:.1f}" y="{top + HIGH - 12}" text-anchor="middle">{f:g} Hz</text>'
              for f, at in zip(decades, x(decades), strict=True)]
    for values, colour, width in lines:
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x(f_hz), y(values), strict=True))
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"/>')
    return parts


def main() -> int:
    """Print the tables; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate", type=float, default=100.0, metavar="HZ", help="sample rate (default: 100)")
    parser.add_argument("--svg", type=Path, help="write the picture to this file")
    args = parser.parse_args()
    figures = Figures()
    rows = []
    for weighting in catalogue("logger.dsp.weightings", "WEIGHTING").values():
        ours = weighting.sections.get(args.rate) or design_sections(weighting, args.rate)
        rows.append(Row(weighting, args.rate, ours, bilinear_sections(weighting, args.rate)))
    print(f"sample rate {args.rate:g} Hz: nothing above {args.rate / 2:g} Hz is seen")
    print_errors(rows, figures)
    print_thirds(rows)
    print_bursts(rows, figures)
    print_speed(rows)
    if args.svg:
        args.svg.write_text(picture(rows), encoding="utf-8")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
