"""The recorded demonstration drive and the program that made it."""
