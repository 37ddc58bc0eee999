"""A list of sound cards; by itself, so that a daemon in a process of its own does not load the simulated room."""

BLOCK = 400
"""Samples, 25 ms."""


class TwoCards:
    """The list of a computer with one microphone and one loudspeaker, in sounddevice's terms."""

    class PortAudioError(Exception):
        """As sounddevice has it."""

    def query_devices(self, device: object = None, kind: str | None = None) -> object:
        cards = [
            {"index": 0, "name": "mic", "max_input_channels": 1, "max_output_channels": 0, "default_samplerate": 16e3},
            {"index": 1, "name": "box", "max_input_channels": 0, "max_output_channels": 2, "default_samplerate": 48e3},
        ]
        return cards if kind is None else cards[0 if kind == "input" else 1]
