"""Numbers behind the corrections: the reference joint with 201 contact pairs. Half a minute."""

import numpy as np

from microslip import reference_joint
from microslip.analyses.reduced.table import equivalent_table
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.pairs import touches
from microslip.pipeline.prepare import assemble

STEPS = 300
LOADS = (1e-6, 1e-4, 7e-4, 2e-3, 4e-3)


def main() -> None:
    description = reference_joint()
    half_length, beams = description.clamp.half_length, description.beams
    a = assemble(description)
    joint, mode = a.prepared, a.mode
    x = joint.model.position / half_length

    c = mode.overlap
    print(f"last touching pair          {x[joint.prestress.touching].max():.4f} L_p")
    frequencies = f"{mode.sliding_frequency:.2f}, {mode.stuck_frequency:.2f} Hz"
    print(f"sliding, stuck frequency    {frequencies}")
    print(f"(stuck/sliding)^2 - 1       {mode.stiffening:.4f}")
    print(f"Phi_sl^T M Phi_st           {c:.5f}, condition of m {(1 + c) / (1 - c):.0f}")
    limit = a.opening_moment / a.moment_unit
    overlap = beams.overlap_half_length / beams.length
    print(f"opening load M/(P L)        {limit:.5f}, L_o/L {overlap:.5f}")

    print(
        "\nM/(P L)  drive   k_eq    gamma_eq  dissipated/(q W_c)  dissipated/work of load  residual"
    )
    for ratio in LOADS:
        for drive, port in (("moment", joint.drive), ("mode", mode.port)):
            unit = 1.0 if drive == "moment" else mode.load_on_sliding[joint.drive]
            amplitude = ratio * a.moment_unit * unit
            cycle = quasi_static_cycle(joint, port, amplitude, steps=STEPS)
            table = equivalent_table([cycle], joint, drive)
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
                touching = x[touches(cycle.status[STEPS // 4])]
                zone = f"{touching.min():.3f} to {touching.max():.3f} L_p"
    print(f"\ncontact at the greatest positive moment, M/(P L) = 7e-4: {zone}")


if __name__ == "__main__":
    main()
