"""Trains the net that tells sounds of English apart, whoever says them (`hvcpd.people.phones`), on synthetic speech."""
