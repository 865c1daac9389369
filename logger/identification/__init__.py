"""Vehicle parameters from drives: grey-box identification.

In the order of reading: ``unknown_inputs`` (bumps, steps, scales), ``drive_model`` (what is free; predictions and their
derivatives, in frequency and in time), ``noise_models``, ``prediction_error_fit``, ``identifiability`` (what to
believe), ``shared_road_covariance`` (standard errors of several drives over one road), ``session`` (around a fit),
``unknown_road`` (no profile at all).
"""
