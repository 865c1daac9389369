"""Damaged and huge input for every reader."""
