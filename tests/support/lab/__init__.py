"""Runs for the tests of the lab and of its commands."""
