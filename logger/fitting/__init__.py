"""Minimisers that know no data and no models."""
