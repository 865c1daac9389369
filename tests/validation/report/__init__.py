"""The figures of an examination as pages."""
