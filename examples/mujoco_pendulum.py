"""A MuJoCo model as the plant: a rod on a hinge, held upright over 27.8 bit/s.

python examples/mujoco_pendulum.py        (needs: pip install mujoco)

MuJoCo has a rod with a mass and a length, a hinge that damps and a motor in N m; the codec's model has
lambda = 7.32 1/s and a gain in rad/(V s^2). What is left between the two is model mismatch.
"""

from __future__ import annotations

import mujoco
import numpy as np

from tenbaud import fly

TICK_S = 0.004
STEPS = 4  # of MuJoCo in a tick
LENGTH_M = 3.0 * 9.81 / (2.0 * 7.32**2)  # a rod that falls as fast as the model does
GAIN_N_M_PER_V = 4.0 * 0.1 * LENGTH_M**2 / 3.0  # of the motor: 4 rad/s^2 per volt, as in the model

MODEL = f"""
<mujoco>
  <option timestep="{TICK_S / STEPS}" integrator="RK4"/>
  <worldbody>
    <body>
      <joint name="hinge" type="hinge" axis="0 1 0" damping="0.0004"/>
      <geom type="capsule" fromto="0 0 0 0 0 {LENGTH_M}" size="0.01" mass="0.1"/>
    </body>
  </worldbody>
  <actuator><motor joint="hinge" gear="{GAIN_N_M_PER_V}" ctrlrange="-10 10"/></actuator>
</mujoco>
"""


class MujocoPendulum:
    """One hinge, one motor; 0 is upright."""

    def __init__(self, angle_rad: float) -> None:
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[0] = angle_rad

    @property
    def measured(self) -> tuple[float, ...]:
        return (float(self.data.qpos[0]),)

    def advance(self, volts: tuple[float, ...]) -> None:
        self.data.ctrl[:] = volts
        mujoco.mj_step(self.model, self.data, STEPS)


if __name__ == "__main__":
    run = fly("pendulum-30baud", settings={"duration_s": 30.0}, plant=MujocoPendulum(0.02))
    angle_deg = np.degrees(run.angle)
    print(f"30 s upright: within {np.abs(angle_deg[250:]).max():.2f} degrees after the first second")
    print(f"motor: {np.abs(run.motor).max():.1f} V at most; desyncs: {run.summary['desyncs']}")
