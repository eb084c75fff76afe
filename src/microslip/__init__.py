"""microslip: where a frictional joint slips, what it dissipates, and how it responds."""

__version__ = "0.1.0"
