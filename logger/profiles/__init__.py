"""Roads as tires meet them."""
