"""Outputs of a response put right by the steady states that it goes through, as its amplitude is.

A cycle of each steady state tells what the outputs of the file are over the amplitude
(`microslip.analyses.reduced.held_output`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from microslip.analyses.prepared.direct import direct_motion
from microslip.analyses.reduced.anchors import branches
from microslip.analyses.reduced.held_output import HeldOutput, held_output
from microslip.analyses.reduced.response import NO_DIGIT, Response
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.analyses.time.scheme import march, time_scheme
from microslip.analyses.time.starts import Start, placed
from microslip.errors import Caution, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.numerics.fourier import harmonic, without_drift
from microslip.pipeline.outputs import harmonics_by_name, with_outputs
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.targets import Stepped
from microslip.typing import Array, Complex, Indices, Mask

NOTHING = 1e-8
"""Size of an output below which it is rounding, over what any mode of that amplitude might make of it."""


@dataclass(frozen=True)
class OutputsHeld:
    """What steady states make of the outputs of a response.

    Attributes
    ----------
    assembly : Assembly
    model, table : TwoModeModel, EquivalentTable
        That the response is of.
    known : dict
        Steady states by index of the frequency, each with the outputs of all ports over the amplitude.
    """

    assembly: Assembly
    model: TwoModeModel
    table: EquivalentTable | None
    known: dict[int, tuple[Start, Complex]] = field(default_factory=dict)

    def response(
        self, curve: Response, states: Mapping[int, Stepped], lost: Iterable[int] = ()
    ) -> Response:
        """A response with its outputs, put right and bounded.

        Parameters
        ----------
        curve : Response
        states : mapping of int to Stepped
            Steady states that it goes through, by index of the frequency.
        lost : iterable of int
            Where a branch ends, as there is none.
        """
        assert curve.error_indicator is not None
        plain = self._of_model(curve)
        held = self._held(plain, states, lost, tuple(plain.outputs))
        return replace(
            plain,
            outputs={name: one.value for name, one in held.items()},
            output_errors={n: curve.error_indicator + one.error for n, one in held.items()},
        )

    def error_of_first(
        self, curve: Response, states: Mapping[int, Stepped], lost: Iterable[int] = ()
    ) -> Array:
        """Bound of the relative error of the first output beside that of the amplitude, (n,).

        Parameters
        ----------
        curve, states, lost
            See `response`.
        """
        first = self.assembly.joint.outputs[0].name
        return self._held(self._of_model(curve), states, lost, (first,))[first].error

    def _of_model(self, curve: Response) -> Response:
        """With the outputs that the model makes of it."""
        return with_outputs(self.assembly, {"refined": (self.model, self.table)}, curve)

    def _held(
        self,
        curve: Response,
        states: Mapping[int, Stepped],
        lost: Iterable[int],
        names: Sequence[str],
    ) -> dict[str, HeldOutput]:
        """Outputs by name, of a response that has those of the model."""
        self._learn(states, curve.load)
        marks = sorted(k for k in states if k in self.known)
        width = len(self.assembly.model.ports)
        over = np.array([self.known[k][1] for k in marks]).reshape(len(marks), width)
        omega = 2 * np.pi * curve.frequency
        true = harmonics_by_name(self.assembly, over, omega[marks])
        own, other, runs = curve.outputs, self._other_state(curve), list(_branches(curve, lost))

        modes = np.linalg.norm(self.assembly.model.port_modes, axis=0)
        scale = np.abs(curve.amplitude).max() * np.tile(modes, (len(omega), 1)).astype(complex)
        scales = harmonics_by_name(self.assembly, scale, omega)

        def found(name: str) -> HeldOutput:
            known = dict(zip(marks, true[name].tolist(), strict=True))
            both = (own[name], own[name] + other[name])
            least = NOTHING * np.abs(scales[name])
            return held_output(curve.frequency, curve.amplitude, both, known, runs, least)

        return {name: found(name) for name in names}

    def _learn(self, states: Mapping[int, Stepped], load: float) -> None:
        """March a cycle of each that is not known yet; one whose steps do not solve stays unknown."""
        new = [k for k, one in states.items() if self._unlike(k, one)]
        port = self.assembly.model.port(self.assembly.prepared.coordinate)
        cycles = each(lambda k: _first_harmonics(self.assembly, states[k], load), new, threads())
        for k, motion in zip(new, cycles, strict=True):
            self.known.pop(k, None)
            if motion is not None:
                self.known[k] = states[k].state, motion / motion[port]

    def _unlike(self, k: int, one: Stepped) -> bool:
        return k not in self.known or self.known[k][0] is not one.state

    def _other_state(self, curve: Response) -> Mapping[str, Complex]:
        """What outputs differ by where the load moves the joint's rest as in the other linear state."""
        joint, omega = self.assembly.prepared, 2 * np.pi * curve.frequency
        own, other = (
            direct_motion(joint, joint.drive, omega, stuck=stuck)
            for stuck in (self.model.stuck, not self.model.stuck)
        )
        return harmonics_by_name(self.assembly, (other - own) * curve.load, omega)


def doubtful_outputs(curve: Response, wanted: float, place: str) -> list[Caution]:
    """Outputs that are not known as well as is wanted where the amplitude is.

    Parameters
    ----------
    curve : Response
    wanted : float
        Relative.
    place : str
        Where cautions say to be.
    """
    if curve.error_indicator is None:
        return []
    known = curve.error_indicator <= wanted
    f = curve.frequency[known]
    return [
        _caution(name, f, error[known], worse, wanted, place)
        for name, error in curve.output_errors.items()
        if (worse := ~(error[known] <= wanted)).any()
    ]


def _caution(name: str, f: Array, error: Array, worse: Mask, wanted: float, place: str) -> Caution:
    worst = int(np.argmax(error))
    most = "not bounded" if error[worst] > NO_DIGIT else f"known to {100 * error[worst]:.3g} % only"
    reason = (
        f'output "{name}" is {most} at {f[worst]:.6g} Hz, and no better than to {100 * wanted:g} % '
        f"at {worse.sum()} of {len(f)} frequencies where the amplitude of the mode is"
    )
    advice = "[analysis.time] and [analysis.harmonic] have the outputs of the motion itself"
    return Caution("response", place, reason, advice)


def _branches(curve: Response, lost: Iterable[int]) -> Iterator[Indices]:
    """Of the steady states that a response goes through."""
    at = np.searchsorted(curve.frequency, [one.frequency for one in curve.anchors])
    return branches(dict(zip(at.tolist(), curve.anchors, strict=True)), lost)


def _first_harmonics(assembly: Assembly, one: Stepped, load: float) -> Complex | None:
    """Of the outputs of all ports over a cycle of a steady state; None where a step has no solution."""
    f, steps = one.frequency, one.steps
    scheme = time_scheme(assembly.prepared, 1 / (f * steps), frequency=f)
    theta = one.state.phase + 2 * np.pi * np.arange(steps + 1) / steps
    try:
        done = march(scheme, placed(one.state, scheme, f, load), load * np.sin(theta))
    except MicroslipError:
        return None
    return np.asarray(harmonic(without_drift(done.output, theta), theta), dtype=complex)
