"""Recognition of people, as opposed to robots: their voices, enrolled or not."""
