"""The same question where nobody measured the road: several drives over one, which is integrated out.

Reading order: tabulated_response, likelihood, fisher_scoring, screening, same_road_test, diagnosis.
"""
