"""A fixed-point filter as one C99 header: its coefficients and the loop of ``logger.dsp.fixed_point``'s specification.

Problem: numbers copied by hand into firmware, and a loop written from memory, are a second filter that nobody has
checked. Solution: the header is made from the same integers that run here. It needs nothing but <stdint.h>. All
divisions round down through one function, as C's own round towards zero and its shifts of negative numbers are left
to the compiler; compilers make a shift of a division by 2^30. Names carry the filter's, so that headers stand
side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from string import Template

from logger.dsp.fixed_point import FixedCascade, FixedSection

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


def c_header(name: str, title: str, unit: str, notes: Sequence[str], cascade: FixedCascade, version: str) -> str:
    """Text of the header; ``name`` is the C prefix (lower case), ``unit`` that of inputs and outputs."""
    return _HEADER.substitute(
        name=name,
        macro=name.upper(),
        title=title,
        unit=unit,
        notes="".join(f" * {note}\n" for note in notes),
        version=version,
        count=len(cascade.sections),
        bits=cascade.data_bits,
        largest=cascade.largest_input,
        input_step=repr(cascade.input_step),
        output_step=repr(cascade.output_step),
        rows="\n".join(map(_row, cascade.sections)),
    )


def _row(section: FixedSection) -> str:
    numbers = ", ".join(str(number) for number in (*section.b, *section.a))
    return f"    {{{numbers}}}, /* {section.largest_output} */"
