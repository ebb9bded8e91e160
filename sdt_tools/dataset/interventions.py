"""What people did when they took over from a policy: labels for the scans that it could not manage.

Training on them, beside what was demonstrated before, is DAgger (Ross, Gordon and Bagnell, 2011) with a person as the
expert who is asked.
"""

from typing import Final

import polars as pl

from sdt_tools.frames import Mode, MotionCommand
from sdt_tools.labeling.vocabulary import LabelSource
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.messages.topics import COMMAND
from sdt_tools.recording.reader import Recording

_SCHEMA: Final = {"stamp_ns": pl.Int64, "label": pl.String}


def read_interventions(recording: Recording) -> pl.DataFrame:
    """Columns stamp_ns (of the scan, ascending) and label (String), of each motion that a person drove in between.

    Mere stops are left out: they do not say what is right there.
    """
    if COMMAND not in recording.topics:
        return pl.DataFrame(schema=_SCHEMA)
    labels: dict[int, str] = {}
    for received in recording.messages(topics=[COMMAND]):
        command = received.message
        if (
            isinstance(command, MotionCommand)
            and command.intervention
            and command.driver != STOP
            and command.mode is Mode.ACTIVE
        ):
            labels[command.stamp_ns] = command.motion.label
    return pl.DataFrame(sorted(labels.items()), schema=_SCHEMA, orient="row")


def with_interventions(labels: pl.DataFrame, interventions: pl.DataFrame, disputed: pl.DataFrame) -> pl.DataFrame:
    """``labels`` as ``resolve`` gives them, and ``interventions``: columns stamp_ns (ascending) and label.

    Where a stamp has both, a person's label stands, being given with care; any other gives way to the intervention.
    ``disputed`` stamps stay out.
    """
    human = labels.filter(pl.col("source") == str(LabelSource.HUMAN)).select("stamp_ns", "label")
    new = interventions.join(human, on="stamp_ns", how="anti").join(disputed, on="stamp_ns", how="anti")
    rest = labels.select("stamp_ns", "label").join(new, on="stamp_ns", how="anti")
    return pl.concat([rest, new]).sort("stamp_ns")
