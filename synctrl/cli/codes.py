"""With which code a command ends."""

from __future__ import annotations

#: what was asked for is done
DONE = 0
#: an input is refused, or something cannot be had, read or written; the message says what and where
REFUSED = 1
#: the command line itself is wrong
USAGE = 2
#: a run had to stop before its end; what was computed until then is written
STOPPED = 3
#: done, and what was looked at is not as it should be: readers that disagree, something missing, no run
#: that came to its end
FOUND_WANTING = 4
#: interrupted by Ctrl-C; what was computed until then is written
INTERRUPTED = 130
