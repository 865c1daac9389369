"""Families of laws that may be learned: one file each, which offers ``FAMILY``."""
