"""What ridelog promises in figures, each measured by a program: ``python -m tests.benchmarks.NAME``."""
