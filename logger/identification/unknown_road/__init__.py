"""Vehicle parameters from drives over roads that nobody measured; the road is integrated out.

In the order of reading: ``drive_operator`` (road to readings and back, linear), ``road_state`` (all numbers, and the
prior of the road), ``road_equations`` (the most probable road), ``relative_placement`` (of two drives),
``marginal_likelihood`` (its slopes and its information), ``fisher_scoring`` and ``road_fit``.
"""
