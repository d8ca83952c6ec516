"""An output that is a sum of states, y = 0.5 x1 + x3, is flown, scored and recorded as any other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from tenbaud import Run
from tenbaud.audit.audit import audit
from tenbaud.design.complete import completed
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tests.tenbaud.processes import run as run_command
from tests.tenbaud.sum_of_states import SUM_OF_STATES


def test_its_estimate_is_the_sum_of_the_estimates_of_states_everywhere(tmp_path: Path) -> None:
    values = completed({"model": SUM_OF_STATES, "coder": {"kind": "direction"}})
    values |= {
        "transmitter": {"plant": {"disturbance": "q=2e-3"}},
        "receiver": {
            "controller": "state_feedback",
            "reference": {
                "kind": "constant",
                "amplitude": 0.2,
                "sum": {"kind": "constant", "amplitude": 0.1},
            },
        },
    }
    config = tmp_path / "flight.toml"
    config.write_text(tomli_w.dumps(json.loads(json.dumps(values))))
    folder = tmp_path / "run"
    options = ("--config", str(config), "--link", "memory", "--duration", "30", "--out", str(folder))
    done = run_command("demo", *options, cwd=tmp_path)
    assert done.code == 0, done.err
    run = Run(folder)
    for kind in ("estimate", "estimate_live"):
        found = getattr(run, f"{kind}_sum")
        if kind == "estimate":
            expected = 0.5 * run.estimate_angle + run.estimate_drift
            np.testing.assert_array_equal(found, expected)
        known = ~np.isnan(found)
        assert known.sum() > 2900
        assert np.sqrt(np.mean((run.sum - found)[known] ** 2)) < 0.02
    summary = json.loads((folder / "summary.json").read_text())
    scored = run.error_live_sum[~np.isnan(run.error_live_sum)]
    assert summary["desyncs"] == 0
    rms = np.sqrt(np.mean(scored**2))
    assert summary["outputs"]["sum"]["error_live_rms"] == pytest.approx(rms, rel=1e-9)
    assert 1.0 < summary["rms_over_floor"] < 4.0
    assert replay(load_record(folder)).equal
    result = audit(folder)
    assert result.passed, result.leaks + result.gaps
