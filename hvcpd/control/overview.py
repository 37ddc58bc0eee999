"""The help of `hvcpctl` itself."""

from __future__ import annotations

from hvcpd.config.command_line import Parser

OVERVIEW = """\
usage: hvcpctl [-h] [--version] COMMAND ...

Try, watch and control robots that coordinate by speaking English. Try it here:
  simulate                      run a mission in a simulated room
  duet                          talk with two robots at this computer
  playground                    write a page in which robots say what you type
  say, hear, listen, phrases    speak, list or follow sentences; print them all
A running robot:
  status, follow, console       see what it does; the console is for the browser
  tasks, task                   list its tasks; repeat, skip, add or remove one
  stop, resume, reload, range   halt it; let it go on; how far are others?
  transcript, report, audit     read what it said, heard and did
  skills, ros, mqtt, mcap       connect devices, ROS, Home Assistant, Foxglove
Set a robot up:
  new-team                      write the settings and tasks of a new team
  doctor, config, bench         find what is wrong; show settings; measure speed
  calibrate, drive, stop-test   set the gain; move the wheels; try "stop"
  key, enrol                    make the team's key; teach robots your voice
  check-vocabulary, pronounce, prerender, voices    words, and how they sound
More: evaluate (the paper's experiments), completion (of the shell)

`hvcpctl COMMAND --help` explains a command. Exit status: 0 success, 1 not done,
2 bad input or no device, 3 no daemon runs, 4 no permission, 130 interrupted.
"""
"""All commands in one screen of 24 lines and 80 columns."""


class Overview(Parser):
    """Parser whose help is the overview."""

    def format_help(self) -> str:
        """As argparse's."""
        return OVERVIEW
