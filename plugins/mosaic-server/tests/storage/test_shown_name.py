"""What an account is called among its operators: nobody passes for another by choosing that one's name."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from sqlalchemy import create_engine
from sqlalchemy.orm import Session

from mosaic_server.storage.accounts import Membership, add_account, shown_name
from mosaic_server.storage.tables import Base

Add = Callable[..., str]


@pytest.fixture
def session() -> Iterator[Session]:
    engine = create_engine("sqlite://")
    Base.metadata.create_all(engine)
    with Session(engine) as opened:
        yield opened
    engine.dispose()


@pytest.fixture
def add(session: Session) -> Add:
    """Adds an account to one organization, the first one's."""
    organizations: list[str] = []

    def added(name: str, email: str, *, elsewhere: bool = False) -> str:
        membership = Membership(organizations[0]) if organizations and not elsewhere else None
        person = add_account(session, email, "a long enough password", name, membership=membership)
        session.flush()
        organizations.append(person.organization_id)
        return person.id

    return added


def test_a_name_of_ones_own_stands_alone(session: Session, add: Add) -> None:
    ann, bob = add("Ann", "ann@example.org"), add("", "bob@example.org")
    assert [shown_name(session, one) for one in (ann, bob)] == ["Ann", "bob@example.org"]


@pytest.mark.parametrize(
    "taken",
    [
        "Ann",
        "ANN",
        " ann ",
        "A nn",
        "\uff21nn",
        "\u0410nn",
        "\u00c1nn",
        "An\u200bn",
        "An\u3164n",
        "A\u2800nn",
        "ann@example.org",
        "Ann (ann@example.org)",
    ],
)
def test_a_name_that_looks_like_anothers_is_shown_with_its_own_address(session: Session, add: Add, taken: str) -> None:
    add("Ann", "ann@example.org")
    mallory = add(taken, "mallory@example.org")
    assert shown_name(session, mallory) == f"{taken} (mallory@example.org)"


def test_both_who_share_a_name_are_told_apart(session: Session, add: Add) -> None:
    both = [add("Ann", "ann@example.org"), add("Ann", "second@example.org")]
    assert [shown_name(session, one) for one in both] == ["Ann (ann@example.org)", "Ann (second@example.org)"]


def test_accounts_of_other_organizations_are_nobodys_concern(session: Session, add: Add) -> None:
    ann = add("Ann", "ann@example.org")
    add("Ann", "ann@elsewhere.org", elsewhere=True)
    assert shown_name(session, ann) == "Ann"


def test_an_account_that_is_gone_has_no_name(session: Session) -> None:
    assert shown_name(session, "nobody") == ""
