"""What a user reads when the LiDAR is not there, is another device, or will not."""

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Event, Thread

import pytest
from lidar_rig import Slope

from sdt_tools.config import parse_config
from sdt_tools.emulation.lms1xx.config import EmulatedConfig
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.errors import ConfigError, DeviceError
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.driver import Lms1xx
from sdt_tools.robot.lms1xx.framing import Dialect, framed, splitter_for
from sdt_tools.robot.lms1xx.handshake import UNNAMED, open_link, start_stream
from sdt_tools.robot.lms1xx.link import Link, RefusedError
from sdt_tools.robot.lms1xx.refusals import refusal_words


def refused(port: int, **settings: object) -> str:
    with pytest.raises(DeviceError) as caught:
        Lms1xx(Lms1xxConfig(host="127.0.0.1", port=port, **settings))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@contextmanager
def emulated(**settings: object) -> Iterator[int]:
    with EmulatedLms1xx(Slope(), EmulatedConfig(port=0, start_s=0.0, **settings)) as emulator:
        yield emulator.port


@contextmanager
def server(serve: Callable[[socket.socket], None]) -> Iterator[int]:
    """A server of another kind, one client after the other."""
    listening = socket.create_server(("127.0.0.1", 0))

    def run() -> None:
        while True:
            try:
                client, _ = listening.accept()
            except OSError:
                return
            with client:
                serve(client)

    thread = Thread(target=run, daemon=True)
    thread.start()
    yield listening.getsockname()[1]
    listening.shutdown(socket.SHUT_RDWR)
    listening.close()
    thread.join()


def test_a_port_where_nobody_listens() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    assert refused(port) == (
        f"LiDAR at 127.0.0.1:{port}: nothing listens at this port; "
        "an LMS1xx listens at 2111 and 2112, once it has started"
    )


def test_a_host_that_does_not_exist() -> None:
    with pytest.raises(DeviceError, match=r"LiDAR at no\.such\.host\.invalid:2111: no such host; check the address"):
        Lms1xx(Lms1xxConfig(host="no.such.host.invalid"))


def test_a_wrong_password() -> None:
    with emulated(scan_hz=25) as port:
        assert "does not take the password 'ABCD1234'" in refused(port, password="abcd1234".upper())


def test_another_device_of_the_maker() -> None:
    with emulated(kind="TiM561", version="V2.50") as port:
        assert "is no LMS1xx: it says it is 'TiM561 V2.50'" in refused(port)


def test_a_server_that_says_something_else() -> None:
    with server(lambda client: client.sendall(b"SSH-2.0-OpenSSH_9.6\r\n")) as port:
        assert "no SICK device (it says 'SSH-2.0-OpenSSH_9.6" in refused(port)


def test_a_web_server() -> None:
    with HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as web:
        Thread(target=web.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        with pytest.raises(DeviceError, match="something listens there, but does not answer in CoLa-A or CoLa-B"):
            open_link(Lms1xxConfig(host="127.0.0.1", port=web.server_port), wait_s=0.1)
        web.shutdown()


def test_the_other_dialect_when_one_is_named() -> None:
    with emulated(protocol="b") as port:
        config = Lms1xxConfig(host="127.0.0.1", port=port, protocol="a")
        with pytest.raises(DeviceError, match=r"does not answer in CoLa-A; .* or set the protocol to auto"):
            open_link(config, wait_s=0.1)


def test_the_dialect_is_found() -> None:
    with emulated(protocol="b") as port:
        link, identity = open_link(Lms1xxConfig(host="127.0.0.1", port=port), wait_s=0.1)
        link.close()
    assert link.dialect is Dialect.B
    assert str(identity) == "LMS10x_FieldEval V1.36-21.10.2010"


def test_a_device_that_does_not_get_ready() -> None:
    with emulated(boot_s=30.0) as port:
        words = refused(port, ready_s=0.3)
    assert words.startswith(f"LiDAR at 127.0.0.1:{port} is not ready after 0 s: initialising (state 1); power it off")


def test_a_device_that_measures_but_sends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sdt_tools.robot.lms1xx.driver.GIVEN_UP_S", 0.3)
    with EmulatedLms1xx(Slope(), EmulatedConfig(port=0)) as emulator:
        emulator.silent = True
        assert "no scan for 0.3 s" in refused(emulator.port)


def test_a_device_that_tells_neither_its_name_nor_its_settings_is_set_and_streams() -> None:
    """As the small emulators that people write for themselves: what is not in this table is not answered."""
    answers = {
        b"sRN STlms": b"sRA STlms 7 0 8 00:00:00 8 01.01.70 0 0 0",
        b"sMN SetAccessMode": b"sAN SetAccessMode 1",
        b"sMN mLMPsetscancfg": b"sAN mLMPsetscancfg 0 1388 1 1388 FFF92230 225510",
        b"sWN LMDscandatacfg": b"sWA LMDscandatacfg",
        b"sMN LMCstartmeas": b"sAN LMCstartmeas 0",
        b"sMN Run": b"sAN Run 1",
        b"sEN LMDscandata": b"sEA LMDscandata 1",
    }
    asked: list[bytes] = []

    def serve(client: socket.socket) -> None:
        splitter = splitter_for(Dialect.A)
        while data := client.recv(4096):
            for body in splitter.feed(data):
                asked.append(b" ".join(body.split()[:2]))
                if asked[-1] in answers:
                    client.sendall(framed(Dialect.A, answers[asked[-1]]))

    with server(serve) as port:
        config = Lms1xxConfig(host="127.0.0.1", port=port)
        link, identity = open_link(config, wait_s=0.05)
        mute: set[str] = {"LMPscancfg", "LMDscandatacfg"}
        start_stream(link, config, Event(), str, mute)
        link.close()
    assert identity == UNNAMED
    assert mute == {"LMPscancfg", "LMDscandatacfg", "LMPoutputRange"}
    order = [b"SetAccessMode", b"mLMPsetscancfg", b"LMDscandatacfg", b"LMCstartmeas", b"STlms", b"Run", b"LMDscandata"]
    assert [name.split()[1] for name in asked[-7:]] == order


def test_a_refused_command_is_explained() -> None:
    with emulated() as port:
        link = Link("127.0.0.1", port, Dialect.A, "LiDAR")
        with pytest.raises(RefusedError, match=r"LiDAR refused LMCstartmeas: .* check the password \(sFA 1\)"):
            link.ask("sMN LMCstartmeas")
        with pytest.raises(RefusedError, match=r"LiDAR refused nonsense: .* knows no such setting"):
            link.ask("sRN nonsense")
        link.close()


@pytest.mark.parametrize("code", [0, 1, 26, 27, 65535])
def test_every_refusal_has_words_and_its_number(code: int) -> None:
    assert refusal_words(code).endswith(f"(sFA {code:X})")


def test_rates_that_the_device_does_not_have() -> None:
    with pytest.raises(ConfigError, match=r"does not measure 0.25° at 50 Hz; choose 0.5° at 50 or 25 Hz"):
        parse_config(Lms1xxConfig, {"resolution_deg": 0.25}, "robot.toml")
