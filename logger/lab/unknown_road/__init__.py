"""Diagnosis without a measured profile: several drives over one road, which is integrated out.

Reading order: tabulated_response, likelihood, fisher_scoring, screening, same_road_test, diagnosis.
"""
