"""Identification of the pitch model: (11)-(15) on the general algorithm.

    theta'' = -a_w theta' - a_th sin(theta - theta_0) + k_v mu                       (11)
    T_m vbar_i' + vbar_i = v_i,   mu = vbar_front - vbar_rear                        (12)

theta, s = sin(theta - theta_0) and mu pass through three equal filters (13)-(15); the regressors are
the filtered rate, s_f and mu_f. The bias theta_0 is measured beforehand in a quiescent stretch, as in
the paper. Where there is none, or where it is not to be trusted (a body leaning on something on the
ground), it can be estimated with the others: a_th sin(theta - theta_0) = c sin(theta) - d cos(theta)
is linear in c = a_th cos(theta_0) and d = a_th sin(theta_0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.estimator import Estimator
from plant_sim.identification.state_filter import StateFilter, second_order

NAMES = ("a_w", "a_th", "k_v")


@dataclass(frozen=True, slots=True)
class PitchSettings:
    """Constants of the algorithm; the defaults are the paper's."""

    filter_bandwidth_rad_s: float = 1.0
    """w_f"""
    filter_damping: float = 0.7
    """rho of the filters"""
    forgetting_per_s: float = 0.01
    """alpha"""
    gain: float = 1e3
    """diagonal of Gamma(0)"""
    motor_lag_s: float = 0.08
    """T_m, known"""
    volts_max: float = 5.0
    """where each motor saturates: what is commanded beyond it does not act"""
    settle_s: float = 0.0
    """data at the beginning that only fill the filters; 0 for a body that starts at rest"""


class PitchEstimates(NamedTuple):
    """The estimate after a sample."""

    rate_damping_per_s: float
    """a_w"""
    stiffness_per_s2: float
    """a_th"""
    torque_gain_rad_per_v_s2: float
    """k_v"""
    equilibrium_rad: float
    """theta_0, given or estimated"""


class PitchIdentifier:
    """On-line: voltages and angle of one tick in, estimates out.

    `equilibrium_rad` is theta_0; None has it estimated with the others. The voltages of a tick are
    those held from it to the next one. Before the first tick the motors are taken to be off and the
    body to rest; of a record that begins otherwise, set `settle_s` to the filters' memory.
    """

    def __init__(
        self, step_s: float, equilibrium_rad: float | None, settings: PitchSettings | None = None
    ) -> None:
        self.settings = settings = settings or PitchSettings()
        bandwidth = settings.filter_bandwidth_rad_s
        if not (bandwidth > 0.0 and settings.filter_damping > 0.0):
            raise IdentificationError(
                f"filter bandwidth {bandwidth:g} rad/s and damping {settings.filter_damping:g} must "
                "both be above 0, or the state filters do not settle"
            )
        if settings.motor_lag_s < 0.0:
            raise IdentificationError(f"motor_lag_s is {settings.motor_lag_s}; it must be at least 0")
        count = 3 if equilibrium_rad is not None else 4
        self.equilibrium_rad = equilibrium_rad
        self.estimator = Estimator(
            count,
            step_s,
            forgetting_per_s=settings.forgetting_per_s,
            gain=settings.gain,
            block_s=6.0 / bandwidth,
        )
        self._filter = StateFilter(
            second_order(bandwidth, settings.filter_damping),
            step_s,
            scale=bandwidth * bandwidth,
            count=count,
        )
        lag = settings.motor_lag_s
        self._left = math.exp(-step_s / lag) if lag > 0.0 else 0.0
        self._mu = 0.0
        self._settle_steps = round(settings.settle_s / step_s)
        self.samples = 0
        self.samples_saturated = 0
        self.regressor_mu = 0.0
        """mu_f of the last sample, for Fig. 3"""

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the estimator's parameters."""
        if self.equilibrium_rad is not None:
            return NAMES
        return ("a_w", "a_th cos(theta_0)", "a_th sin(theta_0)", "k_v")

    def take(self, front_volts: float, rear_volts: float, angle_rad: float) -> PitchEstimates:
        """Take one tick and return the estimates after it."""
        if not all(map(math.isfinite, (front_volts, rear_volts, angle_rad))):
            raise IdentificationError(
                f"sample {self.samples}: voltages ({front_volts}, {rear_volts}) and angle {angle_rad} "
                "must be finite"
            )
        front, rear = self._acting(front_volts), self._acting(rear_volts)
        mu = self._mu
        angle = angle_rad if self.equilibrium_rad is None else angle_rad - self.equilibrium_rad
        pull = [math.sin(angle)]
        if self.equilibrium_rad is None:
            pull.append(math.cos(angle))
        self._filter.take(np.array((angle_rad, *pull, mu), dtype=np.float64))
        states = self._filter.states
        self.regressor_mu = float(states[0, -1])
        if self.samples >= self._settle_steps:
            signs = (-1.0,) if self.equilibrium_rad is not None else (-1.0, 1.0)
            pulls = states[0, 1:-1] * np.array(signs)
            regressor = np.concatenate(((-states[1, 0],), pulls, (states[0, -1],)))
            self.estimator.update(regressor, float(self._filter.highest[0]))
        # (12) over the tick, exactly: the voltage is held.
        self._mu = front - rear + (mu - (front - rear)) * self._left
        self.samples += 1
        return self.estimates

    @property
    def estimates(self) -> PitchEstimates:
        """Return the parameters as estimated so far."""
        values = [float(value) for value in self.estimator.estimates]
        if self.equilibrium_rad is not None:
            return PitchEstimates(values[0], values[1], values[2], self.equilibrium_rad)
        damping, cosine, sine, gain = values
        return PitchEstimates(damping, math.hypot(cosine, sine), gain, math.atan2(sine, cosine))

    @property
    def deviations(self) -> PitchEstimates:
        """Return the standard errors of the estimates; 0 for a theta_0 that was given."""
        values = [float(value) for value in self.estimator.deviations]
        if self.equilibrium_rad is not None:
            return PitchEstimates(values[0], values[1], values[2], 0.0)
        # c and d share one magnitude and one angle: to first order their errors carry over as they are.
        stiffness = self.estimates.stiffness_per_s2
        angle = values[2] / stiffness if stiffness > 0.0 else math.inf
        return PitchEstimates(values[0], values[1], values[3], angle)

    def warnings(self) -> list[str]:
        """Return what is wrong with the data or the estimates; empty when all is well."""
        found = self.estimator.warnings(self.names)
        if self.samples_saturated > 0.02 * self.samples:
            share = self.samples_saturated / self.samples
            found.append(
                f"the motors were commanded beyond +-{self.settings.volts_max:g} V in {share:.0%} of "
                "the samples; the voltages were clamped there, as the motors do: if they saturate "
                "elsewhere, say so, or the gain k_v comes out wrong"
            )
        if self.estimates.torque_gain_rad_per_v_s2 < 0.0:
            found.append("k_v is negative: front and rear voltage are exchanged, or the encoder's sign")
        if self.estimates.rate_damping_per_s < 0.0:
            found.append("a_w is negative: the data show a body that gains energy by itself")
        return found

    def _acting(self, volts: float) -> float:
        limit = self.settings.volts_max
        if -limit <= volts <= limit:
            return volts
        self.samples_saturated += 1
        return limit if volts > 0.0 else -limit
