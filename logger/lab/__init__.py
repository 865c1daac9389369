"""The lab: where a model and measurements differ, which physical effect is missing, and the model with it."""
