"""A robot's memory: its store, and the journal that writes into it."""

PEOPLE_FOLDER = "people"
"""Folder below `state_dir` with the data of enrolled people."""
