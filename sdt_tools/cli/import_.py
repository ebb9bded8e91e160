"""``sdt import``: recordings from other formats."""

from pathlib import Path
from typing import Annotated

import typer

from sdt_tools.cli.console import JsonFlag, console, emit, print_messages

app = typer.Typer(no_args_is_help=True, help="Make recordings from drives in other formats.")


@app.callback()
def import_() -> None:
    """Make recordings from drives in other formats."""


@app.command("lidar-csv")
def lidar_csv(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The drive: .csv, or .csv.gz compressed with gzip.")],
    hz: Annotated[float, typer.Option(help="Scans a second; the file does not say.")],
    out: Annotated[Path, typer.Option(help="The recording to write; it must not exist.")],
    json_output: JsonFlag = False,
) -> None:
    """Import a drive with one LMS1xx scan a row: step, two state values, 541 ranges in metres, steering.

    Only the scans are taken: state and steering have no topic in a recording. Stamps start at 2025-01-01.
    """
    from sdt_tools.recording.exchange.lidar_csv import import_lidar_csv

    summary = import_lidar_csv(file, out, hz)
    if json_output:
        emit({**vars(summary), "path": str(summary.path)})
    else:
        console.print(
            f"{summary.path}: {summary.scans} scans, {summary.seconds:.1f} s at {hz:g} Hz, "
            f"{summary.invalid_share:.2%} of the rays without a distance; steering and state columns left out"
        )


@app.command("ros2")
def ros2(
    bag: Annotated[Path, typer.Argument(metavar="BAG", help="The bag: its folder, or a single .mcap or .db3 file.")],
    out: Annotated[Path, typer.Option(help="The recording to write; it must not exist.")],
    scan_topic: Annotated[
        str | None, typer.Option(help="Topic of the scans where several are LaserScan; none leaves them out.")
    ] = None,
    image_topic: Annotated[
        str | None, typer.Option(help="Topic of the pictures where several are Image or CompressedImage; or none.")
    ] = None,
    command_topic: Annotated[
        str | None, typer.Option(help="Topic of the commands where several are Twist or TwistStamped; or none.")
    ] = None,
    odometry_topic: Annotated[
        str | None, typer.Option(help="Topic of the odometry where several are; or none.")
    ] = None,
    resample: Annotated[
        bool, typer.Option("--resample", help="Take scans of any geometry: for each of our rays the nearest of theirs.")
    ] = False,
    jpeg_quality: Annotated[
        int | None, typer.Option(min=1, max=100, help="Of uncompressed pictures, which become JPEG. [95]")
    ] = None,
    lossless: Annotated[
        bool,
        typer.Option("--lossless", help="Uncompressed pictures become PNG: about ten times the bytes, every pixel."),
    ] = False,
    config: Annotated[
        Path | None, typer.Option(help="A TOML file whose table motions has the twists of the seven classes.")
    ] = None,
    json_output: JsonFlag = False,
) -> None:
    """Import a ROS 2 bag: LaserScan, Image, CompressedImage, Twist, TwistStamped, Odometry, and what we exported.

    Stamps are kept to the nanosecond: the header's is the sensor's, the bag's is the receipt. 541 rays at 0.5° are
    taken as they are, 1,081 at 0.25° thinned; infinite, missing and out-of-limits ranges become 0.0. A range that
    stands for a whole millimetre becomes it. A twist is kept, and classed by the nearest of the seven. Compressed
    pictures stay as they are.
    """
    from sdt_tools.config import MotionConfig, parse_config, read_toml
    from sdt_tools.errors import UsageError
    from sdt_tools.recording.exchange.ros2.importing import import_ros2
    from sdt_tools.recording.exchange.ros2.inward import Taking
    from sdt_tools.recording.exchange.ros2.pictures import LOSSLESS, PictureFormat
    from sdt_tools.recording.exchange.ros2.routes import Wanted

    if lossless and jpeg_quality is not None:
        raise UsageError("--lossless and --jpeg-quality: choose one, PNG or a quality of JPEG")
    table = {} if config is None else read_toml(config).get("motions", {})
    taking = Taking(
        resample,
        LOSSLESS if lossless else PictureFormat("jpeg", 95 if jpeg_quality is None else jpeg_quality),
        parse_config(MotionConfig, table, f"{config}: motions"),
    )
    summary = import_ros2(bag, out, Wanted(scan_topic, image_topic, command_topic, odometry_topic), taking)
    if json_output:
        emit(summary.document())
        return
    print_messages(summary.path, summary.messages)
    for how, count in summary.scans.items():
        console.print(f"{count} scans: {how}; {summary.no_distance:.2%} of all rays without a distance")
    for topic, count in summary.unstamped.items():
        console.print(f"{topic}: {count} messages carry no stamp and have that of their receipt")
    for topic, count in summary.unreadable.items():
        console.print(f"{topic}: {count} messages cannot be used and were left out")
    for left, reason in summary.left_out.items():
        console.print(f"left out: {left.name} ({left.type_name}, {left.messages} messages): {reason}", soft_wrap=True)


@app.command("parquet")
def parquet(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that `sdt export parquet` wrote.")],
    out: Annotated[Path, typer.Option(help="The recording to write; it must not exist.")],
    json_output: JsonFlag = False,
) -> None:
    """Import a folder of Parquet files back into a recording, changed or not: stamps and numbers keep their bits."""
    from sdt_tools.recording.exchange.parquet.importing import import_parquet

    summary = import_parquet(folder, out)
    if json_output:
        emit(summary.document())
        return
    print_messages(summary.path, summary.messages)
    for name in summary.left_out:
        console.print(f"left out: {name}")
