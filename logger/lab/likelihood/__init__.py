"""How likely runs are under a model: noise with a free level in each band, priors of nuisance parameters, and fits.

Reading order: whittle, priors, distance_error, posterior, linear_model, map_fit, standard_errors, noise_floor; lag.
"""
