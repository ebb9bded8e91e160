"""What a device's refusal, ``sFA`` and a number, means."""

from typing import Final

_WORDS: Final = {
    1: "the log-in that was given does not allow this command; check the password",
    2: "the device knows no such command; is it an LMS1xx?",
    3: "the device knows no such setting; is it an LMS1xx?",
    4: "the device cannot do that in its present state; wait, or power it off and on",
    5: "the device does not take these values; check frequency and resolution",
    6: "an error in the device that it does not name",
    7: "the device has no room for so long a telegram",
    8: "the telegram had fewer values than the device expects",
    9: "the device met a value of a kind it does not know",
    10: "nobody with the right to change settings is logged in; check the password",
    11: "the device's name server does not know the command",
    12: "the device does not know this kind of command",
    13: "the device is busy with the command before; try again",
    14: "a list in the telegram is longer than the device allows",
    15: "the device has no such kind of data to send",
    16: "a number in the telegram is too large for the device",
    17: "the telegram had a character that the device does not take",
    18: "the device's operating system gave no message",
    19: "the device's operating system gave no answer",
    20: "an internal error of the device; power it off and on",
    21: "the address of the device behind a hub is damaged",
    22: "the address of the device behind a hub cannot be read",
    23: "the address of the device behind a hub is too long",
    24: "a blank is missing in the address of the device behind a hub",
    25: "the device takes no commands of this kind at the moment",
    26: "the device cannot send lists of this kind in text",
}
"""By number (SICK, *Telegram Listing*, 8014631, "Error codes"), said so that a user can do something."""


def refusal_words(code: int) -> str:
    """What refusal ``code`` means, with its number."""
    return f"{_WORDS.get(code, 'a refusal that is in no list of ours')} (sFA {code:X})"
