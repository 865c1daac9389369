"""Vehicle parameters from drives: grey-box identification.

In the order of reading: ``unknown_inputs``, ``obstacle_paths``, ``road_transform`` (the road under the wheels),
``drive_model`` (what is free), ``frequency_domain_model`` (predictions of linear cars and their derivatives),
``time_domain_model`` (those of cars with effects), ``noise_models``, ``prediction_error_fit``, ``identifiability`` and
``residual_whiteness`` (what to believe), ``shared_road_covariance`` (standard errors of several drives over one road),
``obstacle_search`` and ``session`` (around a fit), ``unknown_road`` (no profile at all).
"""
