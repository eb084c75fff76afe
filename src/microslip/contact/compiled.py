"""How kernels are compiled: once, kept on disk, free of the interpreter's lock.

`jit` may contract and reorder sums and assumes neither the sign of zero nor exact division, but it
keeps infinities and nan, which the kernels test for. `strict_jit` computes in the written order.
"""

from __future__ import annotations

import numba as nb

FASTMATH = {"contract", "reassoc", "arcp", "nsz"}
"""What `jit` assumes of numbers."""

jit = nb.njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")

strict_jit = nb.njit(cache=True, error_model="numpy")

inlined_jit = nb.njit(nogil=True, fastmath=FASTMATH, error_model="numpy", inline="always")
"""For what one kernel alone calls: a part of its text, and no code of its own.

Every compiled function contains all that it calls, so that each level between a loop and its innermost
function is compiled with all of that once more.
"""
