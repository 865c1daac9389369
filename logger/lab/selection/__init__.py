"""Which effects a model lacks: one score (evidence), one search (add, swap, drop), and what runs could not show.

Reading order: evidence, screening, candidate_fit, stepwise, holdout, detectability, add_effect.
"""
