"""Types of arrays, said once.

`Array` holds real numbers, `Complex` complex ones, `Indices` numbers of pairs, components, nodes or steps,
`Status` contact states (`microslip.contact.pairs`), `Mask` yes or no.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Real numbers."""

Complex: TypeAlias = NDArray[np.complex128]
"""Complex numbers."""

Indices: TypeAlias = NDArray[np.int64]
"""Numbers of pairs, components, nodes, steps."""

Status: TypeAlias = NDArray[np.int8]
"""Contact states, numbered as in `microslip.contact.pairs`."""

Mask: TypeAlias = NDArray[np.bool_]
"""Yes or no for every entry."""
