"""Wire profiles: data files that say what a serial frame means."""
