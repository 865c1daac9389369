"""Integer sections: the specification to the letter, bounds that are reached and never passed, silence, and noise."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from logger.dsp.filters import butterworth_sos, frequency_response
from logger.dsp.fixed_point import (
    FULL_SCALE_MPS2,
    FULL_SCALE_SLOPE,
    FixedCascade,
    FixedFilter,
    FixedSection,
    fixed_cascade,
    quiet,
)
from logger.dsp.weightings.wk import WEIGHTING
from logger.roads import iso8608
from logger.roads.iri import golden_car_sections, rectified_slope

WK = np.asarray(WEIGHTING.sections[100])
SOS = {
    "wk": (WK, FULL_SCALE_MPS2),
    "car-0.25": (golden_car_sections(0.25), FULL_SCALE_SLOPE),
    "car-0.05": (golden_car_sections(0.05), FULL_SCALE_SLOPE),
    "gravity": (butterworth_sos("high", 0.2, 100), FULL_SCALE_MPS2),
    "low-pass": (butterworth_sos("low", 15.0, 100), FULL_SCALE_MPS2),
}
CASCADES = {(name, bits): fixed_cascade(*what, bits) for name, what in SOS.items() for bits in (32, 16)}
every_cascade = pytest.mark.parametrize("cascade", CASCADES.values(), ids=[f"{name}, {b}" for name, b in CASCADES])


@dataclass
class Literal:
    """The specification of ``logger.dsp.fixed_point`` word for word; every word is checked to fit."""

    section: FixedSection
    data_bits: int
    x: list[int] = field(default_factory=lambda: [0, 0])
    y: list[int] = field(default_factory=lambda: [0, 0])
    e: list[int] = field(default_factory=lambda: [0, 0])
    highest: int = 0
    highest_sum: int = 0

    def fits(self, value: int, bits: int) -> int:
        assert -(2 ** (bits - 1)) <= value < 2 ** (bits - 1)
        return value

    def step(self, x: int) -> int:
        (b0, b1, b2), (a1, a2) = self.section.b, self.section.a
        for coefficient in (b0, b1, b2, a1, a2):
            self.fits(coefficient, 32)
        carry = self.fits(2**29 - a1 * self.e[0] - a2 * self.e[1], 64) // 2**30
        terms = [b0 * x, b1 * self.x[0], b2 * self.x[1], -a1 * self.y[0], -a2 * self.y[1], carry]
        self.fits(sum(map(abs, terms)) + 2**29, 64)
        w = sum(terms)
        y = self.fits((w + 2**29) // 2**30, self.data_bits)
        self.highest = max(self.highest, abs(y))
        self.highest_sum = max(self.highest_sum, sum(map(abs, terms)) + 2**29)
        self.x, self.y = [x, self.x[0]], [y, self.y[0]]
        self.e = [self.fits(w - 2**30 * y, 32), self.e[0]]
        return y


def literal(cascade: FixedCascade) -> list[Literal]:
    return [Literal(section, cascade.data_bits) for section in cascade.sections]


def through(stages: list[Literal], counts: list[int]) -> list[int]:
    outputs = []
    for count in counts:
        for stage in stages:
            count = stage.step(count)
        outputs.append(count)
    return outputs


def rounded_sos(cascade: FixedCascade) -> np.ndarray:
    return np.array([[*section.b, 2**30, *section.a] for section in cascade.sections]) / 2.0**30


def worst_signs(cascade: FixedCascade, node: int) -> list[int]:
    """The full-scale input that drives the output of section ``node`` to its bound."""
    impulse = np.zeros(6000)
    impulse[0] = 1.0
    response = signal.sosfilt(rounded_sos(cascade)[: node + 1], impulse)
    kept = np.flatnonzero(np.abs(response) > 1e-6 * np.abs(response).max())[-1] + 1
    return (np.where(response[:kept][::-1] < 0, -1, 1) * cascade.largest_input).tolist()


@every_cascade
@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e-7])
def test_the_filter_is_the_specification(cascade: FixedCascade, scale: float) -> None:
    rng = np.random.default_rng(1)
    counts = np.rint(rng.uniform(-1, 1, 400) * max(scale * cascade.largest_input, 2)).astype(np.int64)
    assert FixedFilter(cascade).process_counts(counts).tolist() == through(literal(cascade), counts.tolist())


@every_cascade
def test_the_worst_input_reaches_every_bound_and_overflows_nothing(cascade: FixedCascade) -> None:
    for node in range(len(cascade.sections)):
        stages = literal(cascade)
        through(stages, worst_signs(cascade, node))
        assert 0.998 * cascade.sections[node].largest_output < stages[node].highest
        for stage in stages:
            assert stage.highest <= stage.section.largest_output < 2 ** (cascade.data_bits - 1)
            assert stage.highest_sum <= stage.section.largest_sum < 2**63


def test_scales_are_not_coarser_than_they_must_be() -> None:
    for cascade in CASCADES.values():
        for section in cascade.sections:
            used = (section.largest_output / cascade.largest_input, section.largest_sum / 2**63,
                    max(map(abs, section.b)) / 2**31)
            assert max(used) > 0.99


@pytest.mark.slow
@every_cascade
@given(seed=st.integers(0, 2**32), size=st.sampled_from([1e-3, 1e-6, 0.0]))
@settings(max_examples=4)
def test_from_any_state_silence_becomes_zero(cascade: FixedCascade, seed: int, size: float) -> None:
    """Any, but small enough to stay in the words: no input leads to states in which all is large at random."""
    rng = np.random.default_rng(seed)
    stages, largest = literal(cascade), max(int(size * cascade.largest_input), 1)
    for stage in stages:
        stage.x, stage.y = (rng.integers(-largest, largest, 2, endpoint=True).tolist() for _ in range(2))
        stage.e = rng.integers(-(2**29), 2**29, 2).tolist()
    slowest = max(np.abs(np.roots(row[3:])).max() for row in rounded_sos(cascade))
    decayed = int(np.log(1e-12) / np.log(slowest)) + 50
    assert set(through(stages, [0] * (decayed + 300))[decayed:]) == {0}


@every_cascade
def test_after_full_scale_noise_silence_becomes_zero(cascade: FixedCascade) -> None:
    fixed, largest = FixedFilter(cascade), cascade.largest_input
    for seed in range(3):
        fixed.process_counts(np.random.default_rng(seed).integers(-largest, largest, 400 + seed))
        assert not fixed.process_counts(np.zeros(8000, dtype=np.int64))[6000:].any()


@pytest.mark.parametrize("bits", [32, 16])
@pytest.mark.parametrize("level_mps2", [9.81, -3.3333, 0.01])
def test_a_car_at_rest_gives_zeros_after_a_bump(bits: int, level_mps2: float) -> None:
    fixed = FixedFilter(CASCADES["wk", bits])
    fixed.reset(level_mps2)
    rest = np.full(3000, level_mps2)
    assert not fixed.process(rest).any()
    assert fixed.process(rest + 5 * np.hanning(3000)).any()
    assert not fixed.process(rest)[2000:].any()


@every_cascade
def test_reset_is_what_a_steady_input_comes_to(cascade: FixedCascade) -> None:
    was_reset, waited = FixedFilter(cascade), FixedFilter(cascade)
    value = 0.3 * cascade.largest_input * cascade.input_step
    was_reset.reset(value)
    waited.process(np.full(9000, value))
    difference = was_reset.process(np.full(500, value)) - waited.process(np.full(500, value))
    assert np.abs(difference).max() <= cascade.output_step * 1.001


@given(cuts=st.lists(st.integers(0, 500), max_size=20))
@settings(max_examples=25)
def test_any_split_gives_the_same_bits(cuts: list[int]) -> None:
    record = np.random.default_rng(3).standard_normal(500)
    stream = FixedFilter(CASCADES["wk", 32])
    pieces = np.concatenate([stream.process(piece) for piece in np.split(record, sorted(cuts))])
    assert pieces.tobytes() == FixedFilter(CASCADES["wk", 32]).process(record).tobytes()


def snr_db(exact: np.ndarray, found: np.ndarray) -> float:
    return float(10 * np.log10(np.sum(exact**2) / np.sum((exact - found) ** 2)))


@pytest.mark.parametrize("spacing_m", [0.3, 0.25, 0.05, 0.025, 0.01])
def test_the_quarter_car_on_a_smooth_road(spacing_m: float) -> None:
    elevation_m = iso8608.generate(16.0, 250.0, spacing_m, 1)  # class A: the smallest signal
    base = max(1, int(0.25 / spacing_m + 0.5))
    slope = (elevation_m[base:] - elevation_m[:-base]) / (base * spacing_m)
    exact_sections = golden_car_sections(spacing_m)
    exact = signal.sosfilt(exact_sections, slope)
    snrs_db = [snr_db(exact, FixedFilter(fixed_cascade(exact_sections, FULL_SCALE_SLOPE, bits)).process(slope))
               for bits in (32, 16)]
    print(f"Golden Car, {spacing_m} m, class A: {snrs_db[0]:.0f} dB at 32 bit, {snrs_db[1]:.0f} dB at 16 bit")
    assert snrs_db[0] > 90
    assert snrs_db[1] > 30


def test_the_iri_in_integers_is_the_iri() -> None:
    elevation_m = iso8608.generate(64.0, 200.0, 0.25, 4)
    slope = np.diff(elevation_m) / 0.25
    car = FixedFilter(CASCADES["car-0.25", 32])
    car.reset((elevation_m[44] - elevation_m[0]) / 11.0)
    np.testing.assert_allclose(np.abs(car.process(slope)), rectified_slope(elevation_m, 0.25), atol=1e-8, rtol=0)


@pytest.mark.parametrize(("bits", "least_db"), [(32, 90), (16, 30)])
def test_wk_on_road_like_noise(bits: int, least_db: float) -> None:
    accel = signal.sosfilt(signal.butter(2, [1, 12], "band", fs=100, output="sos"),
                           np.random.default_rng(5).standard_normal(20_000))
    found_db = snr_db(signal.sosfilt(WK, accel), FixedFilter(CASCADES["wk", bits]).process(accel))
    print(f"Wk, {np.std(accel):.2f} m/s2 r.m.s. of +-16 g: {found_db:.0f} dB at {bits} bit")
    assert found_db > least_db


@pytest.mark.parametrize("name", ["wk", "car-0.05", "gravity"])
def test_rounding_adds_one_twelfth_of_a_step_per_section_and_does_not_go_round(name: str) -> None:
    cascade = CASCADES[name, 16]
    counts = np.random.default_rng(6).integers(-9000, 9000, 30_000)
    sos = rounded_sos(cascade)
    error = FixedFilter(cascade).process_counts(counts) - signal.sosfilt(sos, counts)
    impulse = np.zeros(4000)
    impulse[0] = 1.0
    shares = [1.0, *(np.sum(signal.sosfilt(sos[first:], impulse) ** 2) for first in range(1, len(sos)))]
    assert np.mean(error**2) == pytest.approx(sum(shares) / 12, rel=0.1)


def test_pairing_and_order_leave_the_filter_as_it_is() -> None:
    f_hz = np.linspace(0.1, 50, 300)
    impulse = np.zeros(3000)
    impulse[0] = 1.0
    arranged = quiet(WK, impulse)
    np.testing.assert_allclose(frequency_response(arranged, f_hz, 100), frequency_response(WK, f_hz, 100), rtol=1e-12)
    assert abs(arranged[0, :3].sum()) < 1e-12


def test_the_order_is_the_best_there_is() -> None:
    impulse = np.zeros(2000)
    impulse[0] = 1.0
    rows = WK[1:5]

    def noise(order: tuple[int, ...]) -> float:
        total = 0.0
        for done in range(1, len(order) + 1):
            reach = np.abs(signal.sosfilt(arranged[list(order[:done])], impulse)).sum()
            rest = signal.sosfilt(arranged[list(order[done:])], impulse) if done < len(order) else impulse
            total += reach**2 * np.sum(rest**2)
        return float(total)

    arranged = quiet(rows, impulse)
    assert noise((0, 1, 2, 3)) == pytest.approx(min(noise(order) for order in permutations(range(4))))


def test_inputs_are_rounded_to_even_and_clipped() -> None:
    fixed = FixedFilter(fixed_cascade(WK, 32767.0, 16))
    values = np.array([0.5, 1.5, -2.5, 32766.6, 1e9, -1e9, np.inf])
    assert fixed.counts(values).tolist() == [0, 2, -2, 32767, 32767, -32767, 32767]
    with pytest.raises(ValueError, match="NaN"):
        fixed.process(np.array([1.0, np.nan]))


@pytest.mark.parametrize(("sos", "bits", "full_scale", "complaint"), [
    ([[1.0, 0, 0, 1, 0, 1.01]], 32, 1.0, "stable"),
    ([[1.0, 0, 0, 1, -1.999999, 0.9999995]], 32, 1.0, "poles within"),
    ([[1.0, 0, 0, 1, -(2**31 - 49392 - 0.45) / 2**30, (2**30 - 49392) / 2**30]], 32, 1.0, "stable with 32-bit"),
    ([[1.0, 0, 0, 1, -(2**31 - 66572 - 1) / 2**30, (2**30 - 66572) / 2**30]], 32, 1.0, "decays to zero"),
    ([[1.0, 0, 0, 1, -1.9998, 0.99980001]], 32, 1.0, "keeps from overflow"),
    (golden_car_sections(0.001), 32, 1.0, "wider spacing"),
    (WK, 24, 1.0, "16 or 32"),
    (WK, 32, 0.0, "full scale"),
    (WK, 32, float("nan"), "full scale"),
    (np.ones((2, 5)), 32, 1.0, "rows of 6"),
])
def test_what_cannot_be_is_refused(sos: np.ndarray, bits: int, full_scale: float, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        fixed_cascade(sos, full_scale, bits)
