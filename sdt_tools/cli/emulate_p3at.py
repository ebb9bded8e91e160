"""``sdt robot emulate p3at``: a base to drive without a base."""

from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit
from sdt_tools.emulation.p3at.faults import FAULT_HELP


def p3at(
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than loopback let the network in.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="TCP port to listen on; 0 takes a free one.")] = 8101,
    pty: Annotated[bool, typer.Option("--pty", help="A pseudo-terminal, as a serial port, instead of TCP.")] = False,
    watchdog_ms: Annotated[int, typer.Option(min=0, help="The base's own watchdog; 0 switches it off.")] = 2000,
    fault: Annotated[list[str] | None, typer.Option(metavar="FAULT", help=FAULT_HELP)] = None,
    seconds: Annotated[float | None, typer.Option(min=0.0, help="End after so long; else with Ctrl-C.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the faults that come by chance.")] = 0,
    json_output: JsonFlag = False,
) -> None:
    """Play a Pioneer P3-AT that speaks ARCOS, moves as one, and fails as asked.

    Any client of such a base can drive it, one at a time. It stops by its watchdog when nobody speaks to it.
    """
    from dataclasses import replace

    from sdt_tools.emulation.p3at.faults import parse_fault
    from sdt_tools.emulation.p3at.firmware import FACTORY
    from sdt_tools.emulation.p3at.ports import PtyPort, TcpPort
    from sdt_tools.emulation.p3at.server import EmulatedP3at
    from sdt_tools.recording.live.interrupt import deferred_interrupt

    planned = tuple(parse_fault(text) for text in fault or ())
    settings = replace(FACTORY, watchdog_ms=watchdog_ms)
    place = PtyPort() if pty else TcpPort(host, port)
    with deferred_interrupt() as interrupt, EmulatedP3at(place, planned, settings=settings, seed=seed) as base:
        console.print(f"a P3-AT at {base.address}; Ctrl-C ends it", soft_wrap=True)
        base.wait(seconds, lambda: interrupt.requested)
        report = base.report
    if json_output:
        emit({"address": base.address, **report.document()})
    else:
        pose = report.pose
        console.print(
            f"{report.packets_received} packets received, stopped by its watchdog {report.watchdog_stops} times; "
            f"it is at {pose.x_m:.2f} m, {pose.y_m:.2f} m",
            soft_wrap=True,
        )
