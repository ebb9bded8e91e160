"""What can go wrong between a LiDAR and its host, on demand."""

from pydantic import Field

from sdt_tools.config import Config


class Faults(Config):
    """Faults of every moment. Shares are of the scan telegrams; what is random comes from ``seed``.

    ``split_bytes``: telegrams leave in pieces of so many bytes (0: whole). ``merge``: so many scans leave at once.
    ``delay_ms`` and ``jitter_ms``: everything is late by the first, and by a random part of the second. ``drop``: scans
    that are made and counted, and not sent. ``spoil``: with a wrong checksum, or in CoLa-A, which has none, cut off.
    ``garbage``: behind random bytes. ``drift_ppm``: by how much the device's clock is too fast.
    """

    split_bytes: int = Field(default=0, ge=0)
    merge: int = Field(default=1, ge=1, le=100)
    delay_ms: float = Field(default=0.0, ge=0, le=10_000)
    jitter_ms: float = Field(default=0.0, ge=0, le=10_000)
    drop: float = Field(default=0.0, ge=0, le=1)
    spoil: float = Field(default=0.0, ge=0, le=1)
    garbage: float = Field(default=0.0, ge=0, le=1)
    drift_ppm: float = Field(default=0.0, ge=-10_000, le=10_000)
    seed: int = Field(default=0, ge=0)
