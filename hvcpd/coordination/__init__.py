"""Coordination by speech: greeting, tasks, claims, orders and the floor, without I/O and without a clock."""
