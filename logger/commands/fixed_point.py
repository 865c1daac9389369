"""Write a weighting and the IRI's quarter car as C headers for a controller without floating point.

  ridelog fixed-point --out firmware/
  ridelog fixed-point --weighting wd --data-bits 16 --full-scale-g 2 --spacing 0.25 --out firmware/

Two headers: ridelog_<weighting>.h takes accelerations and ridelog_golden_car.h road slopes. Each holds its coefficients
and a short loop in C99 that gives the same bits as logger/dsp/fixed_point.py; with the defaults, those that the service
runs with `arithmetic: fixed`.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import EXIT_DONE, BadInput
from logger.files import make_folder, together, write_text

if TYPE_CHECKING:
    from logger.dsp.fixed_point import FixedCascade
    from logger.dsp.weightings.weighting import Sections, Weighting


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the verb."""
    parser.add_argument("--weighting", default="wk", metavar="NAME", help="such as wd (default: wk)")
    parser.add_argument("--rate", type=int, default=100, metavar="HZ", help="its sampling rate (default: 100)")
    parser.add_argument("--full-scale-g", type=float, default=16.0, metavar="G",
                        help="range of the accelerometer; a smaller one has finer steps (default: 16)")
    parser.add_argument("--spacing", type=float, default=0.25, metavar="M",
                        help="distance between the slopes of the quarter car (default: 0.25)")
    parser.add_argument("--data-bits", type=int, choices=(32, 16), default=32, help="word of the data (default: 32)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the headers")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Make the integers, write the headers, print what they are."""
    headers = [_weighting(args), _golden_car(args)]
    with together():
        make_folder(args.out)
        for header in headers:
            write_text(args.out / header.file, header.text(), "ascii")
    if args.json:
        print(json.dumps({"data_bits": args.data_bits, "filters": [header.as_json(args.out) for header in headers]}))
        return EXIT_DONE
    for header in headers:
        print(header.in_words(args.out))
    return EXIT_DONE


@dataclass(frozen=True)
class _Header:
    name: str
    title: str
    unit: str
    notes: tuple[str, ...]
    cascade: FixedCascade

    @property
    def file(self) -> str:
        return f"{self.name}.h"

    def text(self) -> str:
        from logger.shipped import version
        from logger.store.formats.c_header import c_header

        return c_header(self.name, self.title, self.unit, self.notes, self.cascade, version())

    def as_json(self, folder: Path) -> dict[str, Any]:
        return {
            "name": self.name, "file": str(folder / self.file), "sections": len(self.cascade.sections),
            "unit": self.unit, "input_step": self.cascade.input_step, "output_step": self.cascade.output_step,
            "coefficient_error_db": self.cascade.coefficient_error_db,
        }

    def in_words(self, folder: Path) -> str:
        cascade = self.cascade
        return (f"{folder / self.file}: {self.title}\n"
                f"  {len(cascade.sections)} sections, {cascade.data_bits}-bit data; rounding of coefficients "
                f"{cascade.coefficient_error_db:.0f} dB\n"
                f"  one count is {cascade.input_step:.4g} {self.unit} in, {cascade.output_step:.4g} {self.unit} out")


def _weighting(args: argparse.Namespace) -> _Header:
    from logger.api.weightings import weighting_named
    from logger.dsp.weightings.weighting import DELAY_SAMPLES
    from logger.units import STANDARD_GRAVITY_MPS2

    if not 0.01 <= args.full_scale_g <= 1000:
        raise BadInput(f"--full-scale-g {args.full_scale_g:g}: expected 0.01 to 1000 g")
    weighting = weighting_named(args.weighting)
    sections = _sections(weighting, args.rate)
    cascade = _cascade(f"--rate {args.rate}", sections, args.full_scale_g * STANDARD_GRAVITY_MPS2, args.data_bits)
    return _Header(
        f"ridelog_{weighting.name}",
        f"Weighting {weighting.name.capitalize()} at {args.rate} Hz for inputs within +-{args.full_scale_g:g} g",
        "m/s2",
        (f"The output runs {DELAY_SAMPLES} samples behind the standard's formula: output k + {DELAY_SAMPLES} belongs",
         "to the instant of input k."),
        cascade,
    )


def _sections(weighting: Weighting, rate_hz: int) -> Sections:
    if rate_hz in weighting.sections:
        return weighting.sections[rate_hz]
    from logger.dsp.design import design_sections  # takes scipy and some seconds

    try:
        return design_sections(weighting, rate_hz)
    except ValueError as error:
        raise BadInput(f"--rate {rate_hz}: {error}") from None


def _golden_car(args: argparse.Namespace) -> _Header:
    from logger.dsp.fixed_point import FULL_SCALE_SLOPE
    from logger.roads.iri import golden_car_sections

    try:
        rows = golden_car_sections(args.spacing)
    except ValueError as error:
        raise BadInput(f"--spacing {args.spacing:g}: {error}") from None
    return _Header(
        "ridelog_golden_car",
        f"Golden Car of the IRI, 80 km/h, a slope every {args.spacing:g} m, for slopes within +-{FULL_SCALE_SLOPE:g}",
        "m/m",
        ("In: slope of the road over 250 mm. Out: slope between body and wheel at the end of the step; the mean of its",
         "absolute value times 1000 is the IRI in m/km. Reset to the mean slope of the first 11 m."),
        _cascade(f"--spacing {args.spacing:g}", rows, FULL_SCALE_SLOPE, args.data_bits),
    )


def _cascade(option: str, sections: Any, full_scale: float, data_bits: int) -> FixedCascade:
    from logger.dsp.fixed_point import fixed_cascade

    try:
        return fixed_cascade(sections, full_scale, data_bits)
    except ValueError as error:
        raise BadInput(f"{option}: {error}") from None
