"""Trust: keys, spoken seals, one-time codes; no clock, no files, no random source."""
