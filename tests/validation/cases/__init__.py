"""Random cases, each made from its kind and seed alone, and their files."""
