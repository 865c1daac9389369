"""Cars, roads, effects and the recorder, from Newton's laws alone."""
