"""Trains the speaker-independent phone net (`hvcpd.people.phones`) on synthetic speech."""
