"""Learns how words are said from a pronouncing dictionary, and measures how well that holds for words kept back."""
