"""Numbers behind the corrections: the reference joint with 201 contact pairs. Half a minute."""

import numpy as np
from microslip.analyses.statics.linear_states import linear_states

from microslip.analyses.reduced.table import equivalent_table
from microslip.analyses.statics.cycle import opening_load, prestress, quasi_static_cycle
from microslip.model.elasticity import Material
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import Reducer
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import LapGeometry, MeshControl

CLAMP, FRICTION, LENGTH, STEPS = 1e6, 0.25, 0.2515, 300
LOADS = (1e-6, 1e-4, 7e-4, 2e-3, 4e-3)


def main() -> None:
    structure = lap_joint_structure(
        LapGeometry(LENGTH, 0.0125, 0.0375, 0.025),
        Material(70e9, 0.3, 2000.0),
        MeshControl(contact_pairs=201),
        horizontal_spring=1e5,
    )
    reducer = Reducer(structure, 60, (0.0, 7.3e-7))
    model = reducer.model(structure.loads)
    start = prestress(model, static_flexibility(model), CLAMP)
    states = linear_states(structure, np.flatnonzero(start.touching), "moment")
    model = reducer.with_ports(model, states.ports(structure))
    flexibility = static_flexibility(model)
    start = prestress(model, flexibility, CLAMP)

    c = states.overlap
    print(f"last touching pair          {model.position[start.touching].max() / 0.025:.4f} L_p")
    frequencies = f"{states.sliding_frequency:.2f}, {states.stuck_frequency:.2f} Hz"
    print(f"sliding, stuck frequency    {frequencies}")
    print(f"(stuck/sliding)^2 - 1       {(states.stuck_omega / states.sliding_omega) ** 2 - 1:.4f}")
    print(f"Phi_sl^T M Phi_st           {c:.5f}, condition of m {(1 + c) / (1 - c):.0f}")
    limit = opening_load(model, flexibility, start, "moment") / (CLAMP * LENGTH)
    print(f"opening load M/(P L)        {limit:.5f}, L_o/L {0.0375 / LENGTH:.5f}")

    print(
        "\nM/(P L)  drive   k_eq    gamma_eq  dissipated/(q W_c)  dissipated/work of load  residual"
    )
    for ratio in LOADS:
        for drive, port in (("moment", "moment"), ("mode", "sliding")):
            unit = 1.0 if drive == "moment" else states.load_on_sliding["moment"]
            amplitude = ratio * CLAMP * LENGTH * unit
            cycle = quasi_static_cycle(
                model, flexibility, start, port, amplitude, FRICTION, steps=STEPS
            )
            table = equivalent_table([cycle], model, states, CLAMP, drive)
            k, g, q = table.k_eq[0], table.gamma_eq[0], table.amplitude[0]
            work = np.pi * g * table.omega**2 * q**2
            slips = cycle.dissipated > 1e-12
            print(
                f"{ratio:7.0e}  {drive:6s}  {k:.4f}  {g:8.5f}  "
                + (f"{cycle.dissipated / work:18.4f}" if slips else " " * 17 + "-")
                + (f"{cycle.dissipated / cycle.external_work:25.6f}" if slips else " " * 24 + "-")
                + f"  {cycle.residual.max():.0e}"
            )
            if ratio == 7e-4 and drive == "moment":
                touching = model.position[cycle.status[STEPS // 4] != 4] / 0.025
                zone = f"{touching.min():.3f} to {touching.max():.3f} L_p"
    print(f"\ncontact at the greatest positive moment, M/(P L) = 7e-4: {zone}")


if __name__ == "__main__":
    main()
