"""Experiment design: which effects drives would detect and distinguish before anybody drives, and which drive would add
most."""
