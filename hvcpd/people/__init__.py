"""People who are no robots: their voices, enrolled or not."""
