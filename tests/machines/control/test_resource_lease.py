"""Whose commands one lease lets act: every kind of sender meets every state of the lease."""

from __future__ import annotations

import pytest

from mosaic_core.machines.control.lease_events import Party, Waiting
from mosaic_core.machines.control.resource_lease import ResourceLease

EXPIRY_S, BEGAN_S, EPOCH = 2.0, 100.0, 7
ANN = Party("ann", "ann", "Ann", "operator", is_person=True)
BOB = Party("bob", "bob", "Bob", "operator", is_person=True)
OLD = Party("old", "old", "Old", "operator", is_person=True, is_original=True)


def lease(holder: Party | None = ANN) -> ResourceLease:
    return ResourceLease("motion", EXPIRY_S, holder, EPOCH, BEGAN_S)


def test_nobody_holds_a_new_lease_and_it_never_ends() -> None:
    free = ResourceLease("motion", EXPIRY_S)
    assert free.ends_at_s is None
    assert not free.has_expired(1e9)
    assert not free.is_held_by("")


def test_a_lease_ends_one_expiry_after_its_holders_last_sign_of_life() -> None:
    held = lease()
    assert held.ends_at_s == BEGAN_S + EXPIRY_S
    assert not held.has_expired(BEGAN_S + EXPIRY_S - 1e-6)
    assert held.has_expired(BEGAN_S + EXPIRY_S)
    held.keep(BEGAN_S + 1.0)
    assert held.ends_at_s == BEGAN_S + 1.0 + EXPIRY_S


def test_a_clock_that_goes_back_takes_no_time_from_the_holder() -> None:
    held = lease()
    held.keep(BEGAN_S - 50.0)
    assert held.ends_at_s == BEGAN_S + EXPIRY_S


@pytest.mark.parametrize(
    ("holder", "party", "epoch", "is_over", "code"),
    [
        (ANN, ANN, EPOCH, False, None),
        (ANN, ANN, EPOCH - 1, False, "lease.old_epoch"),
        (ANN, ANN, EPOCH + 1, False, "lease.old_epoch"),
        (ANN, ANN, 0, False, "lease.required"),
        (ANN, ANN, None, False, "lease.required"),
        (ANN, ANN, EPOCH, True, "lease.expired"),
        (ANN, ANN, None, True, "lease.expired"),
        (ANN, BOB, EPOCH, False, "lease.not_holder"),
        (ANN, BOB, None, False, "lease.not_holder"),
        (ANN, BOB, EPOCH, True, "lease.old_epoch"),
        (ANN, BOB, None, True, "lease.required"),
        (None, BOB, EPOCH, False, "lease.old_epoch"),
        (None, BOB, None, False, "lease.required"),
        (OLD, OLD, None, False, None),
        (OLD, OLD, None, True, "lease.expired"),
        (ANN, OLD, None, False, "lease.not_holder"),
        (ANN, OLD, None, True, None),
        (None, OLD, None, False, None),
        (OLD, ANN, EPOCH, False, "lease.not_holder"),
    ],
)
def test_a_command_acts_or_says_what_its_sender_lacks(
    holder: Party | None, party: Party, epoch: int | None, is_over: bool, code: str | None
) -> None:
    now_s = BEGAN_S + EXPIRY_S if is_over else BEGAN_S
    assert lease(holder).refusal(party, epoch, now_s) == code


@pytest.mark.parametrize(("holder", "code"), [(None, "lease.required"), (OLD, None)])
def test_an_original_page_takes_a_free_lease_by_its_command_unless_somebody_waits_for_it(
    holder: Party | None, code: str | None
) -> None:
    wanted = lease(holder)
    wanted.queue.add(Waiting(BOB, "", BEGAN_S))
    assert wanted.refusal(OLD, None, BEGAN_S) == code
