"""Which role an account has on a robot: what was granted for this very robot, else the default of its kind.

Pure, and the only place that decides it. There is no role "nobody": an account that must not see a robot belongs into
another organization, or is disabled.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """Roles: what an account may do with a robot, from the least to the most."""

    OBSERVER = "observer"
    OPERATOR = "operator"
    SUPERVISOR = "supervisor"

    @property
    def rank(self) -> int:
        return list(Role).index(self)


@dataclass(frozen=True, slots=True)
class Standing:
    """Everything that decides an account's role on one robot."""

    is_active: bool
    is_program: bool
    is_organization_admin: bool
    is_same_organization: bool
    default_role: Role
    """Of plain accounts of the organization."""
    granted: Role | None = None

    @property
    def role(self) -> Role | None:
        """``None``: it may not connect at all, because it is disabled or belongs to another organization."""
        if not self.is_active or not self.is_same_organization:
            return None
        return self.role_if_active

    @property
    def role_if_active(self) -> Role:
        """The role it has, or would have again once enabled."""
        if self.granted is not None:
            return self.granted
        return Role.SUPERVISOR if self.is_organization_admin else self.default_role

    @property
    def supervises(self) -> bool:
        """A person who can take over by force; a program is no substitute for one."""
        return self.role is Role.SUPERVISOR and not self.is_program


def loses_last_supervisor(before: Iterable[Standing], after: Iterable[Standing]) -> bool:
    """Whether a change takes away the last person who supervises. A robot that has none can't lose one."""
    return any(one.supervises for one in before) and not any(one.supervises for one in after)
