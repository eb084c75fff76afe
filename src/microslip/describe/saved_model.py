"""What a user may write about a joint whose joint model was saved (`microslip.analyses.prepared.saved`).

Geometry, material, contact, preload and damping are in the file of the model. What is left to say is which of
its ports are loads, of which kind, which are reported, and what is asked for.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from microslip.describe.amplitude import Load
from microslip.describe.named import Named
from microslip.describe.named_joint import USUAL_QUANTITY, check_named, driven_of
from microslip.describe.outputs import AnyQuantityName
from microslip.describe.quantities import Section, list_of_sections
from microslip.describe.requests import Requests, cycles_and_response, holds_requests
from microslip.describe.sources import Source, split_source
from microslip.describe.whole import WideJoint, WideOutput, WidePort

PORT_NAME = "^[A-Za-z][A-Za-z0-9_ -]*$"
"""How a port of a saved model may be called: outputs of its joint file have a blank in their names."""


class SavedModel(Section):
    """A joint model in a file, as `microslip export` writes it."""

    file: Source
    """File of the model, .npz. Everything but the loads and what is asked for is in it: pairs, modes,
    contact, preload, damping."""
    width: Literal["whole"] | None = None
    """Only "whole", and only where the model was saved of a whole structure: its forces, moments and energies
    are not per metre of width. Units of the loads."""


class ModelPort(WidePort):
    """A load of the model, `[[port]]`, under the name that it has there."""


class ModelOutput(WideOutput):
    """A quantity of the motion, `[[output]]`."""

    quantity: AnyQuantityName = Field(default="deflection")
    """What the port measures, as it was said where the model comes from. Velocities and accelerations are the
    derivatives of a port's displacement: static cycles have none."""
    of: str | None = Field(default=None, pattern=PORT_NAME, max_length=60)
    """Port of the model whose output it is; left out, that of the output of this name in the joint file that
    the model comes from. Whatever else is to be reported, as the motion of a load."""

    @property
    def port(self) -> str:
        """Port of the joint model whose output it is."""
        return super().port if self.of is None else self.of


ModelPorts = Annotated[
    tuple[ModelPort, ...],
    list_of_sections(20, "must be at most 20 sections, [[port]]"),
    Field(min_length=1),
]
ModelOutputs = Annotated[
    tuple[ModelOutput, ...], list_of_sections(100, "must be at most 100 sections, [[output]]")
]


@holds_requests
class ModelJoint(WideJoint):
    """A joint whose joint model was saved, its loads and the analyses asked for."""

    unnamed: ClassVar[str] = "a joint from a saved model"
    width_in: ClassVar[str] = "model"
    modes_key: ClassVar[str] = "model.file: modes"
    pairs_key: ClassVar[str] = "model.file: contact pairs"

    kind: Literal["model"]
    """What the joint is described by. Which sections the file has: here a saved model and its ports, for
    "lap" dimensions."""
    title: str | None = Field(default=None, max_length=200)
    """Name of the joint. Heads tables, figures and the summary."""
    model: SavedModel
    port: ModelPorts
    """Loads that [load] may name, [[port]]; where there is one, it drives the joint."""
    load: Load | None = None
    analysis: Requests = Field(default_factory=cycles_and_response)
    output: ModelOutputs = Field(default=())
    """Quantities that are reported, [[output]]; left out, the displacement of the driven port. Tables and
    figures show the first."""

    @property
    def measured(self) -> tuple[ModelOutput, ...]:
        """Quantities that are reported, and the port of each."""
        if self.output:
            return self.output
        port = driven_of(self.port, self.load)
        quantity = USUAL_QUANTITY[port.kind]
        return (ModelOutput.model_construct(name=quantity, quantity=quantity, of=port.name),)

    @property
    def rayleigh(self) -> tuple[float, float]:
        """None of its own: the model has its damping."""
        return 0.0, 0.0

    @property
    def damping_of_modes(self) -> tuple[tuple[int, float], ...]:
        """None of its own: the model has its damping."""
        return ()

    @property
    def held(self) -> tuple[Named, ...]:
        """None that the file names: the preload is the model's."""
        return ()

    @property
    def preload_key(self) -> str:
        """None that the file has: the preload is the model's."""
        return "the preload where the model comes from"

    @property
    def modes_kept(self) -> int:
        """None to choose: the model has its modes."""
        return 0

    @property
    def frictionless(self) -> bool:
        """Whether the file says that no contact pair has friction: it does not, the model does."""
        return False

    @property
    def files(self) -> tuple[str, ...]:
        """The file of the model."""
        return (split_source(self.model.file)[0],)

    def __repr__(self) -> str:
        title = [repr(self.title)] if self.title else []
        facts = (
            f"model {self.model.file}",
            f"analyses: {', '.join(self.analysis.asked) or 'none'}",
        )
        return f"ModelJoint({', '.join((*title, *facts))})"

    __str__ = __repr__

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_named(self)
        return self
