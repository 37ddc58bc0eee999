"""Words to sound: pronunciations, prosody and a Klatt-type formant synthesizer. Pure numpy, no I/O but the cache."""
