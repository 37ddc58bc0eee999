"""Trains the net of `hvcpd.recognition.keyword`: `clips` collects what is said, `material` mixes it, `train` fits."""
