"""How fast a study flies: against python-control, against a plain C loop, and with two workers.

All three fly the same flight: preset paper-10baud, 100 s, 10,000 ticks, one bit every 0.1 s. The errors
of all three agree to the last bit. Times are of the processor, so that others on the machine count
less; two workers are timed by the clock, which needs two idle cores.
"""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.figures import Figure
from channel.codec.coders.zoom import ZoomCoder
from channel.codec.laws import clamped, is_stuck, pid_integral, pid_sum
from channel.codec.numerics import sin
from channel.protocol.limits import from_steps, to_steps
from plant_sim.encoder import angle_of, counts_of
from plant_sim.pitch import Sine, pitch_step
from tenbaud.config.load import load_config
from tenbaud.studies.flights import CompiledPoint

ROUNDS = 7
FLIGHTS = 40
"""compiled flights, and flights of the C loop, in one round"""


def studies_figures() -> list[Figure]:
    """Return the ratios that a study is asked for."""
    point = CompiledPoint(load_config("paper-10baud"))
    figures, _ = point.fly(1)
    rms = figures.first.error_coded_rms
    compiled_s = _shortest(lambda: point.fly(1), FLIGHTS)
    noise = {"transmitter": {"plant": {"disturbance": "q=2e-3"}}}
    noisy = CompiledPoint(load_config("paper-10baud", None, noise))
    noisy_s = _shortest(lambda: noisy.fly(1), FLIGHTS)
    control_rms = _python_control(point, sin)[1]
    _agree("python-control", control_rms, rms)
    control_s = min(_python_control(point, math.sin)[0] for _ in range(3))
    found = [
        Figure("study_flight_ms", compiled_s * 1e3, "ms", "10,000 ticks"),
        Figure("study_noisy_flight_ms", noisy_s * 1e3, "ms", "the same, with noise drawn for it"),
        Figure("study_control_flight_ms", control_s * 1e3, "ms", "the same with python-control"),
        Figure(
            "study_over_control",
            control_s / compiled_s,
            "times",
            "1000; see docs/studies.md",
        ),
        Figure("study_noisy_over_control", control_s / noisy_s, "times", "with noise"),
    ]
    found += _c_loop(point, rms)
    return found + _workers()


def _shortest(fly: Callable[[], object], flights: int) -> float:
    times = []
    for _ in range(ROUNDS):
        begun = time.process_time()
        for _ in range(flights):
            fly()
        times.append((time.process_time() - begun) / flights)
    return min(times)


def _agree(who: str, theirs: float, ours: float) -> None:
    if theirs != ours:
        raise AssertionError(f"{who} found an error of {theirs!r} rad where the study found {ours!r}")


def _python_control(point: CompiledPoint, sine: Sine) -> tuple[float, float]:
    """Fly the closed loop with `control.input_output_response`; return seconds and rms error.

    One discrete-time system whose update is written with the nodes' own functions in plain Python,
    which is kinder to it than numpy would be. With `math.sin` for the plant it is faster, with that of
    `channel.codec.numerics` its bits are those of a study.
    """
    import control

    numbers, signals = point.numbers, point.agreement.signals
    _, _, plant_c, law = point.constants
    (pid_c,) = law.loops
    steady = point.steady
    place = tuple(steady[name][0].item() for name in ("counts_per_turn", "sign", "zero_counts"))
    limits = steady["command_max"].tolist()
    codec = point.agreement.codec
    tick_s = point.config.timing.tick_s

    def update(t: float, x: Any, u: Any, params: object) -> list[float]:
        body, state = tuple(x[0:4].tolist()), tuple(x[4:8].tolist())
        m, last, e1, e2, integral, tick = x[8:14].tolist()
        if tick % numbers.per_sample == 0:
            measured = angle_of(counts_of(body[0], *place), *place)
            word = codec.coder.encode((m, last), state[:1], (measured,))
            (e1, e2), (m, last) = codec.coder.decode((m, last), state, word)
        error = float(u[0]) - state[0]
        total = pid_sum(pid_c, integral, error, state[1])
        wanted = [bias + share * total for bias, share in zip(law.bias, pid_c.mixing, strict=True)]
        inputs = list(zip(wanted, pid_c.mixing, limits, strict=True))
        stuck = all(is_stuck(value, share * error, most) for value, share, most in inputs)
        integral = pid_integral(pid_c, integral, error, stuck)
        limited = [clamped(value, most) for value, _, most in inputs]
        command = from_steps(to_steps(limited, signals), signals)
        front, rear = command
        state = codec.model.tick(state, command, (e1, e2))
        body = pitch_step(body, (front, rear), (0.0,), plant_c, sine)
        return [*body, *state, m, last, e1, e2, integral, tick + 1.0]

    def output(t: float, x: Any, u: Any, params: object) -> list[float]:
        return [x[0], x[4]]

    system = control.nlsys(update, output, inputs=1, outputs=2, states=14, dt=tick_s)
    times = np.arange(numbers.ticks) * tick_s
    start = [0.0] * 8 + [*codec.initial().coder, 0.0, 0.0, 0.0, 0.0]
    reference = np.asarray(point.targets[: numbers.ticks, 0])
    begun = time.process_time()
    response = control.input_output_response(system, times, reference, start)
    seconds = time.process_time() - begun
    errors = (response.outputs[0] - response.outputs[1])[numbers.window_start :].tolist()
    squares = 0.0
    for error in errors:
        squares += error * error
    return seconds, math.sqrt(squares / len(errors))


def _c_loop(point: CompiledPoint, rms: float) -> list[Figure]:
    """Compile the C loop and fly it; without a compiler say so."""
    compiler = shutil.which("cc")
    if compiler is None:
        return [Figure("study_over_c", math.nan, "times", "skipped: there is no C compiler (cc)")]
    source = Path(__file__).with_name("studies_loop.c")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "loop.so"
        options = ["-O2", "-ffp-contract=off", "-shared", "-fPIC"]
        subprocess.run([compiler, *options, str(source), "-o", str(library), "-lm"], check=True)
        loop = ctypes.CDLL(str(library)).flight
        fly, squares = _c_call(loop, point)
        fly()
        count = point.numbers.ticks - point.numbers.window_start
        _agree("the C loop", math.sqrt(squares[0] / count), rms)
        # In turns, so that a busy machine slows both alike.
        pairs = []
        for _ in range(ROUNDS):
            c_s = _shortest_once(fly)
            pairs.append((c_s, _shortest_once(lambda: point.fly(1))))
    c_s, compiled_s = (min(times) for times in zip(*pairs, strict=True))
    return [
        Figure("study_c_flight_ms", c_s * 1e3, "ms", "the same as a plain C loop, -O2"),
        Figure("study_over_c", c_s / compiled_s, "times", "at least 1.0"),
    ]


def _shortest_once(fly: Callable[[], object]) -> float:
    begun = time.process_time()
    for _ in range(FLIGHTS):
        fly()
    return (time.process_time() - begun) / FLIGHTS


def _c_call(loop: Any, point: CompiledPoint) -> tuple[Callable[[], object], Any]:
    """Return what flies the C loop once, and the array that it writes."""
    numbers = point.numbers
    model_c, _, plant_c, law = point.constants
    (pid_c,) = law.loops
    coder = point.agreement.codec.coder
    assert isinstance(coder, ZoomCoder), "the C loop has this coder alone"
    zoom_c = coder.parameters
    zoom = [zoom_c.decay, (1.0 - zoom_c.decay) * zoom_c.minimum_range]
    zoom += [zoom_c.gains[0][0], zoom_c.gains[1][0], coder.initial()[0]]
    pid = [pid_c.proportional, pid_c.integral_per_tick, pid_c.derivative]
    pid += [point.steady["command_max"][0], 2.0 * law.bias[0]]
    out = np.zeros(3)
    reference = np.ascontiguousarray(point.targets[:, 0])
    arrays = [np.array(one) for one in (model_c, plant_c, pid, zoom)]
    arrays += [reference, np.zeros(numbers.ticks), out]
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in arrays]
    whole = (numbers.ticks // numbers.per_sample, numbers.per_sample, numbers.window_start)
    head = [ctypes.c_int64(value) for value in (*whole, int(point.steady["counts_per_turn"][0]))]
    loop.restype = None
    # The arrays live as long as what calls the loop.
    return lambda: (loop(*head, *pointers), arrays)[0], out


def _workers() -> list[Figure]:
    """Return how much faster two processes fly a study than one."""
    from tenbaud.studies.chunk import task_of
    from tenbaud.studies.run import flying_in_pool
    from tenbaud.studies.study import Study
    from tenbaud.studies.study_file import StudyFile

    file = StudyFile.model_validate(
        {
            "preset": "paper-10baud",
            "seeds": 40,
            "chunk_flights": 80,
            "set": {"transmitter": {"plant": {"disturbance": "q=2e-3"}}},
            "grid": {"mismatch": {"from": 0.0, "to": 0.3, "steps": 80}},
        }
    )
    study = Study(file)
    tasks = [task_of(study, index) for index in range(study.chunks)]
    seconds = {}
    for workers in (1, 2):
        flying = flying_in_pool(tasks, workers)
        # Processes have started and loaded their code when each has flown a chunk.
        for _ in range(2 * workers):
            next(flying)
        begun = time.perf_counter()
        left = sum(1 for _ in flying)
        seconds[workers] = (time.perf_counter() - begun) / left
    ratio = seconds[1] / seconds[2]
    return [Figure("study_two_workers", ratio, "times", "at least 1.8 x one worker")]
