"""A case put before the lab, and what it says, marked."""
