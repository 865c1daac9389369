"""Vehicle parameters from drives over roads that nobody measured; the road is integrated out.

In the order of reading: ``drive_operator`` (road to readings and back, linear), ``marginal_likelihood`` (of drives over
one road), ``road_fit`` (Fisher scoring over several roads, and what is found).
"""
