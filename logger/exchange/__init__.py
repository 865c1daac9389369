"""Rows of logs, and what is made of them, as files that other programs open: one file a format in ``formats``."""
