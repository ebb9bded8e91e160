"""A SICK LMS1xx that is a TCP server: commands, state, clock and scans as the device has them, and faults on demand."""
