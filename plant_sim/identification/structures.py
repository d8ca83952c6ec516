"""Structures: the possible equations of a model, each linear in its parameters.

An equation says that a derivative of an output is a sum of terms: a parameter times a derivative of a
signal. The signals are functions of the outputs, then the inputs, then the constant 1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array

GRAMMAR = "pitch, first-order, integrator, integrator:ORDER, siso:N,M or linear"
ORDER_MAX = 4
COSINE, SINE = "a_th cos(theta_0)", "a_th sin(theta_0)"


class Term(NamedTuple):
    """A parameter times a derivative of a signal."""

    name: str
    signal: int
    derivative: int
    sign: float = 1.0


class Equation(NamedTuple):
    """The derivative of a signal as a sum of terms."""

    signal: int
    derivative: int
    terms: tuple[Term, ...]


class Parameter(NamedTuple):
    """A parameter as it is reported."""

    name: str
    letter: str
    unit: str
    value: float
    deviation: float


class StateSpace(NamedTuple):
    """dx/dt = A x + B u + d, y = C x; the names of the states."""

    A: Array
    B: Array
    C: Array
    offset: Array
    states: tuple[str, ...]


@dataclass(frozen=True)
class LinearStructure:
    """Any linear structure: `orders` of the equations, `input_order` of the input's derivatives.

    With `coupled`, every output's equation has all outputs and rates in it. An offset, the constant
    force d, is estimated with the others.
    """

    kind: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    n: int
    input_order: int = 0
    integrates: bool = False
    """the outputs' own terms are 0"""
    coupled: bool = False

    @property
    def order(self) -> int:
        """Return the highest derivative."""
        return self.n

    @property
    def equations(self) -> tuple[Equation, ...]:
        return tuple(self._equation(index) for index in range(len(self.outputs)))

    def _equation(self, output: int) -> Equation:
        count, constant = len(self.outputs), len(self.outputs) + len(self.inputs)
        others = range(count) if self.coupled else (output,)
        terms = []
        for derivative in range(self.n - 1, -1, -1) if not self.integrates else ():
            for other in others:
                name = self._own(output, other, derivative)
                terms.append(Term(name, other, derivative, 1.0 if self.coupled else -1.0))
        for index in range(len(self.inputs)):
            terms += [
                Term(self._gain(output, index, derivative), count + index, derivative)
                for derivative in range(self.input_order, -1, -1)
            ]
        terms.append(Term(self._offset(output), constant, 0))
        return Equation(output, self.n, tuple(terms))

    def _own(self, output: int, other: int, derivative: int) -> str:
        if not self.coupled:
            return "a" if self.n == 1 else f"a_{self.n - derivative}"
        return f"{self.outputs[output]}''/{self.outputs[other]}" + "'" * derivative

    def _gain(self, output: int, index: int, derivative: int) -> str:
        if self.coupled:
            return f"{self.outputs[output]}''/{self.inputs[index]}"
        number = f"_{self.input_order - derivative}" if self.input_order or self.n > 1 else ""
        if self.integrates:
            number = ""
        return f"b{number}" if len(self.inputs) == 1 else f"b{number}/{self.inputs[index]}"

    def _offset(self, output: int) -> str:
        return f"{self.outputs[output]}''/1" if self.coupled else "d"

    def signals(self, outputs: Array) -> Array:
        return outputs

    def acting(self, inputs: Array) -> Array:
        return inputs

    def parameters(self, values: Mapping[str, float], covariance: Array) -> list[Parameter]:
        spread = dict(zip(values, np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist(), strict=True))
        return [
            Parameter(name, name, "", values.get(name, 0.0), spread.get(name, 0.0))
            for name in names_of(self)
        ]

    def state_space(self, values: Mapping[str, float]) -> StateSpace:
        """Return the matrices; states are outputs and rates, where no input makes the rates jump."""
        n, count = self.n, len(self.outputs)
        A, B = np.zeros((n * count, n * count)), np.zeros((n * count, len(self.inputs)))
        C, offset = np.zeros((count, n * count)), np.zeros(n * count)
        states: list[str] = []
        for output, name in enumerate(self.outputs):
            first, last = n * output, n * output + n - 1
            A[first:last, first + 1 : last + 1] = np.eye(n - 1)
            C[output, first] = 1.0
            offset[last] = values.get(self._offset(output), 0.0)
            for index in range(len(self.inputs)):
                for derivative in range(self.input_order + 1):
                    gain = values.get(self._gain(output, index, derivative), 0.0)
                    B[last - derivative, index] = gain
            for other in range(count) if self.coupled else (output,):
                for derivative in range(n):
                    if self.integrates:
                        continue
                    value = values.get(self._own(output, other, derivative), 0.0)
                    if self.coupled:
                        A[last, n * other + derivative] = value
                    elif self.input_order:
                        # Observer form: the input's derivatives need none of the input itself.
                        A[last - derivative, first] = -value
                    else:
                        A[last, first + derivative] = -value
            rates = ("", "_rate", "_acceleration", "_jerk") if not self.input_order else ("",)
            states += [
                name + (rates[place] if place < len(rates) else f"_state{place + 1}")
                for place in range(n)
            ]
        return StateSpace(A, B, C, offset, tuple(states))


@dataclass(frozen=True)
class PitchStructure:
    """The pitch model (11), (12).

    theta'' = -a_w theta' - a_th sin(theta - theta_0) + k_v mu                       (11)
    T_m vbar_i' + vbar_i = v_i,   mu = vbar_front - vbar_rear                        (12)

    The bias `equilibrium_rad`, theta_0, is measured beforehand, or None. Where it is not to be trusted
    (a body leaning on something on the ground), it is estimated with the others:
    a_th sin(theta - theta_0) = c sin(theta) - d cos(theta) is linear in c = a_th cos(theta_0) and
    d = a_th sin(theta_0).
    """

    equilibrium_rad: float | None = None
    volts_max: float = math.inf
    """where each motor saturates: commands beyond it have no further effect"""
    damped: bool = True
    """False: a_w is held at 0"""

    kind = "pitch"
    order = 2

    @property
    def equations(self) -> tuple[Equation, ...]:
        """Return (11)."""
        pulls: tuple[Term, ...] = (Term("a_th", 1, 0, -1.0),)
        if self.equilibrium_rad is None:
            pulls = (Term(COSINE, 1, 0, -1.0), Term(SINE, 2, 0))
        damping = (Term("a_w", 0, 1, -1.0),) if self.damped else ()
        return (Equation(0, 2, (*damping, *pulls, Term("k_v", 1 + len(pulls), 0))),)

    def signals(self, outputs: Array) -> Array:
        """Return theta and sin(theta - theta_0), or theta, its sine and its cosine."""
        angle = outputs[:, :1]
        if self.equilibrium_rad is not None:
            return np.hstack((angle, np.sin(angle - self.equilibrium_rad)))
        return np.hstack((angle, np.sin(angle), np.cos(angle)))

    def acting(self, inputs: Array) -> Array:
        """Return v_front - v_rear, each as far as its motor follows; a single input is v_front."""
        volts = np.clip(inputs, -self.volts_max, self.volts_max)
        return volts[:, :1] - volts[:, 1:2] if inputs.shape[1] > 1 else volts

    def constants(self, values: Mapping[str, float]) -> tuple[float, float, float, float]:
        """Return a_w, a_th, k_v and theta_0."""
        damping, gain = values.get("a_w", 0.0), values.get("k_v", 0.0)
        if self.equilibrium_rad is not None:
            return damping, values.get("a_th", 0.0), gain, self.equilibrium_rad
        cosine, sine = values.get(COSINE, 0.0), values.get(SINE, 0.0)
        return damping, math.hypot(cosine, sine), gain, math.atan2(sine, cosine)

    def parameters(self, values: Mapping[str, float], covariance: Array) -> list[Parameter]:
        """Return the fields of the model's section; 0 is the error of a theta_0 that was given."""
        found = self.constants(values)
        order = list(values)
        turn = np.zeros((4, len(order)))
        for row, name in ((0, "a_w"), (1, "a_th"), (2, "k_v")):
            if name in values:
                turn[row, order.index(name)] = 1.0
        if self.equilibrium_rad is None and COSINE in values:
            # To first order, by the derivatives of size and angle.
            stiffness, angle = max(found[1], 1e-12), found[3]
            for name, along, across in (
                (COSINE, math.cos(angle), -math.sin(angle)),
                (SINE, math.sin(angle), math.cos(angle)),
            ):
                turn[1, order.index(name)], turn[3, order.index(name)] = along, across / stiffness
        with np.errstate(invalid="ignore"):
            spread = np.sqrt(np.maximum(np.diag(turn @ covariance @ turn.T), 0.0))
        spread = np.where(np.isnan(spread), math.inf, spread)
        fields = (
            ("rate_damping_per_s", "a_w", "1/s"),
            ("stiffness_per_s2", "a_th", "1/s^2"),
            ("torque_gain_rad_per_v_s2", "k_v", "rad/(V s^2)"),
            ("equilibrium_rad", "theta_0", "rad"),
        )
        return [
            Parameter(*field, value, float(deviation))
            for field, value, deviation in zip(fields, found, spread, strict=True)
        ]


Structure: TypeAlias = PitchStructure | LinearStructure


def names_of(structure: Structure) -> tuple[str, ...]:
    """Return the names of all parameters, equation by equation."""
    return tuple(term.name for equation in structure.equations for term in equation.terms)


def functions_of(structure: Structure) -> int:
    """Return how many functions of the outputs there are: the first of the signals."""
    return int(structure.signals(np.zeros((1, len(structure.equations)))).shape[1])


def gains_of(structure: Structure, inputs: int) -> set[str]:
    """Return the names of the parameters that an input acts through."""
    first = functions_of(structure)
    return {
        term.name
        for equation in structure.equations
        for term in equation.terms
        if first <= term.signal < first + inputs
    }


def parse_linear(text: str, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> LinearStructure:
    """Return the linear structure that a command line names; IdentificationError."""
    kind, _, numbers = text.partition(":")
    if kind == "first-order" and not numbers:
        found = LinearStructure(text, outputs, inputs, 1)
    elif kind == "integrator" and re.fullmatch(r"\d*", numbers):
        found = LinearStructure(text, outputs, inputs, int(numbers or 1), integrates=True)
    elif kind == "siso" and (match := re.fullmatch(r"(\d+),(\d+)", numbers)):
        found = LinearStructure(text, outputs, inputs, int(match[1]), int(match[2]))
    elif text == "linear":
        return LinearStructure(text, outputs, inputs, 2, coupled=True)
    else:
        raise IdentificationError(f"--structure {text}: give {GRAMMAR}")
    if not 1 <= found.n <= ORDER_MAX or found.input_order >= found.n:
        raise IdentificationError(
            f"--structure {text}: the order must be 1 to {ORDER_MAX}, and that of the input below it"
        )
    if len(outputs) != 1:
        raise IdentificationError(
            f"--structure {text} has one output, and the record has {len(outputs)} "
            f"({', '.join(outputs)}): choose one with --columns, or take linear"
        )
    return found
