"""Whether it is a vehicle's file that is rough, and no effect that is missing.

Problem: a car whose masses, springs and dampers are all off by more than they were taken to be looks like one that
lacks an effect, which then does what these numbers would do. Solution: the file is a rough one where the numbers that
were measured lie beyond their tolerance on the whole, and where effects were found, but the numbers alone, with a wider
tolerance that the evidence pays for, have as much of it. All is then asked again with that tolerance.
"""

from __future__ import annotations

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import fit_model
from logger.lab.likelihood.standard_errors import standard_errors


def is_file_rough(before: LinearModel, after: LinearModel, effects_found: bool) -> bool:
    """Whether a vehicle's file is to be taken for a rough one.

    before           the fitted model as it was
    after            fitted with a normal prior of the car's numbers, with the effects that were found or asked for
    effects_found    whether these gain more than noise would
    """
    posterior = after.posterior
    if not posterior.may_be_rough:
        return False
    if posterior.prior.off_on_the_whole(after.state.logs, standard_errors(after).logs):
        return True
    return effects_found and _do_numbers_explain_all(before, after)


def _do_numbers_explain_all(before: LinearModel, after: LinearModel) -> bool:
    """Whether the car's numbers alone, in a rough file, have as much evidence as the effects: these do what the numbers
    would, and hide how far they are off."""
    state = before.state
    rough = after.posterior.without_rounding().with_rough_file().without_soft_bounds()
    alone = fit_model(rough, rough.state_at(state.effects, state.logs, state.record, state.size))
    return alone.score + alone.numbers_occam_factor <= after.score + after.numbers_occam_factor
