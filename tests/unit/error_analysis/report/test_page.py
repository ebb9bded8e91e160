"""The page as a whole: nothing from outside, everything in it, also where there is little to say."""

import json
import re
import shlex
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import polars as pl
import pytest
from replay_samples import NearestAhead, label, write_drive

from sdt_tools.error_analysis.analyse import analyse_errors
from sdt_tools.error_analysis.definitions import ErrorOptions
from sdt_tools.error_analysis.report.tags_file import read_made_from
from sdt_tools.replay.replay import replay


class Page(HTMLParser):
    """Every tag with its attributes; void elements aside, all that is opened is closed in order."""

    VOID = frozenset({"meta", "link", "br", "rect", "path", "circle", "use", "img", "hr"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        named = dict(attributes)
        self.links += [str(named[name]) for name in ("href", "src", "xlink:href") if name in named]
        self.ids += [str(named["id"])] if "id" in named else []
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attributes)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if tag in self.VOID:
            return
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def analysed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Drives, labels, predictions of a model that never stops, and the analysis of it in ``errors``."""
    folder = tmp_path_factory.mktemp("paged")
    drives = [write_drive(folder / "recordings", f"drive_{seed}", seed=seed) for seed in range(10)]
    for drive in drives:
        label(drive, folder / "labels")
    replay(NearestAhead(stops_at_m=0.0), drives, folder / "labels", folder / "predictions.parquet")
    analyse_errors(folder / "predictions.parquet", [folder / "recordings"], ErrorOptions(), folder / "errors")
    return folder


def page_of(folder: Path) -> str:
    return (folder / "report.html").read_text("utf-8")


def test_nothing_comes_from_outside(analysed: Path) -> None:
    text = page_of(analysed / "errors")
    page = Page(text)
    assert page.open == []
    inside = {f"#{name}" for name in page.ids}
    outside = {link for link in page.links if link not in inside}
    assert outside == {"data:,", "tags.parquet"}
    assert not re.findall(r"url\((?!#)|@import|<script|<iframe", text)
    assert set(re.findall(r"https?://[a-z0-9.]+", text)) <= {"http://www.w3.org"}  # names, not places
    assert len(page.ids) == len(set(page.ids))


def test_condition_support_and_p_are_told_in_words(analysed: Path) -> None:
    text = unescape(page_of(analysed / "errors"))
    assert "1. When the right answer is stay" in text
    assert "motion = stay" in text
    assert "Mean loss 1.00 inside against 0.00 outside, +1.00 (95 % interval +1.00 to +1.00)" in text


def test_an_example_leads_to_its_stamp(analysed: Path) -> None:
    text = unescape(page_of(analysed / "errors"))
    commands = [shlex.split(found) for found in re.findall(r"<pre>(sdt view .*?)</pre>", text)]
    assert len(commands) == 4
    tags = pl.read_parquet(analysed / "errors" / "tags.parquet")
    for words in commands:
        options = dict(zip(words[3::2], words[4::2], strict=False))
        assert Path(words[2]).is_file()
        assert options["--errors"] == str(analysed / "errors")
        assert options["--predictions"] == str(analysed / "predictions.parquet")
        here = (pl.col("recording") == Path(words[2]).stem) & (pl.col("stamp_ns") == int(options["--at"]))
        assert tags.filter(here)["tag"].to_list() == [options["--tag"]]
    assert len({words[2] for words in commands}) == 4  # of different recordings


def test_the_tags_say_what_they_were_made_from(analysed: Path) -> None:
    made_from = read_made_from(analysed / "errors" / "tags.parquet")
    assert made_from == json.loads((analysed / "errors" / "errors.json").read_text())
    assert made_from["options"] == ErrorOptions(neighbourhood="scan").model_dump(mode="json")


def test_the_commands_name_the_place_where_the_folder_will_lie(analysed: Path, tmp_path: Path) -> None:
    analyse_errors(
        analysed / "predictions.parquet",
        [analysed / "recordings"],
        ErrorOptions(),
        tmp_path / "scratch",
        found_at=Path("analysis/errors"),
    )
    text = page_of(tmp_path / "scratch")
    assert "--errors analysis/errors --tag" in text
    assert "scratch" not in text


def with_loss(analysed: Path, out: Path, loss: float) -> Path:
    """The predictions with one loss everywhere."""
    table = pl.read_parquet(analysed / "predictions.parquet")
    table.with_columns(loss_01=pl.when(pl.col("label").is_not_null()).then(pl.lit(loss, pl.Float32))).write_parquet(out)
    return out


@pytest.mark.parametrize(
    ("loss", "options", "said"),
    [
        (0.0, ErrorOptions(), ["No frame is wrong", "There are no errors to show", "No errors, so no condition"]),
        (1.0, ErrorOptions(), ["Every frame is wrong", "Every frame is wrong, so no condition sets some apart"]),
        (
            None,
            ErrorOptions(epsilon_m=1e-6),
            ["no error frame has a neighbour within ε = 1e-06 m", "0 frames within ε"],
        ),
    ],
)
def test_a_report_with_little_to_say_says_so(
    analysed: Path, tmp_path: Path, loss: float | None, options: ErrorOptions, said: list[str]
) -> None:
    predictions = analysed / "predictions.parquet"
    if loss is not None:
        predictions = with_loss(analysed, tmp_path / "altered.parquet", loss)
    analyse_errors(predictions, [analysed / "recordings"], options, tmp_path / "errors")
    text = unescape(page_of(tmp_path / "errors"))
    assert Page(page_of(tmp_path / "errors")).open == []
    for words in said:
        assert words in text


def test_one_recording_is_reported_without_conditions(analysed: Path, tmp_path: Path) -> None:
    predictions = tmp_path / "one.parquet"
    table = pl.read_parquet(analysed / "predictions.parquet")
    table.filter(pl.col("recording") == "drive_0").write_parquet(predictions)
    analyse_errors(predictions, [analysed / "recordings"], ErrorOptions(), tmp_path / "errors")
    text = page_of(tmp_path / "errors")
    assert "Nothing can be confirmed. Recordings: 1; no condition can be confirmed with fewer than 8" in text
    assert "of 1 recording." in text
