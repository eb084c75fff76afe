"""What planar and spatial pairs both have, under one name for the kernels that serve either.

A step of time, a load path and the deviations of a motion are the same whatever the number of tangential
directions; how a contact problem is solved is not. Compiled functions that take the memory of a solver call
the names below; which solver they mean is decided when they are compiled, by the type of the memory.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

from numba import types
from numba.extending import lower_builtin, type_callable

from microslip.contact import (
    active_set,
    linearised,
    planar,
    spatial,
    spatial_linearised,
    spatial_tableau,
    tableau,
)


def _by_memory(place: int, flat: Any, round_cone: Any) -> Any:
    """A name that means one function or the other, by the type of the memory among its arguments."""

    def either(*arguments: Any) -> Any:
        spatially = isinstance(arguments[place], spatial_tableau.Memory)
        return (round_cone if spatially else flat)(*arguments)

    def meant(given: tuple[Any, ...]) -> Any:
        spatially = given[place].instance_class is spatial_tableau.Memory
        return types.Dispatcher(round_cone if spatially else flat)

    @type_callable(either)
    def typing(context: Any) -> Callable[..., Any]:
        def returned(*given: Any) -> Any:
            return meant(given).get_call_type(context, given, {})

        # one name an argument, or numba passes all of them as one tuple
        returned.pysig = signature(flat.py_func)  # type: ignore[attr-defined]
        return returned

    @lower_builtin(either, types.VarArg(types.Any))
    def call(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return context.get_function(meant(sig.args), sig)(builder, arguments)

    return either


dimension_of = _by_memory(0, tableau.dimension_of, spatial_tableau.dimension_of)
"""``dimension_of(memory)``: components per pair, a constant to the compiler."""

follow_modes = _by_memory(0, tableau.follow_modes, spatial_tableau.follow_modes)
"""``follow_modes(memory, now, before)``: tell of how much of each mode the next problem differs."""

signs = _by_memory(0, tableau.signs, spatial_tableau.signs)
"""``signs(memory)``: of the pairs, where the tableau has any."""

restart = _by_memory(1, tableau.restart, spatial_tableau.restart)
"""``restart(problem, memory, status)``: make the tableau afresh."""

follow = _by_memory(1, tableau.follow, spatial_tableau.follow)
"""``follow(problem, memory, status)``: make the memory fit for other states than it was left with."""

search = _by_memory(1, active_set.search, spatial.search)
"""``search(problem, memory, given, contact)``: solve from the last solution, without a guarantee."""

other_ways = _by_memory(1, planar.last_resort, spatial.other_starts)
"""``other_ways(problem, memory, given, contact)``: solve where that fails."""

solve = _by_memory(1, planar.solve, spatial.solve)
"""``solve(problem, memory, given, contact)``: one after the other."""

solve_states = _by_memory(1, linearised.solve_states, spatial_linearised.solve_states)
"""``solve_states(problem, memory, status, w, weights, x, r)``: changes of a solution with its states."""

with_states = _by_memory(1, linearised.with_states, spatial_linearised.with_states)
"""``with_states(problem, memory, status, x, r)``: the same from unknowns of the tableau's states."""

recall = _by_memory(1, linearised.recall, spatial_linearised.recall)
"""``recall(problem, memory, status, r, slip)``: make the memory fit for a solution of before."""

gaps = _by_memory(1, linearised.gaps, spatial_linearised.gaps)
"""``gaps(problem, memory, status, opened, w, weights, x)``: those of a few separated pairs alone."""
