"""Seeds of the examination, kept apart: those that the lab is developed with, and those of what is published.

Problem: a lab that is changed until certain cases come out right is fitted to these cases, and what it reaches on
them is no measure of it. Solution: a range of seeds is used by published examinations alone, and only when that is said
on the command line (``--release``); every other seed is for development.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

DEVELOPMENT_SEEDS = range(2000, 2100)
"""Where development runs begin unless another seed is given; a whole one uses all of them."""

RELEASE_SEEDS = range(7000, 10000)
"""Of published examinations. Nothing may be tuned, chosen or mended by what comes of them."""


def add_seed_options(parser: ArgumentParser) -> None:
    """--first-seed and --release, for ``first_seed``."""
    parser.add_argument("--first-seed", type=int,
                        help=f"default: {DEVELOPMENT_SEEDS[0]}, of a release {RELEASE_SEEDS[0]}")
    parser.add_argument("--release", action="store_true", help="of the seeds that no development run has used")


def first_seed(options: Namespace) -> int:
    """The seed to begin with, as it was said, or the first of its range."""
    if options.first_seed is not None:
        return int(options.first_seed)
    return (RELEASE_SEEDS if options.release else DEVELOPMENT_SEEDS)[0]


def seeds(first: int, count: int, release: bool) -> range:
    """``count`` seeds from ``first`` on. ValueError: some are for releases and this is none, or the other way round."""
    asked = range(first, first + count)
    kept_back = [seed for seed in asked if seed in RELEASE_SEEDS]
    if len(kept_back) != (count if release else 0):
        low, high = RELEASE_SEEDS[0], RELEASE_SEEDS[-1]
        raise ValueError(f"seeds {first} to {asked[-1]}: " + (
            f"a release uses seeds from {low} to {high}" if release else
            f"those from {low} to {high} are kept for releases (--release)"))
    return asked
