"""What the residuals of a model look like: where their power sits, and tests that know no effect.

Reading order: breakdown, block_statistics, road_coherence, force_state_map, spectral_lines, ``lab.residual_tests``;
unexplained.
"""
