"""Faults that a logger meets in a car, and their trials."""
