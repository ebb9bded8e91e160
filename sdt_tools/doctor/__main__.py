"""One probe, run by ``sdt doctor`` in a process of its own: its name and its arguments (JSON)."""

import json
import sys

from sdt_tools.doctor.probes import look

if __name__ == "__main__":
    look(sys.argv[1], json.loads(sys.argv[2]))
