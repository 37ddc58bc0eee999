"""Learns letter-to-sound conversion from a pronouncing dictionary, and measures them on held-out words."""
