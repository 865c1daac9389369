"""Drives as a recorder in a car left them, into runs that a model can be compared with."""
