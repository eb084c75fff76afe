"""The interface's flexibility from the last block of the factors against one solve per column."""

import numpy as np
import pytest

from microslip import ModelError
from microslip.model import joint as joint_module
from microslip.model.joint import Reducer


def test_last_block_against_solves(small_reference, monkeypatch):
    structure = small_reference.structure
    reducer = Reducer(structure, 40, (0.0, 1e-6))
    direct = reducer.model(structure.loads)

    def refused(*_):
        raise ModelError("not kept last")

    monkeypatch.setattr(joint_module, "interface_compliance", refused)
    solved = reducer.model(structure.loads)
    soft = slice(direct.equilibrium_modes, None)
    psi = direct.mode_v[:, soft] / direct.omega[soft]
    size = np.abs(direct.residual + psi @ psi.T).max()
    assert direct.residual == pytest.approx(solved.residual, abs=1e-9 * size)
    assert direct.residual == pytest.approx(direct.residual.T)
