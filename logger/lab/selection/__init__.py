"""Which effects a model lacks: one score (evidence), one search (add, swap, drop), and what is not detectable.

Reading order: evidence, screening, candidate_fit, stepwise, holdout, detectability, add_effect.
"""
