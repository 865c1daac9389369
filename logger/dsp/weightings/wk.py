"""Wk: vertical vibration of people who sit or stand; the weighting of ride comfort.

Source: ISO 2631-1:1997 Tables 1 and A.1; Table 2.7 of Blum (2015). The sections are what
``logger.dsp.design.design_sections(WEIGHTING, 100)`` gives; a test designs them again.
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting(
    name="wk",
    f1_hz=0.4,
    f2_hz=100.0,
    f3_hz=12.5,
    f4_hz=12.5,
    q4=0.63,
    f5_hz=2.37,
    q5=0.91,
    f6_hz=3.35,
    q6=0.91,
    sections={
        100: (
            (0.9823854385260917, -1.9647708770521835, 0.9823854385260917, 1.0, -1.964460580205232, 0.965081173899135),
            (
                0.3919665775123169,
                0.38694554861491703,
                0.018694588089409676,
                1.0,
                0.8975742583427928,
                -0.03355423052882682,
            ),
            (
                1.7398300245378768,
                -0.6996663202511088,
                -0.040163704286768034,
                1.0,
                -0.9510847071730444,
                0.2873083737210072,
            ),
            (1.0, -1.8286804175752385, 0.849085908887849, 1.0, -1.754013084163612, 0.7934144166408529),
            (-0.03168269961678116, 0.280089703237435, 0.7515929963793462, 1.0, 0.330019464125464, -0.01313855920293657),
        ),
    },
)
