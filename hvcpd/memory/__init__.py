"""A robot's memory: its store, and the journal that writes into it."""
