"""What every test may rely on."""

import signal


def pytest_configure() -> None:
    """Signals are heard, also where the tests were started in the background, or to outlive a terminal."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
