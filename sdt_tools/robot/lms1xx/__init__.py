"""SICK LMS1xx laser scanners over TCP: telegrams, settings, clock and driver."""
