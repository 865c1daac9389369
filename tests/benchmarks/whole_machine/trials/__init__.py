"""The trials, by what they try; importing a module registers its trials."""
