"""Rows of logs, and what is made of them, as files that other programs open: maps, tables, tracks.

Reading order: layer, format, arrow_table, and one file a format in ``formats``.
"""
