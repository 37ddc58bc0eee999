"""Worlds between a robot's loudspeaker and another's ears: drawn from a seed, and a benchmark in them."""
