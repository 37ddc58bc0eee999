"""People who are no robots: their voices, enrolled or not."""

PEOPLE_FOLDER = "people"
"""Below `state_dir`: what is kept of those who are enrolled."""
