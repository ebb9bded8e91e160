"""Options as they suit what was answered: scans or pictures."""

from sdt_tools.error_analysis.definitions import EPSILON_OPTIONS, PICTURE_FEATURES, ErrorOptions, Neighbourhood
from sdt_tools.errors import UsageError
from sdt_tools.replay.predictions import PredictionKind

_OWN: dict[PredictionKind, Neighbourhood] = {PredictionKind.SCANS: "scan", PredictionKind.PICTURES: "feature"}


def suited_options(options: ErrorOptions, kind: PredictionKind) -> ErrorOptions:
    """``options`` with the neighbourhood and the features of conditions of ``kind``, where they were not chosen.

    Raises UsageError for a neighbourhood that frames of this kind do not have, and for an ε of another one.
    """
    own = _OWN[kind]
    neighbourhood = options.neighbourhood or own
    if neighbourhood not in (own, "time"):
        raise UsageError(
            f"neighbourhood = '{neighbourhood}': these are answers to {kind}, whose neighbours are taken in '{own}' or "
            "in 'time'"
        )
    for other, option in EPSILON_OPTIONS.items():
        if other != neighbourhood and options.epsilon_of(other) is not None:
            raise UsageError(
                f"{option} is about the neighbourhood '{other}', but neighbours are taken in '{neighbourhood}'; set "
                f"{EPSILON_OPTIONS[neighbourhood]}"
            )
    conditions = options.conditions
    if kind is PredictionKind.PICTURES and "features" not in conditions.model_fields_set:
        conditions = conditions.model_copy(update={"features": PICTURE_FEATURES})
    return options.model_copy(update={"neighbourhood": neighbourhood, "conditions": conditions})
