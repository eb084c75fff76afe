"""Errors a caller can name. Every message says where it went wrong and what to try."""


class MicroslipError(Exception):
    """Base of all errors that microslip raises on purpose."""


class InputError(MicroslipError):
    """Something the user wrote cannot be used: which file, key and value, and what is allowed."""


class ContactError(MicroslipError):
    """A contact problem has no solution that the solver could prove."""


class JointOpensError(ContactError):
    """The load is larger than the clamped joint can carry in static equilibrium."""


class ModelError(MicroslipError):
    """Matrices or a mesh that cannot make a joint model."""
