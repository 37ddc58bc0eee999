"""Detects one word, from any speaker and over any other sound."""
