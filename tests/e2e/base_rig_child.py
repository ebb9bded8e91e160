"""Drives the base at the address it is given, until something ends it: how, its second argument says."""

import sys
import time

from sdt_tools.frames import Twist
from sdt_tools.recording.live.interrupt import deferred_interrupt
from sdt_tools.robot.p3at.base import P3atBase
from sdt_tools.robot.p3at.config import P3atConfig

address, ends = sys.argv[1:]
base = P3atBase(P3atConfig(address=address, command_lasts_s=60.0))
base.command(Twist(0.5, 0.0))
sys.stdout.write("drives\n")
sys.stdout.flush()
match ends:
    case "kill":
        time.sleep(60)
    case "exception":
        sys.stdin.readline()
        raise ZeroDivisionError("nobody catches this")
    case "exit":
        sys.stdin.readline()
    case "signal":
        with base, deferred_interrupt() as interrupt:
            while not interrupt.requested:
                time.sleep(0.01)
