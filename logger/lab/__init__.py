"""The lab: where a model and measurements differ, which physical effect is missing, and the model with it.

Reading order: likelihood (how likely runs are under a model), selection (which model), residuals (what they look like),
unknown_road (the same without a profile); then compare and diagnosis, and session, the loop as a whole.
"""
