"""Vehicle parameters from drives over roads that nobody measured; the road is integrated out.

In the order of reading: ``road_operator`` (road to readings and back, the most probable road), ``marginal_likelihood``
(of all numbers: its slopes and its information), ``road_fit`` (from start to verdict).
"""
