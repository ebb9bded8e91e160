"""Record, label, train, drive and replay learned robot controllers, and say of every wrong frame why it is wrong."""

from importlib.metadata import version

__version__ = version("sdt-tools")
