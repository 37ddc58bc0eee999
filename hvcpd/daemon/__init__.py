"""The robot's body in real time: the one that hears by a microphone, speaks by a loudspeaker and drives on wheels."""
