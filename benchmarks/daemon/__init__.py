"""The whole daemon's figures: idle cost, start, time to reply, endurance."""
