"""The phrasebook: the one source of what can be said, heard, understood and printed."""
