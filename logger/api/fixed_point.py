"""A weighting and the IRI's quarter car as C headers for a controller without floating point."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from logger.api.question import Option, Question, Verb
from logger.files import make_folder, together, write_text

if TYPE_CHECKING:
    from logger.api.shown import CommandResult
    from logger.dsp.fixed_point import FixedCascade
    from logger.dsp.weightings.weighting import Sections, Weighting

_SPACING_M = 0.25
"""Between the slopes of the quarter car: those of the service with ``arithmetic: fixed``."""


def _check_bits(bits: int) -> None:
    if bits not in (32, 16):
        raise ValueError("expected 32 or 16")


@dataclass(frozen=True)
class FixedPointQuestion(Question):
    """Write a weighting and the IRI's quarter car as C headers for a controller without floating point.

      ridelog fixed-point --out firmware/
      ridelog fixed-point --weighting wd --data-bits 16 --out firmware/

    Two headers: ridelog_<weighting>.h takes accelerations within +-16 g and ridelog_golden_car.h road slopes, one every
    0.25 m. Each holds its coefficients and a short loop in C99 that gives the same bits as logger/dsp/fixed_point.py;
    with the defaults, those that the service runs with `arithmetic: fixed`.
    """

    out: Annotated[Path, Option("folder for the headers", metavar="DIR", read=Path)]
    _: KW_ONLY
    weighting: Annotated[str, Option("such as wd", metavar="NAME")] = "wk"
    rate_hz: Annotated[int, Option("its sampling rate", metavar="HZ")] = 100
    data_bits: Annotated[int, Option("word of the data", metavar="32|16", check=_check_bits)] = 32


FIXED_POINT = Verb(FixedPointQuestion, "logger.api.fixed_point:written")


def written(question: FixedPointQuestion) -> "CommandResult":
    """Make the integers and write the headers; what they are. BadInput for what the question says cannot be."""
    from logger.api.shown import CommandResult

    headers, folder = [_weighting(question), _golden_car(question)], question.out
    with together():
        make_folder(folder)
        for header in headers:
            write_text(folder / header.file, header.text(), "ascii")
    return CommandResult("\n".join(header.in_words(folder) for header in headers), {
        "data_bits": question.data_bits, "filters": [header.as_json(folder) for header in headers]})


@dataclass(frozen=True)
class _Header:
    name: str
    title: str
    unit: str
    notes: tuple[str, ...]
    cascade: "FixedCascade"

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


def _weighting(question: FixedPointQuestion) -> _Header:
    from logger.api.weightings import weighting_named
    from logger.dsp.fixed_point import FULL_SCALE_MPS2, fixed_cascade
    from logger.dsp.weightings.weighting import DELAY_SAMPLES
    from logger.units import STANDARD_GRAVITY_MPS2

    weighting = weighting_named(question.weighting)
    try:
        cascade = fixed_cascade(_sections(weighting, question.rate_hz), FULL_SCALE_MPS2, data_bits=question.data_bits)
    except ValueError as error:
        raise question.wrong("rate_hz", f" {question.rate_hz}: {error}") from None
    return _Header(
        f"ridelog_{weighting.name}",
        f"Weighting {weighting.name.capitalize()} at {question.rate_hz} Hz for inputs within "
        f"+-{FULL_SCALE_MPS2 / STANDARD_GRAVITY_MPS2:g} g",
        "m/s2",
        (f"The output runs {DELAY_SAMPLES} samples behind the standard's formula: output k + {DELAY_SAMPLES} belongs",
         "to the instant of input k."),
        cascade,
    )


def _sections(weighting: "Weighting", rate_hz: int) -> "Sections":
    if rate_hz in weighting.sections:
        return weighting.sections[rate_hz]
    from logger.dsp.design import design_sections  # takes scipy and some seconds

    return design_sections(weighting, rate_hz)


def _golden_car(question: FixedPointQuestion) -> _Header:
    from logger.dsp.fixed_point import FULL_SCALE_SLOPE, fixed_cascade
    from logger.roads.iri import golden_car_sections

    cascade = fixed_cascade(golden_car_sections(_SPACING_M), FULL_SCALE_SLOPE, data_bits=question.data_bits)
    return _Header(
        "ridelog_golden_car",
        f"Golden Car of the IRI, 80 km/h, a slope every {_SPACING_M:g} m, for slopes within +-{FULL_SCALE_SLOPE:g}",
        "m/m",
        ("In: slope of the road over 250 mm. Out: slope between body and wheel at the end of the step; the mean of its",
         "absolute value times 1000 is the IRI in m/km. Reset to the mean slope of the first 11 m."),
        cascade,
    )
