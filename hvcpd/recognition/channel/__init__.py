"""Hears robots through a channel that nobody knows: loudspeaker, room and clocks are estimated along with the words."""
