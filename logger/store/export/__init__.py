"""Copies of the logs on sticks that may be pulled at any instant, and what is remembered of them."""
