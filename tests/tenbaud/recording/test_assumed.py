"""The first difference of a flight with a narrow downlink, among samples that were never confirmed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tests.tenbaud.flown import flown


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_when_an_end_was_corrupt_then_diff_names_the_sample_and_the_field(
    tmp_path: Path, end: str
) -> None:
    sabotage = {f"{end}__sabotage": "sample=40,field=angle"}
    run = flown(tmp_path / "run", channel__downlink="narrow", duration_s=8.0, **sabotage)
    assert run.summary["rejoins_asked"] == {"rest": 1}
    compared = compare_runs(run.path, None)
    assert compared.verdict is Verdict.DIFFERENT
    assert compared.difference is not None
    assert (compared.difference.key, compared.difference.field) == (40, "state[0]")


def test_when_the_line_was_cut_then_there_is_no_difference(tmp_path: Path) -> None:
    run = flown(
        tmp_path / "run", channel__downlink="narrow", duration_s=14.0, link__impairments="cut=4s+4s"
    )
    assert run.summary["rejoins"] >= 1
    compared = compare_runs(run.path, None)
    assert compared.verdict is Verdict.EQUAL, str(compared)
