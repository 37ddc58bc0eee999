"""Recognition of people, as opposed to robots: their voices, enrolled or not."""

PEOPLE_FOLDER = "people"
"""Folder below `state_dir` with the data of enrolled people."""
