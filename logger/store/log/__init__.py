"""The logger's own files: written, closed, repaired after a cut of the power, and removed when room is short."""
