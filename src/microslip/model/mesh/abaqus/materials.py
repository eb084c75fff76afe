"""Materials of a deck."""

from __future__ import annotations

from microslip.errors import Caution, InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.abaqus.deck import Keyword


def lacking_in(cards: dict[str, Keyword]) -> str:
    """What a material needs and has not, as a message; empty where it is whole."""
    head = cards["MATERIAL"]
    for name in ("ELASTIC", "DENSITY"):
        if name not in cards or not cards[name].rows:
            return (
                f"{head.where}: {head.parameters['NAME']!r} has no *{name}: give it there, or all of the "
                "material in [[material]] of the joint file"
            )
    return ""


def material_of(
    cards: dict[str, Keyword],
    plane: str | None,
    length: float,
    force: float,
    cautions: list[Caution],
) -> Material:
    """An isotropic material at one temperature.

    Parameters
    ----------
    cards : dict of str to Keyword
        ``MATERIAL`` and what stands behind it.
    plane : str or None
    length, force : float
        Units of the deck in m and N.
    cautions : list of Caution
        What is not used of it is added.

    Raises
    ------
    InputError
        Where it is none, or not whole: file, line and keyword.
    """
    lacking = lacking_in(cards)
    if lacking:
        raise InputError(lacking)
    elastic, density = cards["ELASTIC"], cards["DENSITY"]
    elastic.only("TYPE")
    kind = elastic.parameters.get("TYPE", "ISO").upper()
    if kind not in ("ISO", "ISOTROPIC"):
        raise elastic.refuse(f"TYPE={kind}: isotropic materials alone are understood")
    for card in (elastic, density):
        if len(card.rows) > 1:
            raise card.refuse("values at several temperatures: give those of one")
    E = elastic.rows[0].number(0) * force / length**2
    nu = elastic.rows[0].number(1)
    if not (E > 0 and -1 < nu < 0.5):
        raise elastic.refuse(f"E = {E:g} Pa and nu = {nu:g}: E > 0 and -1 < nu < 0.5 are possible")
    rho = density.rows[0].number(0) * force / length**4
    if not rho > 0:
        raise density.refuse(f"{rho:g} kg/m³: it must be positive")
    return Material(E, nu, rho, plane or "strain", _expansion(cards.get("EXPANSION"), cautions))


def _expansion(card: Keyword | None, cautions: list[Caution]) -> float:
    """Coefficient of thermal expansion, 1/K; none, with a caution, of what is not the same at all
    temperatures and in all directions."""
    if card is None:
        return 0.0
    if not card.rows:
        raise card.refuse("the coefficient is missing")
    kind = card.parameters.get("TYPE", "ISO").upper()
    if kind in ("ISO", "ISOTROPIC") and len(card.rows) == 1:
        return card.rows[0].number(0)
    cautions.append(
        Caution(
            "mesh",
            f"*EXPANSION, {card.where}",
            "not used: one isotropic coefficient alone is",
            "give thermal_expansion in [[material]] if temperatures change",
        )
    )
    return 0.0
