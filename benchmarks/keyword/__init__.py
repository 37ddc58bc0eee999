"""Trains the net of `hvcpd.recognition.keyword`: `clips` are said and collected, `material` mixes them, `train` fits."""
