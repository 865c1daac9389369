"""The examination of the lab: cases by a simulator that shares nothing with ridelog, put before it and marked.

In reading order: ``simulator``, ``cases``, ``marking``, ``report``; ``examine`` and ``make`` are started from the
repository's root with ``python -m tests.validation.examine`` and ``python -m tests.validation.make``.
"""
