"""Logs as files that other programs open: maps, tables, tracks.

Reading order: windows, format, wkb, arrow_table, and one file a format in ``formats``.
"""
