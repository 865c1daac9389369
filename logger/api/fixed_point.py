"""A weighting and the IRI's quarter car as C headers for a controller without floating point.

Problem: numbers copied by hand into firmware, and a loop written from memory, are a second filter that nobody has
checked. Solution: a header is made from the same integers that run here: the coefficients and the loop of
``logger.dsp.fixed_point``'s specification. It needs nothing but <stdint.h>. All divisions round down through one
function, as C's own round towards zero and its shifts of negative numbers are left to the compiler; compilers make a
shift of a division by 2^30. Names carry the filter's, so that headers stand side by side.
"""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Annotated, Any

from logger.files import make_folder, together, write_text
from logger.question import Option, Question, Verb

if TYPE_CHECKING:
    from logger.api.shown import CommandResult
    from logger.dsp.fixed_point import FixedCascade, FixedSection
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
    data_bits: Annotated[int, Option("word length of the data", metavar="32|16", check=_check_bits)] = 32


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
class _FilterHeader:
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

        cascade = self.cascade
        return _HEADER.substitute(
            name=self.name, macro=self.name.upper(), title=self.title, unit=self.unit,
            notes="".join(f" * {note}\n" for note in self.notes), version=version(), count=len(cascade.sections),
            bits=cascade.data_bits, largest=cascade.largest_input, input_step=repr(cascade.input_step),
            output_step=repr(cascade.output_step), rows="\n".join(map(_row, cascade.sections)))

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


def _weighting(question: FixedPointQuestion) -> _FilterHeader:
    from logger.api.rides import weighting_named
    from logger.dsp.fixed_point import FULL_SCALE_MPS2, fixed_cascade
    from logger.dsp.weightings.weighting import DELAY_SAMPLES
    from logger.units import STANDARD_GRAVITY_MPS2

    weighting = weighting_named(question.weighting)
    try:
        cascade = fixed_cascade(_sections(weighting, question.rate_hz), FULL_SCALE_MPS2, data_bits=question.data_bits)
    except ValueError as error:
        raise question.wrong("rate_hz", f" {question.rate_hz}: {error}") from None
    return _FilterHeader(
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


def _golden_car(question: FixedPointQuestion) -> _FilterHeader:
    from logger.dsp.fixed_point import FULL_SCALE_SLOPE, fixed_cascade
    from logger.roads.iri import golden_car_sections

    cascade = fixed_cascade(golden_car_sections(_SPACING_M), FULL_SCALE_SLOPE, data_bits=question.data_bits)
    return _FilterHeader(
        "ridelog_golden_car",
        f"Golden Car of the IRI, 80 km/h, a slope every {_SPACING_M:g} m, for slopes within +-{FULL_SCALE_SLOPE:g}",
        "m/m",
        ("In: slope of the road over 250 mm. Out: slope between body and wheel at the end of the step; the mean of its",
         "absolute value times 1000 is the IRI in m/km. Reset to the mean slope of the first 11 m."),
        cascade,
    )


_HEADER = Template("""\
/* $title
 *
$notes *
 * $count sections of second order, direct form I, remainders fed back; integers of $bits bits, coefficients of 32 with
 * 30 binary places, sums of 64. For inputs within +-$largest nothing overflows, in any order of the additions.
 * The specification is the docstring of logger/dsp/fixed_point.py of ridelog; this file was written by
 * "ridelog fixed-point", version $version.
 */
#ifndef ${macro}_H
#define ${macro}_H

#include <stdint.h>

#define ${macro}_SECTIONS $count
#define ${macro}_LARGEST_INPUT $largest
#define ${macro}_INPUT_STEP $input_step /* $unit per count; round to nearest, clip */
#define ${macro}_OUTPUT_STEP $output_step /* $unit per count */

/* b0, b1, b2, a1, a2, times 2^30; the comment is the largest output there can be */
static const int32_t ${name}_coefficients[${macro}_SECTIONS][5] = {
$rows
};

/* The last two inputs, outputs and remainders of each section, newest first. All zero is a filter at rest. */
typedef struct {
    int${bits}_t x[2], y[2];
    int32_t e[2];
} ${name}_section;

typedef struct {
    ${name}_section sections[${macro}_SECTIONS];
} ${name}_state;

/* n / d, rounded down; d > 0 */
static inline int64_t ${name}_floor(int64_t n, int64_t d)
{
    return n >= 0 ? n / d : ~(~n / d);
}

/* Start as if x had come in for ever. */
static inline void ${name}_reset(${name}_state *state, int${bits}_t x)
{
    for (int k = 0; k < ${macro}_SECTIONS; k++) {
        ${name}_section *s = &state->sections[k];
        const int32_t *c = ${name}_coefficients[k];
        const int64_t steady = ((int64_t)c[0] + c[1] + c[2]) * x;
        const int64_t rest = ((int64_t)1 << 30) + c[3] + c[4];
        const int64_t y = ${name}_floor(steady + rest / 2, rest);
        s->x[0] = s->x[1] = x;
        s->y[0] = s->y[1] = (int${bits}_t)y;
        s->e[0] = s->e[1] = (int32_t)${name}_floor((steady - y * rest) * ((int64_t)1 << 30), rest);
        x = (int${bits}_t)y;
    }
}

/* The next sample. */
static inline int${bits}_t ${name}_step(${name}_state *state, int${bits}_t x)
{
    const int64_t unit = (int64_t)1 << 30, half = unit / 2;
    for (int k = 0; k < ${macro}_SECTIONS; k++) {
        ${name}_section *s = &state->sections[k];
        const int32_t *c = ${name}_coefficients[k];
        int64_t w = ${name}_floor(half - (int64_t)c[3] * s->e[0] - (int64_t)c[4] * s->e[1], unit);
        w += (int64_t)c[0] * x + (int64_t)c[1] * s->x[0] + (int64_t)c[2] * s->x[1];
        w -= (int64_t)c[3] * s->y[0] + (int64_t)c[4] * s->y[1];
        const int64_t y = ${name}_floor(w + half, unit);
        s->x[1] = s->x[0];
        s->x[0] = x;
        s->y[1] = s->y[0];
        s->y[0] = (int${bits}_t)y;
        s->e[1] = s->e[0];
        s->e[0] = (int32_t)(w - y * unit);
        x = (int${bits}_t)y;
    }
    return x;
}

#endif
""")


def _row(section: "FixedSection") -> str:
    numbers = ", ".join(str(number) for number in (*section.b, *section.a))
    return f"    {{{numbers}}}, /* {section.largest_output} */"
