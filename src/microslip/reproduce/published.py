"""Every number the paper states about its results, and where.

Doi 10.1007/s10999-021-09580-8. Numbers in units that the paper never gives (its q, M_0/L and
energies) are here as ratios, over the q = 0.12 of its figure 7 or the other of two energies.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """A number of the paper: its value and unit ("" for ratios), what it is, where it is."""

    value: float
    unit: str
    what: str
    where: str


Q_OF_FIGURE_7 = 0.12
"""Modal amplitude of the paper's figure 7, in its unit."""

PAPER: dict[str, Published] = {
    "damping_ratio": Published(3.9e-4, "", "material damping ratio at 170 Hz", "2.1"),
    "friction_limit": Published(0.25, "", "largest friction force over P", "2.1"),
    "mesh_error": Published(0.00106, "", "change of ΔE from n = 150 to 200", "2.1"),
    "mesh_converged": Published(150, "", "n beyond which ΔE changes by less than 1 %", "2.1"),
    "prestress_extent": Published(1.18, "L_p", "half-length of the prestressed contact", "3"),
    "receding_end": Published(1.12, "L_p", "contact at peak moment, receding end", "3"),
    "growing_end": Published(1.29, "L_p", "contact at peak moment, growing end", "3"),
    "static_cycles": Published(2, "", "quasi-static cycle that is steady", "3"),
    "steps_converged": Published(120, "", "time steps per cycle that suffice", "3, figure 6"),
    "cycles_to_steady": Published(180, "", "cycles until ΔE changes by less than 1 %", "3"),
    "loop_area_ratio": Published(1.0, "", "ΔE static over dynamic at equal q, 174 Hz", "figure 8"),
    "energy_peak_hz": Published(175.0, "Hz", "frequency of the greatest ΔE", "3.1, figure 9"),
    "energy_error": Published(0.036, "", "largest error of ΔE, static against dynamic", "3.1"),
    "stored_error": Published(0.039, "", "same of the mean stored energy", "3.1"),
    "energy_error_hz": Published(177.0, "Hz", "where both errors are largest", "3.1"),
    "gamma_peak_low": Published(
        0.05 / Q_OF_FIGURE_7, "", "q of greatest γ_eq over q at 174 Hz, lower bound", "3.1"
    ),
    "gamma_peak_high": Published(
        0.10 / Q_OF_FIGURE_7, "", "q of greatest γ_eq over q at 174 Hz, upper bound", "3.1"
    ),
    "sliding_frequency": Published(174.6, "Hz", "resonance without friction", "3.2"),
    "resonance_rho_0_8": Published(174.9, "Hz", "resonance at ρ = 0.8", "3.2"),
    "resonance_shift": Published(0.3, "Hz", "its shift from ρ = 0 to 0.8", "3.2"),
    "amplitude_drop": Published(0.90, "", "drop of the peak from ρ = 0 to 0.8", "3.2"),
    "rom_error_peak": Published(0.008, "", "error of the reduced model near resonance", "3.2"),
    "rom_error_worst": Published(0.11, "", "largest error of the reduced model", "3.2"),
    "rom_error_worst_hz": Published(177.0, "Hz", "where it is", "3.2"),
    "rom_gamma_error": Published(0.01, "", "error of γ_eq in the reduced model, 175 Hz", "3.2"),
    "rom_k_error": Published(0.0025, "", "error of k_eq in the reduced model, 175 Hz", "3.2"),
    "best_rho": Published(2.4, "", "ρ of greatest damping", "3.2, figure 13"),
    "aligned_rho": Published(2.4, "", "ρ where greatest γ_eq meets the resonance", "figure 14"),
    "k_saturation": Published(0.09, "", "k_eq at large ρ", "figure 14"),
    "gamma_peak": Published(
        0.05 / Q_OF_FIGURE_7, "", "q of greatest γ_eq over q at 174 Hz", "appendix B"
    ),
    "slope": Published(1.0, "", "bound on |g'| at every solution", "appendix B"),
    "solutions": Published(1, "", "solutions at each frequency", "appendix B"),
}
"""By key; `reproduction.json` holds every one of them once all figures are done."""

PAPER_SECONDS: dict[str, tuple[float, str]] = {
    "time_domain_one_frequency": (83640.0, "steady state at one frequency, marched in time"),
    "quasi_static": (600.0, "all quasi-static cycles"),
    "sweep": (15.0, "reduced model over all frequencies"),
}
"""Wall times of section 3.2 (23 h 14 min, 10 min, 15 s) and what took them."""
