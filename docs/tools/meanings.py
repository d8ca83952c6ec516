"""Meanings of the configuration's fields that have no text in the schema.

Those are parameters of constructors, and names that several sections share.
"""

from __future__ import annotations

from collections.abc import Mapping

MEANINGS: Mapping[str, str] = {
    "description": "one line about the configuration, for people; `tenbaud presets` shows it",
    "seed": "of all random numbers: disturbance, impairments; the same seed gives the same flight",
    "duration_s": "flight time",
    "rate_damping_per_s": "damping of the pitch rate by the air and the bearing",
    "stiffness_per_s2": "restoring torque of the body's weight, per radian and moment of inertia",
    "torque_gain_rad_per_v_s2": "angular acceleration by one volt (pitch: between the motors)",
    "equilibrium_rad": "angle at which the body rests without voltage",
    "motor_lag_s": "time constant of the motors: first-order lag from voltage to thrust",
    "damping_per_s": "damping of the rate",
    "A": "of dx/dt = A x + B u + G w: a row for each state; empty where F and E are given",
    "B": "of the same: effect of the commands, a row for each state",
    "states": "names, in the order of A's rows; empty: state_1, state_2 ...",
    "state_units": "unit of each state; empty: none",
    "inputs": "names, in the order of B's columns; empty: input_1, input_2 ...",
    "input_units": "unit of each input; empty: none",
    "outputs": "names, in the order of C's rows; empty: output_1, output_2 ...",
    "output_units": "unit of each output; empty: none",
    "travel_damping_per_s": "damping of the travel rate",
    "travel_thrust_rad_per_s2": "travel acceleration by one unit of thrust at a pitch of 90 degrees",
    "elevation_weight_rad_per_s2": "elevation acceleration by the weight, for a sine of 1",
    "elevation_damping_per_s": "damping of the elevation rate",
    "elevation_thrust_rad_per_s2": "elevation acceleration by one unit of thrust",
    "pitch_weight_rad_per_s2": "pitch acceleration by the weight of the body at a pitch of 90 degrees",
    "pitch_damping_per_s": "damping of the pitch rate",
    "pitch_thrust_rad_per_s2": "pitch acceleration by one unit of difference of the two thrusts",
    "elevation_high_rad": "upper stop of the elevation",
    "pitch_stop_rad": "stop of the pitch, to either side",
    "initial_range_rad": "range M of the coder before the first word",
    "minimum_range_rad": "smallest range M",
    "maximum_range_rad": "largest range M",
    "decay": "factor of the range M per sample: shrinks by it, and grows by its inverse at saturation",
    "open-loop-zoom.decay": "factor by which the range M shrinks per sample, for any signs",
    "range_rad": "range M of the coder, which never changes",
    "pcm.range_rad": "half the width that a word covers",
    "bits": "symbols per word, one bit each",
    "minimum_strength": "smallest sigma that the coder assumes",
    "maximum_strength": "largest sigma that the coder assumes",
    "rig": "a simulated plant, a recorded flight, or a real rig",
    "sign": "-1 reverses the direction",
    "transmitter.plant.pitch.kind": "the pitch axis, the only one",
    "first_sample_timeout_s": "longest time until the rig's first sample",
    "transmitter.bridge.travel.channel": "place of the encoder among those that the device sends",
    "transmitter.bridge.pitch.channel": "place of the encoder among those that the device sends",
    "transmitter.bridge.elevation.channel": "place of the encoder among those that the device sends",
    "transmitter.bridge.NAME.channel": "place of the encoder among those that the device sends",
    "counts_per_turn": "counts of the encoder for one turn of the axis",
    "line_baud": "bits per second on the rig's line",
    "motor_line_baud": "bits per second on the line of `motor_port`",
    "format": "how samples and commands are written on the line",
    "pulse_full_volts": "motor volts of the full pulse width",
    "host": "address of the QUARC model, or of this end where it is the server",
    "port": "TCP port of the same",
    "byte_order": "of the numbers on the stream",
    "card_type": "board type, as the HIL API names it",
    "card_identifier": "which board of this type, as the HIL API counts them",
    "sample_rate_hz": "samples per second that the board takes",
    "analog_channels": "analog outputs of the board that drive the amplifiers",
    "transmitter.hil.watchdog_s": "the board's own watchdog: time without a command until it stops",
    "card_options": "further options of the board, as the HIL API takes them",
    "proportional": "gain of the error, in `unit`",
    "integral": "gain of the integral of the error over time in s, in `unit` per s",
    "derivative": "gain of the rate of the output, in `unit` times s",
    "anti_windup": "conditional: the integral is held while the command is at its limit",
    "period_s": "period of the square wave or the sine",
    "flight_log.file": "the recorded flight",
    "signs": "-1 reverses a signal",
    "scales": "factor of a signal",
    "end_s": "on the file's own clock; later rows are ignored",
    "link.kind": "how the two ends are connected; memory: both in one process",
    "session": "name of the flight on the link; the same at both ends",
}
"""Field, or section and field where it has another meaning there."""


def meaning_of(section: str, kind: str, field: str) -> str:
    """Return the meaning of a field that has no text; empty where there is none here either."""
    for name in (f"{section}.{field}", f"{kind}.{field}", field):
        if name in MEANINGS:
            return MEANINGS[name]
    return ""
