"""Diagnosis without a measured profile: several drives over one road, which is integrated out.

Reading order: same_road, diagnosis.
"""
