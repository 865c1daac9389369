"""Laws that are learned from data where no effect of the list explains it."""
