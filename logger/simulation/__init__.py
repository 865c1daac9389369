"""Drives of a model that never happened, as a recorder would have kept them."""
