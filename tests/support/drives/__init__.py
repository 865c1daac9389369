"""Drives, simulated or made up, and what is needed to replay them."""
