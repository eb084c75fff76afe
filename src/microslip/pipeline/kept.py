"""Cycles of the full joint under a load that keeps the stuck mode's share of the motion.

Under a given load a motion at resonance takes as many cycles as its damping is small to be steady. Here the
share ``a`` of the stuck mode is given instead, at the beginning of every cycle, and the load follows from
what the cycle before has told: the slowest transient, and whatever folds, is gone. What is left to settle
are the other modes and the tractions.

Of a cycle of period T, steady or not, the projection on the stuck mode phi

    a'' + c a' + omega_st² a + g = phi^T p M     gives     G = phi^T p M - D A_1 - B,
    B = (2i/T) e^{-i theta_0} [a' + (i omega + c) a]_0^T,

with the first harmonics G, A_1 of contact force and share and with what the ends of the cycle differ by in B:
an identity, so that ``kappa`` is known of a motion that still changes (`KeptMotion.reading`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from microslip.analyses.prepared.direct import stuck_oscillator
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.analyses.time.coupled import accelerations
from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.scheme import (
    March,
    State,
    contact_memory,
    march,
    no_tangents,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.starts import Start, end_of, placed, true_rates
from microslip.contact.tangent import Tangents
from microslip.numerics.fourier import harmonic, without_drift
from microslip.pipeline.targets import STEPS
from microslip.typing import Array, Complex


class End(NamedTuple):
    """Where a motion was left.

    Attributes
    ----------
    size : float
        ``|Q|``, first harmonic of the joint's coordinate.
    start : Start
        At the passage of the coordinate upward through zero.
    """

    size: float
    start: Start


class KeptMotion:
    """A motion of one frequency.

    Parameters
    ----------
    joint : PreparedJoint
    model : TwoModeModel
        Its `microslip.analyses.reduced.two_mode.stuck_model`.
    omega : float
        rad/s.
    load : float
        Of the first cycle.
    A : complex
        What is kept, ``Q + c load`` against that load.
    """

    def __init__(
        self, joint: PreparedJoint, model: TwoModeModel, omega: float, load: float, A: complex
    ) -> None:
        self.joint, self.model, self.omega = joint, model, omega
        self.frequency = omega / (2 * np.pi)
        self.scheme = time_scheme(joint, 1 / (self.frequency * STEPS), frequency=self.frequency)
        self.memory = contact_memory(self.scheme)
        self.space = StateSpace(self.scheme, omega)
        self.D, self.c = complex(model.linear_stiffness(omega)), float(model.offset[0])
        self.port = joint.model.port(joint.coordinate)
        shape = stuck_oscillator(joint)[1]
        self.share = float(joint.model.port_modes[:, self.port] @ shape)
        self.shape = shape[: len(self.scheme.joint.model.omega)]
        self.moves = self._moves()
        self.size = abs(A - self.c * load)
        self.drive(load * np.exp(-1j * np.angle(A - self.c * load)))

    def _moves(self) -> Array:
        """Deviations of the state by a unit of rate and of position of the stuck mode, rows."""
        move, none = no_tangents(self.scheme, 2), np.zeros_like(self.shape)
        kernel, model = self.scheme.kernel, self.scheme.joint.model
        unit = self.shape / float(self.shape @ self.shape)
        move.rate[0] = move.eta[1] = unit
        move.acceleration[0] = accelerations(kernel, none, unit)
        move.acceleration[1] = accelerations(kernel, -(model.omega**2) * unit, none)
        move.residual_v[1] = move.residual_before[1] = -model.mode_v @ unit
        return self.space.vector(move)

    def drive(self, load: complex) -> None:
        """Take a load, complex against a motion that passes upward through zero as a cycle begins."""
        self.load, self.phase = abs(load), float(np.angle(load))
        self.theta = self.phase + 2 * np.pi * np.arange(STEPS + 1) / STEPS

    def keeping(self, A: complex, kappa: complex) -> complex:
        """Load to `drive` with under which an amplitude stays that was read under the load now."""
        resists = self.D + self.model.omega**2 * kappa
        M = resists * A / (self.model.force[0] + self.D * self.c)
        return complex(M * np.exp(1j * self.phase))

    def resists(self, kappa: complex) -> complex:
        """``D / omega_st² + kappa``."""
        return self.D / self.model.omega**2 + kappa

    def begun(self, ends: Sequence[End]) -> State:
        """On the line through the last two ends, or through rest and one; at rest with a velocity of none."""
        rest = prestressed_state(self.scheme, 0.0 if ends else self.size, self.omega)
        if not ends:
            return rest
        none = End(0.0, end_of(rest, 0.0, self.scheme, self.frequency))
        (x, one), (y, two) = (none, *ends)[-2:]
        t = (self.size - y) / (y - x)
        k = min(len(one.eta), len(two.eta))

        def line(a: Array, b: Array) -> Array:
            return np.asarray(b + t * (b - a))

        start = replace(
            two,
            phase=self.phase,
            eta=line(one.eta[:k], two.eta[:k]),
            rate=line(one.rate[:k], two.rate[:k]),
            residual_rate=line(one.residual_rate, two.residual_rate),
            r=line(one.r, two.r),
            v=line(one.v, two.v),
        )
        return placed(start, self.scheme, self.frequency, self.load)

    def march(self, state: State, tangents: Tangents | None = None) -> March:
        """One cycle, histories kept."""
        wave = self.load * np.sin(self.theta)
        return march(self.scheme, state, wave, keep=True, memory=self.memory, tangents=tangents)

    def kept(self, state: State, cycle: March) -> March:
        """The cycle with the stuck mode's share at its end, and of its deviations, as at its beginning."""
        x, y = self.space.vector(state), self.space.vector(cycle.state)
        others = self.space.vector(cycle.tangents)
        after = self.space.state(y - self._stuck(y - x) @ self.moves, cycle.state)
        parts = np.split(others - self._stuck(others) @ self.moves, self.space.cuts, axis=-1)
        return replace(cycle, state=after, tangents=Tangents(*parts))

    def _stuck(self, vectors: Array) -> Array:
        """Rate and position of the stuck mode, rows for rows."""
        k = len(self.shape)
        parts = vectors[..., k : 2 * k] @ self.shape, vectors[..., :k] @ self.shape
        return np.stack(parts, axis=-1)

    def change(self, state: State, cycle: March) -> float:
        """Of the vibration over a cycle, relative."""
        return self.space.change(self.space.vector(state), self.space.vector(cycle.state))

    def reading(self, state: State, cycle: March) -> tuple[complex, complex]:
        """A against the load, and kappa, of a cycle from a state."""
        q = cycle.output[:, self.port].copy()
        q[0] = 0.5 * (q[0] + q[-1])  # the trapezoidal rule, where the ends differ
        A = complex(harmonic(q, self.theta)) + self.c * self.load
        before, after = (
            true_rates(one, self.scheme, self.frequency) for one in (state, cycle.state)
        )
        place = complex(self.shape @ (cycle.state.eta - state.eta))
        ends = complex(self.shape @ (after - before))
        ends += (1j * self.omega + self.D.imag / self.omega) * place
        B = self.share * 2j * self.frequency * np.exp(-1j * self.phase) * ends
        push = (self.model.force[0] + self.D * self.c) * self.load
        return A, complex((push - self.D * A - B) / (A * self.model.omega**2))

    def outputs(self, cycle: March) -> Complex:
        """First harmonics of the outputs of all ports."""
        return np.asarray(harmonic(without_drift(cycle.output, self.theta), self.theta))

    def end(self, A: complex, cycle: March) -> End:
        """Where a cycle ends, to begin another motion from."""
        start = end_of(cycle.state, self.phase, self.scheme, self.frequency)
        return End(abs(A - self.c * self.load), start)
