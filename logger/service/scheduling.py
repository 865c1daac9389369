"""Being on time on a machine that has other things to do.

Problem. A sample is taken when its thread runs, so the service wants to go before all else. systemd can see to that
(``CPUSchedulingPolicy=rr``), but a kernel with scheduling of real-time groups refuses it, and then systemd does not
start the service at all.

Solution. The unit only permits it (``LimitRTPRIO=``), and the service asks for it itself. Refused, it goes on with the
niceness that the unit gives it, and says so. Where nothing is permitted, as in a terminal, nothing is asked for.
"""

from __future__ import annotations

import logging
import os
import resource

PRIORITY = 10
log = logging.getLogger(__name__)


def go_first() -> None:
    """Make the calling thread, and all that it starts from now on, real-time (round robin), if that is permitted."""
    permitted, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    if permitted != resource.RLIM_INFINITY and permitted < PRIORITY:
        return
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    except OSError as error:
        log.warning("no real-time priority (%s): on a busy machine samples can be late", error.strerror)
