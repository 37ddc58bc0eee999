"""Recognises robots through an unknown channel: loudspeaker, room and clocks are estimated along with the words."""
