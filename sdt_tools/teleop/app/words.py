"""What the cockpit says in words: who drives and how, what is recorded, how the streams come in, what has happened."""

from typing import Final

from rich.style import Style
from rich.text import Text

from sdt_tools.class_colors import GESTURES, MODES, MOTIONS, Rgb
from sdt_tools.frames import LogLevel, Mode, MotionClass, Twist
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.live.disk import WARNING_S, disk_words
from sdt_tools.recording.live.outcome import RecordingProgress
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, COMMAND, LIDAR_SCAN, ODOMETRY
from sdt_tools.teleop.cockpit import Cockpit
from sdt_tools.teleop.hand import HandState
from sdt_tools.teleop.watch import Stream, View
from sdt_tools.terminal.raster import BLANK, style

BRIGHT: Final[Rgb] = (216, 220, 228)
DIM: Final[Rgb] = (120, 128, 142)
GOOD: Final[Rgb] = (98, 190, 118)
WARM: Final[Rgb] = (255, 208, 92)
ALARM: Final[Rgb] = (255, 82, 82)
HAND: Final[Rgb] = (64, 169, 255)

STALE_S: Final = 0.5
_SHOWN: Final = {LIDAR_SCAN: "scans", CAMERA_IMAGE: "images", ODOMETRY: "odometry", COMMAND: "commands"}
_PAD: Final = (
    (MotionClass.LEFT_FORWARD, MotionClass.FORWARD, MotionClass.RIGHT_FORWARD),
    (None, MotionClass.STAY, None),
    (MotionClass.LEFT_BACKWARD, MotionClass.BACKWARD, MotionClass.RIGHT_BACKWARD),
)
_PAD_KEYS: Final = (("q", "w", "e"), (" ", "s", " "), ("z", "x", "c"))
_SIGNS: Final = (("↖", "↑", "↗"), (" ", "■", " "), ("↙", "↓", "↘"))


def heading(cockpit: Cockpit, view: View, width: int) -> Text:
    """What is recorded, whether it is, and the room on the disk; an emergency stop covers it all."""
    emergency = cockpit.hand.state.emergency
    if emergency:
        words = f" EMERGENCY STOP: {emergency} · ^r releases it "
        return Text(words.center(width)[:width], style((255, 255, 255), (176, 20, 30), bold=True))
    progress = view.progress
    left = Text(f" {cockpit.title}  ", style(BRIGHT)).append_text(_take(progress))
    right = _disk(progress)
    room = width - left.cell_len - right.cell_len
    if room < 0:
        left.truncate(max(width - right.cell_len, 0), overflow="ellipsis")
        room = width - left.cell_len - right.cell_len
    return left.append(" " * max(room, 0)).append_text(right)


def _take(progress: RecordingProgress | None) -> Text:
    if progress is None:
        # numba keeps what it has compiled of the scene
        return Text("getting ready … a scene compiles once after an install: 20 s", style(WARM))
    clock = f"{int(progress.recorded_s) // 60}:{progress.recorded_s % 60:04.1f}"
    if progress.total_s is not None:
        clock += f" of {progress.total_s:g} s"
    if not progress.running:
        return Text(" STANDBY ", style(BLANK, DIM, bold=True)).append(f" {progress.state}", style(DIM))
    if progress.paused:
        return Text(" PAUSED ", style(BLANK, WARM, bold=True)).append(f" {clock}  {progress.state}", style(DIM))
    return Text(" ● REC ", style((255, 255, 255), (190, 40, 50), bold=True)).append(
        f" {clock}  {progress.size_bytes / 1e6:.1f} MB  {progress.state}", style(DIM)
    )


def _disk(progress: RecordingProgress | None) -> Text:
    if progress is None or progress.disk_left_s is None:
        return Text()
    low = progress.disk_left_s < WARNING_S
    return Text(f"{disk_words(progress.disk_left_s)} ", style(ALARM if low else DIM, bold=low))


def motion_panel(cockpit: Cockpit, view: View) -> Text:
    """Who drives, the seven motions with their keys and the one that is driven, the twist, speed, mode, gesture."""
    command, hand = view.command, cockpit.hand.state
    text = Text().append_text(_driver(cockpit, view)).append("\n")
    driven = None if command is None else command.motion
    for motions, keys, signs in zip(_PAD, _PAD_KEYS, _SIGNS, strict=True):
        text.append("  ")
        for motion, key, sign in zip(motions, keys, signs, strict=True):
            if motion is None:
                text.append("      ")
                continue
            lit = motion is driven
            color = MOTIONS[motion.label]
            text.append(f" {sign} {key} ", style(BLANK, color, bold=True) if lit else style(color))
            text.append(" ")
        if motions[1] is MotionClass.STAY:
            text.append("speed ", style(DIM)).append(f"{hand.speed:.0%}", style(BRIGHT))
        text.append("\n")
    twist = Twist(0.0, 0.0) if command is None else command.twist
    label = "–" if driven is None else driven.label
    text.append(f" {label:<14} ", bold(BRIGHT if driven is None else MOTIONS[driven.label]))
    text.append(f"{twist.linear_mps:+.2f} m/s {twist.angular_radps:+.2f} rad/s\n", style(BRIGHT))
    mode = Mode.ACTIVE if command is None else command.mode
    text.append(" mode     ", style(DIM)).append(mode.label, style(MODES[mode.label], bold=True))
    if view.operator is not None:
        gesture, wants = view.operator.gesture.label, view.operator.commanded_mode.label
        text.append("\n operator ", style(DIM)).append(gesture, style(GESTURES[gesture], bold=True))
        text.append(f", wants {wants}", style(DIM))
    return text


def _driver(cockpit: Cockpit, view: View) -> Text:
    command, hand = view.command, cockpit.hand.state
    if hand.emergency:
        return Text(" STOPPED ", style((255, 255, 255), (176, 20, 30), bold=True))
    if hand.stopped and not cockpit.by_hand:
        return Text(" STOPPED ", style(BLANK, WARM, bold=True)).append(f" g gives back to {cockpit.driver}", style(DIM))
    if command is not None and command.intervention:
        return Text(f" {command.driver} ", style(BLANK, HAND, bold=True)).append(f" over {cockpit.driver}", style(DIM))
    name = cockpit.driver if command is None or command.driver == STOP else command.driver
    return Text(f" {name}", style(BRIGHT, bold=True)).append(" drives", style(DIM))


def streams_panel(view: View) -> Text:
    """A line a stream: rate and age; then what was lost."""
    text = Text()
    streams = view.streams or {}
    for topic, name in _SHOWN.items():
        stream = streams.get(topic)
        text.append(f" {name:<9}", style(DIM)).append_text(_stream(stream)).append("\n")
    progress = view.progress
    lost = {
        "dropped": 0 if progress is None else progress.dropped,
        "missing": 0 if progress is None else progress.missing,
        "late": 0 if progress is None else progress.missed_deadlines,
    }
    for name, count in lost.items():
        text.append(f" {name} ", style(DIM)).append(f"{count}", style(WARM if count else DIM, bold=bool(count)))
    return text


def _stream(stream: Stream | None) -> Text:
    if stream is None:
        return Text("      –", style(DIM))
    stale = stream.age_s > STALE_S
    text = Text(f"{stream.rate_hz:>6.1f}/s ", style(ALARM if stale else GOOD))
    age = f"{stream.age_s * 1000:>5.0f} ms" if stream.age_s < 1 else f"{stream.age_s:>6.1f} s"
    return text.append(age, style(ALARM if stale else DIM, bold=stale))


def messages(view: View, lines: int, width: int) -> Text:
    """The newest lines of the log, the newest last."""
    text = Text()
    shown = view.entries[-lines:] if lines > 0 else ()
    for number, entry in enumerate(shown):
        color = {LogLevel.WARNING: WARM, LogLevel.ERROR: ALARM}.get(entry.level, DIM)
        text.append("\n" if number else "").append(f" {entry.text}"[:width], style(color))
    return text


def changes(before: HandState, now: HandState, driver: str, by_hand: bool) -> list[str]:
    """What the log is to say of the hand: emergency stops, and a policy that is stopped or given the robot back."""
    said = []
    if now.emergency and not before.emergency:
        said.append(f"emergency stop: {now.emergency}")
    if before.emergency and not now.emergency:
        said.append("the emergency stop is released")
    if not by_hand and now.stopped and not before.stopped and not now.emergency:
        said.append(f"stopped by hand; {driver} waits")
    if not by_hand and before.stopped and not now.stopped:
        said.append(f"the stop by hand is over; {driver} may drive")
    return said


def ink(color: Rgb) -> Style:
    """A colour on whatever is behind."""
    return Style(color=style(color).color)


def bold(color: Rgb) -> Style:
    """Bold in a colour on whatever is behind."""
    return Style(color=style(color).color, bold=True)
