"""What the residuals of a model look like: where their power sits, and tests that know no effect.

Reading order: breakdown, statistics, road_coherence, force_state_map, ``lab.residual_tests``; unexplained.
"""
