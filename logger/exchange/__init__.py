"""Rows of logs, and what is made of them, as files that other programs open: maps, tables, tracks.

Reading order: geometry, layer, windows, format, wkb, arrow_table, and one file a format in ``formats``.
"""
