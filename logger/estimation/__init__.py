"""The road and its IRI from a car's acceleration.

In the order of reading: ``road_spectrum`` (prior of the road), ``sensor_noise`` and ``quantisation`` (likelihood of the
readings), ``car_response``, ``road_solver`` (the most probable road of one stretch), ``iri_posterior`` (its IRI),
``roughness`` (what is learned on the way), ``recursive_road`` and ``streaming`` (in the car), ``batch`` (at the
desk), ``error_bound``; and the relation of r.m.s. and IRI, ``rms_calibration``.
"""
