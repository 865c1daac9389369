"""Whittle's likelihood: power in bands is what an independent estimate says, weights make noise of any colour white,
and no level is believed below the share of the signal by which right simulations differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import solve_toeplitz
from scipy.signal import welch
from scipy.sparse import csr_array, vstack

from logger.lab.likelihood.signals import bands_of, deviance, deviance_standard_error
from logger.lab.likelihood.whittle import DISCREPANCY, Bands
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.runs import RecordFacts, Run, Signal

Array = npt.NDArray[np.float64]
NOISE = 0.05


def run_of(samples: int, rate_hz: float = 100.0, measured: Array | None = None) -> Run:
    zeros = np.zeros(samples)
    return Run("run", rate_hz, zeros if measured is None else measured, np.arange(samples) * 0.1, zeros + 10.0,
               Track(1.0, np.zeros(3)))


def white(samples: int, seed: int = 1) -> Array:
    return np.random.default_rng(seed).normal(0, NOISE, samples)


def coloured(samples: int, seed: int = 2) -> Array:
    return np.convolve(white(samples, seed), [1.0, 1.6, 0.8], "same")


@pytest.mark.parametrize("rate_hz", [100.0, 80.0, 200.0])
def test_white_noise_has_its_variance_in_every_band_and_where_it_is_quiet(rate_hz: float) -> None:
    samples = round(400 * rate_hz)
    noise, bands = white(samples), Bands(run_of(samples, rate_hz))
    deviations = (bands.power(noise) / NOISE**2 - 1) / np.sqrt(2 / bands.freedom)
    assert np.abs(deviations).max() < 4.0  # of some twenty bands
    power, freedom = bands.noise_band_power(noise)
    assert abs(power / NOISE**2 - 1) < 4 * np.sqrt(2 / freedom)


def test_power_is_that_of_welchs_method() -> None:
    residual, run = coloured(3200), run_of(3200)
    bands = Bands(run)
    f_hz, density = welch(residual[run.first:], 100.0, "hann", 300, 150, detrend=False)
    expected = [density[(f_hz >= low) & (f_hz < high)].mean() * 50.0
                for low, high in zip(bands.edges_hz[:-1], bands.edges_hz[1:], strict=True)]
    assert bands.power(residual) == pytest.approx(expected, rel=1e-9)


def test_powers_scatter_by_their_degrees_of_freedom() -> None:
    """Chi-squared with n degrees of freedom: a variance of 2 / n, that of overlapping blocks a little larger."""
    bands = Bands(run_of(2700))
    powers = np.array([bands.power(white(2700, seed)) for seed in range(300)]) / NOISE**2
    assert (powers.var(axis=0) * bands.freedom / 2).mean() == pytest.approx(1.1, abs=0.2)
    assert bands.freedom.sum() == pytest.approx(2 * (bands.edges_hz[-1] - bands.edges_hz[0]) * 25.0, rel=0.02)


@pytest.mark.parametrize("rate_hz", [49.6, 75.0, 99.5, 99.8, 99.99999, 100.00001, 101.0, 119.8, 174.0])
@pytest.mark.parametrize("seconds", [5.0, 12.0, 33.0, 61.3])
def test_every_band_has_a_power_whatever_the_rate_and_the_length(rate_hz: float, seconds: float) -> None:
    run = run_of(round(seconds * rate_hz), rate_hz)
    bands, noise = Bands(run), white(run.count, 3)
    assert np.isfinite(bands.power(noise)).all() and bands.freedom.min() > 0
    mean = bands.freedom @ bands.power(noise) / bands.freedom.sum()
    assert abs(mean / NOISE**2 - 1) < 5 * np.sqrt(2 / bands.freedom.sum())


def test_weighed_noise_of_any_colour_has_the_power_of_its_bands() -> None:
    samples = 12_200
    residual, bands = coloured(samples), Bands(run_of(samples))
    whitened = bands.whitener(residual).in_time(residual)
    assert whitened.shape == (12_000,)
    in_bands = (bands.edges_hz[-1] - bands.edges_hz[0]) / 50.0
    assert (whitened**2).mean() == pytest.approx(in_bands, rel=0.03)


@pytest.mark.parametrize("samples", [12_200, 4473])  # of 4273, which count, a transform is slow: more are transformed
def test_products_are_those_of_the_whitened_samples(samples: int) -> None:
    one, other = white(samples, 1), coloured(samples, 2)
    whitener = Bands(run_of(samples)).whitener(other)
    rows, times = whitener(np.stack([one, other])), whitener.in_time(np.stack([one, other]))
    assert rows @ rows.T == pytest.approx(times @ times.T, rel=2e-3, abs=2e-3 * (times[0] @ times[0]))


@pytest.mark.parametrize(("seconds", "off"), [(60, 1e-12), (240, 0.003)])
def test_products_of_sparse_rows_are_those_of_the_whitened_rows_summed_stretch_by_stretch_where_a_run_is_long(
        seconds: int, off: float) -> None:
    """A run of one stretch is whitened as a whole; of a longer one hardly anything is different, also where the sum of
    the short rows is all but one of the long ones, as a scale of the way is."""
    n = 100 * seconds
    whitener = Bands(run_of(n, measured=white(n, 3))).whitener(coloured(n))
    swings = np.sin(0.09 * np.arange(n)) + white(n)
    short = csr_array([np.where(abs(np.arange(n) - middle) < 100, swings, 0.0) for middle in range(500, n - 400, 100)])
    rows = csr_array(vstack([short, csr_array([1.001 * short.sum(axis=0)])]))
    dense, found = whitener(rows.toarray()), whitener.products(rows)
    sizes = np.sqrt((dense**2).sum(axis=1))
    assert np.abs(found - dense @ dense.T).max() < off * sizes.max() ** 2
    assert np.abs((found - dense @ dense.T) / np.outer(sizes, sizes)).max() < off
    assert np.linalg.eigvalsh(found)[0] > -1e-9 * found.max()


@pytest.mark.parametrize("seconds", [50, 190])  # whole, and in fourteen stretches
def test_products_and_squares_are_those_of_the_dense_likelihood_of_noise_with_that_spectrum(seconds: int) -> None:
    """Whittle's likelihood beside the one that it approximates: noise whose spectrum is that of the whitener, and a
    thousand times as much outside of all bands; its covariance matrix is solved by N. Levinson's recursion. However
    long a record is, and wherever its stretches end, products of short rows are alike within 0.2 %, squares of those
    that are as long as the record within 2 %. Only what its own ends cut off is a third too large."""
    rate_hz = 20.0
    n = round(seconds * rate_hz)
    noise, swings, bands = coloured(n), np.sin(0.9 * np.arange(n)) + white(n), Bands(run_of(n, rate_hz, white(n, 3)))
    whitener = bands.whitener(noise)
    short = [swings * np.exp(-0.5 * ((np.arange(n) - middle) / 8) ** 2) for middle in range(bands.first, n, 54)]
    rows = np.vstack([short, np.sum(short, axis=0), swings])

    f_hz = np.fft.rfftfreq(16 * n, 1 / rate_hz)
    inside = (f_hz >= bands.edges_hz[0]) & (f_hz < bands.edges_hz[-1])
    middle_hz = 0.5 * (bands.edges_hz[1:] + bands.edges_hz[:-1])
    spectrum = np.exp(np.interp(f_hz, middle_hz, np.log(bands.levels(noise))))
    covariance = np.fft.irfft(np.where(inside, spectrum, 1e3 * spectrum.max()))[: n - bands.first]
    counted = np.vstack([rows, noise])[:, bands.first :]
    dense = counted @ solve_toeplitz(covariance, counted.T)

    white_rows = whitener(np.vstack([rows, noise]))
    found = whitener.products(csr_array(np.where(abs(rows) > 1e-9, rows, 0.0)))
    sizes = np.sqrt(np.diag(dense))
    off = np.abs((white_rows @ white_rows.T - dense) / np.outer(sizes, sizes))
    off[:-1, :-1] = np.maximum(off[:-1, :-1], np.abs((found - dense[:-1, :-1]) / np.outer(sizes[:-1], sizes[:-1])))
    assert off[1:-5, 1:-5].max() < 0.002
    assert np.diag(off)[-3:].max() < 0.02


def test_columns_are_weighed_like_a_residual_and_the_beginning_counts_nowhere() -> None:
    run = run_of(2000)
    bands = Bands(run)
    one, other = white(2000, 1), coloured(2000, 2)
    whitener = bands.whitener(other)
    assert whitener(np.stack([one, other])) == pytest.approx(np.stack([whitener(one), whitener(other)]))
    begun = one + 100.0 * (np.arange(2000) < run.first)
    assert bands.power(begun) == pytest.approx(bands.power(one))
    assert whitener(begun) == pytest.approx(whitener(one))


def test_what_is_twice_as_strong_costs_the_logarithm_of_four_for_each_degree_of_freedom() -> None:
    bands, noise = Bands(run_of(6000)), white(6000, 3)
    assert bands.deviance(2 * noise) - bands.deviance(noise) == pytest.approx(np.log(4) * bands.freedom.sum())
    assert deviance([bands, bands], [noise, 2 * noise]) == pytest.approx(
        bands.deviance(noise) + bands.deviance(2 * noise))


def test_the_levels_are_the_most_likely_ones() -> None:
    bands, residual = Bands(run_of(3000)), coloured(3000)
    power, level = bands.power(residual), bands.levels(residual)

    def minus_twice_log(levels: Array) -> float:
        return float(bands.freedom @ (np.log(levels) + power / levels - 1))

    assert bands.deviance(residual) == pytest.approx(minus_twice_log(level))
    for factor in (0.9, 1.1):
        assert minus_twice_log(factor * level) > bands.deviance(residual) + 1.0


def test_a_fit_to_a_rig_is_one_by_least_squares() -> None:
    """A right model leaves white noise. Of what a wrong one leaves besides, loud at the bottom as the motion is, each
    band counts with its power: the likeliest size of a part of the motion is that of a regression."""
    run = replace(run_of(6000), track=Excitation(100.0, np.zeros(6000)))
    bands, motion = Bands(run), coloured(6000)
    left = motion + coloured(6000, 7) + white(6000, 3)
    assert len(set(bands.levels(left))) == 1
    whitener = bands.whitener(left)
    inside = bands.flat_whitener(np.ones(6000))
    one, other = ((white(motion) @ white(left)) / (white(motion) @ white(motion)) for white in (whitener, inside))
    assert one == pytest.approx(other, rel=1e-9)
    shares = other + np.array([-0.2, 0.0, 0.2])
    low, best, high = (bands.deviance(left - share * motion) for share in shares)
    assert best < min(low, high)
    assert abs(low - high) < 0.05 * (low + high - 2 * best)


def test_no_level_is_below_the_discrepancy_which_is_a_share_of_the_signal_in_its_band() -> None:
    signal = 20 * coloured(6000)
    bands = Bands(run_of(6000, measured=signal))
    assert bands.floor == pytest.approx(DISCREPANCY**2 * bands.power(signal))
    assert bands.levels(1e-7 * signal) == pytest.approx(bands.floor)
    assert bands.levels(signal) == pytest.approx(bands.power(signal))
    assert Bands(run_of(6000, measured=10 * signal)).floor == pytest.approx(100 * bands.floor)


def test_what_is_far_below_the_discrepancy_gains_next_to_nothing_more() -> None:
    signal = 20 * coloured(6000)
    bands = Bands(run_of(6000, measured=signal))
    at, below, nothing = (bands.deviance(share * DISCREPANCY * signal) for share in (1.0, 0.1, 0.0))
    assert at - below == pytest.approx(0.99 * bands.freedom.sum())
    assert below - nothing == pytest.approx(0.01 * bands.freedom.sum())


def test_where_nothing_but_zeros_was_measured_nothing_is_divided_by_nothing() -> None:
    bands = Bands(run_of(2000))
    assert np.isfinite(bands.deviance(np.zeros(2000)))
    assert np.isfinite(bands.whitener(np.zeros(2000))(white(2000))).all()


def test_bands_of_a_rig_go_on_above_those_of_cars() -> None:
    rate_hz, count = 400.0, 4000
    nothing = np.zeros(count)
    rig = Run("rig", rate_hz, np.ones(count), nothing, nothing, Excitation(rate_hz, nothing))
    edges = Bands(rig).edges_hz
    assert edges[-1] == pytest.approx(0.37 * rate_hz)
    assert (np.diff(edges)[edges[:-1] > 30.0] < 0.15 * edges[1:][edges[:-1] > 30.0]).all()
    car = Run("car", rate_hz, np.ones(count), nothing, nothing, Track(1.0, np.zeros(2)))
    assert Bands(car).edges_hz[-2:] == pytest.approx([37.0, 0.37 * rate_hz])


def test_products_of_whitened_samples_are_the_same_both_ways_also_of_a_force_that_is_compared_from_0_hz() -> None:
    """A whitener and its adjoint: <W x, y> = <x, W' y>; 0 Hz has no negative, and counts once."""
    force = Signal("force_n", "force", "front_suspension")
    run = replace(run_of(1500), track=Excitation(100.0, np.zeros(1500), moves_part=True), facts=RecordFacts(main=force))
    bands = Bands(run)
    assert bands.edges_hz[0] == 0.0
    whitener, samples = bands.whitener(coloured(1500)), 3.0 + white(1500)
    seen = whitener(5.0 + coloured(1500, 4))
    assert whitener(samples) @ seen == pytest.approx(samples @ whitener.adjoint(seen[None])[0], rel=1e-9)
    assert (whitener.in_time(samples)**2).sum() == pytest.approx((whitener(samples)**2).sum(), rel=0.05)


@pytest.mark.parametrize("lines", [None, 6])
@pytest.mark.parametrize("on_rig", [False, True])
def test_the_standard_error_of_a_difference_of_deviances_is_how_it_scatters_from_draw_to_draw(
        on_rig: bool, lines: int | None) -> None:
    """Two models that leave as much besides the noise: at all frequencies, or in a few lines, where lines that are
    taken for so many witnesses would say that the difference is certain."""
    rng, samples = np.random.default_rng(5), 2400
    run = run_of(samples, measured=np.sin(np.arange(samples)))
    bands = [bands_of(replace(run, track=Excitation(100.0, np.zeros(samples))) if on_rig else run)]

    def disturbance() -> Array:
        if lines is None:
            return rng.normal(0, NOISE, samples)
        spectrum = np.zeros(samples // 2 + 1, complex)
        spectrum[rng.choice(np.arange(60, 800), lines)] = rng.normal(0, 1, (lines, 2)) @ (1, 1j)
        return np.fft.irfft(spectrum, samples) * samples * NOISE / np.sqrt(lines)

    differences, errors = [], []
    for _ in range(200):
        noise = rng.normal(0, NOISE, samples)
        one, other = ([noise + disturbance()] for _ in range(2))
        differences.append(deviance(bands, other) - deviance(bands, one))
        errors.append(deviance_standard_error(bands, one, other))
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(differences), rel=0.2)
