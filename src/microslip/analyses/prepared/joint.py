"""A joint made ready for every analysis: what they all take.

It knows no description: dimensions, a mesh or matrices of other programs all end here. It is small
(some dozens of modes, a dense flexibility of the contact pairs), frozen, and pickles, so that a process
or a worker of a cluster gets it whole.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from microslip.analyses.prepared.joint_modes import JointMode, driven_mode
from microslip.analyses.prepared.prestress import Prestress, prestress
from microslip.analyses.prepared.settled import settled
from microslip.contact.law import ContactLaw
from microslip.errors import ModelError
from microslip.model.flexibility import Flexibility, static_flexibility, with_compliance
from microslip.model.joint import JointModel
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class PreparedJoint:
    """Model, static flexibility, prestress and contact law of a joint, and what drives it.

    Attributes
    ----------
    model : JointModel
    flexibility : Flexibility
        Static, with the compliance of the contact.
    prestress : Prestress
        Its preload is held in every analysis.
    law : ContactLaw
    drive : str
        Port of the excitation.
    mode : JointMode or None
        The mode that the excitation excites most. Its port gives the modal amplitude that analyses
        report; without it they report the output of the driven port.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> stickier = joint.with_friction(0.4)  # nothing is assembled again
    >>> stickier.flexibility is joint.flexibility, float(stickier.law.friction[0])
    (True, 0.4)
    """

    model: JointModel
    flexibility: Flexibility
    prestress: Prestress
    law: ContactLaw
    drive: str
    mode: JointMode | None = None

    @property
    def coordinate(self) -> str:
        """Port whose output is the amplitude of the vibration."""
        return self.drive if self.mode is None else self.mode.port

    @property
    def held(self) -> Array:
        """(p,) amplitudes of the preload on all ports."""
        return self.model.amplitudes(self.prestress.preload)

    def principal(self) -> JointMode:
        """The mode; raises `ModelError` where the joint was prepared without one."""
        if self.mode is None:
            raise ModelError("this joint was prepared without a mode: give one to `prepare_joint`")
        return self.mode

    def with_friction(self, friction: float | Array) -> PreparedJoint:
        """The same joint with another coefficient of friction.

        The prestress stays, but where it is one with friction, see
        `microslip.analyses.prepared.settled.settled`.
        """
        law, start = self.law.with_friction(friction), self.prestress
        if start.raised or (start.raised is None and start.frictional):
            again = prestress(self.model, self.flexibility, start.preload, tuple(start.preload))
            start = replace(again, raised=start.raised)
        return replace(
            self, law=law, prestress=settled(self.model, self.flexibility, start, law.friction)
        )

    def with_preload(self, preload: Mapping[str, float]) -> PreparedJoint:
        """The same joint under another preload; only the prestress is solved again.

        Ports that are held and not named stay as they are, initial gaps among them.
        The mode stays that of the pairs that touched before: a receding contact keeps them when the
        preload is scaled.

        Raises
        ------
        ModelError
            Where `preload` does not name ports.
        """
        if not isinstance(preload, Mapping):
            names = ", ".join(repr(name) for name in self.prestress.preload)
            raise ModelError(
                f"a preload is an amplitude for each port that is named, one of {names}, not {preload!r}: "
                "with_preload({name: amplitude})"
            )
        held = {**self.prestress.preload, **preload} if preload else {}
        start = prestress(self.model, self.flexibility, held)
        start = replace(start, raised=self.prestress.raised)
        return replace(
            self, prestress=settled(self.model, self.flexibility, start, self.law.friction)
        )

    def with_model(self, model: JointModel) -> PreparedJoint:
        """The same joint with another model of it, such as one with more ports."""
        return replace(self, model=model, flexibility=flexibility_of(model, self.law))

    def __repr__(self) -> str:
        m, held = self.model, ", ".join(f"{k} {v:.4g}" for k, v in self.prestress.preload.items())
        mode = ""
        if self.mode is not None:
            mode = (
                f", mode {self.mode.sliding_frequency:.2f} Hz sliding, "
                f"{self.mode.stuck_frequency:.2f} Hz stuck"
            )
        return (
            f"PreparedJoint({m.pairs} pairs, {len(m.omega)} modes, preload {held}, "
            f"driven at {self.drive!r}{mode})"
        )


def flexibility_of(model: JointModel, law: ContactLaw) -> Flexibility:
    """Static flexibility of a model behind the compliance of its contact."""
    flexibility = static_flexibility(model)
    return flexibility if law.exact else with_compliance(flexibility, law.compliance)


def prepare_joint(
    model: JointModel,
    law: ContactLaw,
    preload: Mapping[str, float],
    drive: str,
    mode: JointMode | None = None,
) -> PreparedJoint:
    """Prestress a joint model.

    Parameters
    ----------
    model : JointModel
    law : ContactLaw
    preload : mapping of str to float
        Ports that are held, and their amplitudes.
    drive : str
        Port of the excitation.
    mode : JointMode, optional
        Whose ports the model has, see `with_principal_mode` for models without.

    Raises
    ------
    ContactError
        Where the preload presses no pair together.
    ModelError
        Where the model has no such ports.
    """
    model.port(drive)
    flexibility = flexibility_of(model, law)
    start = settled(model, flexibility, prestress(model, flexibility, preload), law.friction)
    return PreparedJoint(model, flexibility, start, law, drive, mode)


def with_principal_mode(
    prepared: PreparedJoint, loads: Collection[str] | None = None
) -> PreparedJoint:
    """The joint with the mode that its driving port excites most, and the ports of that mode.

    The modes are those of the joint model; a structure's own are more exact by the error of the
    reduction. `loads` is as for `microslip.analyses.prepared.joint_modes.driven_mode`.
    """
    found = driven_mode(prepared.model, prepared.prestress, prepared.law, prepared.drive, loads)
    other = 1.0 if found.load_on_stuck[prepared.drive] >= 0 else -1.0
    sign = other * (1.0 if found.overlap >= 0 else -1.0)
    mode = replace(
        found,
        sliding=sign * found.sliding,
        stuck=other * found.stuck,
        overlap=abs(found.overlap),
        load_on_sliding={k: sign * v for k, v in found.load_on_sliding.items()},
        load_on_stuck={k: other * v for k, v in found.load_on_stuck.items()},
        port="sliding",
        stuck_port="stuck",
    )
    model = prepared.model.with_modal_ports({mode.port: mode.sliding, mode.stuck_port: mode.stuck})
    return replace(prepared.with_model(model), mode=mode)
