"""Joints from files that are of a width: loads and results per metre of it, or those of the whole."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, ModelWrapValidatorHandler, PrivateAttr, model_validator

from microslip.describe import units
from microslip.describe.named_joint import NamedJoint
from microslip.describe.outputs import QUANTITIES_OF_THE_WHOLE, NamedOutput, Quantity
from microslip.describe.ports import KINDS_OF_THE_WHOLE, LoadKind, LoadPort


def _width(value: Any) -> float | str:
    if value == "whole":
        return "whole"
    try:
        width = units.LENGTH.parse(value)
    except ValueError as error:
        raise ValueError(f'{error}, or "whole"') from None
    if not width > 0:
        raise ValueError('must be greater than 0, or "whole"')
    return width


Width = Annotated[float | Literal["whole"], BeforeValidator(_width)]
"""A width that loads and results are per metre of, or none."""


class WidePort(LoadPort):
    """A load per metre of a width, or of a whole structure."""

    _whole: bool = PrivateAttr(default=False)

    @property
    def load(self) -> LoadKind:
        """What its load is called and measured in."""
        return KINDS_OF_THE_WHOLE[self.kind] if self._whole else super().load

    def mark_whole(self) -> None:
        """Make its load that of a whole structure, which a joint decides when it is read."""
        self._whole = True


class WideOutput(NamedOutput):
    """A quantity per metre of a width, or of a whole structure."""

    _whole: bool = PrivateAttr(default=False)

    @property
    def measured(self) -> Quantity:
        """What is measured."""
        own = super().measured
        return QUANTITIES_OF_THE_WHOLE.get(self.quantity, own) if self._whole else own

    def mark_whole(self) -> None:
        """Make it that of a whole structure, which a joint decides when it is read."""
        self._whole = True


class WideJoint(NamedJoint):
    """A joint whose file says what width it is of, or that it is the whole."""

    width_in: ClassVar[str]
    """Section of the key width."""

    if TYPE_CHECKING:
        port: tuple[WidePort, ...]

    @property
    def given_width(self) -> float | str | None:
        """The key width; None where it is left out."""
        section = getattr(self, self.width_in)
        return section.width if "width" in section.model_fields_set else None

    @property
    def width(self) -> float:
        """What forces and energies are divided by, m; 1 of the whole."""
        given = self.given_width
        return float(given) if isinstance(given, int | float) else 1.0

    @property
    def whole(self) -> bool:
        """Whether forces, moments and energies are of the whole structure, and not per metre of width."""
        return self.given_width == "whole"

    @model_validator(mode="wrap")
    @classmethod
    def _in_its_units(cls, data: Any, read: ModelWrapValidatorHandler[Self]) -> Self:
        section = data.get(cls.width_in) if isinstance(data, Mapping) else None
        whole = isinstance(section, Mapping) and section.get("width") == "whole"
        with units.of_the_whole(whole):
            return read(data)

    def model_post_init(self, context: Any, /) -> None:
        """Mark loads and outputs of a whole structure, also of a joint that was stored."""
        if self.whole:
            for port in self.port:
                port.mark_whole()
            for output in self.output:
                if isinstance(output, WideOutput):
                    output.mark_whole()


class PressedJoint(WideJoint):
    """One whose prestress is still to be found."""

    prestress: Literal["frictionless", "frictional"] | None = None
    """Whether preloads press the sides together with friction, "frictional", raised slowly from nothing, or
    "frictionless"; left out, with friction where they slide bodies along gentle slopes, as tapers, or where
    nothing else keeps these in place. Pressure of sloping surfaces, tractions that are locked in."""

    @property
    def raised(self) -> bool | None:
        """Whether preloads are asked to be raised with friction; None where that is left out."""
        return None if self.prestress is None else self.prestress == "frictional"
