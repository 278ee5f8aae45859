"""The text of Shift-Tab in a notebook: every public member has a text and a signature at run time."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

import pytest

import leadlag as ll

MADE_BY_FUNCTIONS = (ll.Findings, ll.Simulation)


def members() -> Iterator[tuple[str, Any]]:
    for name in ll.__all__:
        if name == "__version__":
            continue
        member = getattr(ll, name)
        yield name, member
        if inspect.isclass(member) and not issubclass(member, Exception):
            own = [(key, value) for key, value in vars(member).items() if not key.startswith("_")]
            assert own or member is ll.Model, name
            yield from ((f"{name}.{key}", value) for key, value in own)


@pytest.mark.parametrize("name, member", list(members()))
def test_a_member_explains_itself(name: str, member: Any) -> None:
    text = inspect.getdoc(member)
    assert text and len(text.split()) > 1, f"{name} has no text"
    assert not inspect.isclass(member) or text != inspect.getdoc(member.__mro__[1]), f"{name} has the text of its base"
    if callable(member) and member not in MADE_BY_FUNCTIONS and not (inspect.isclass(member) and issubclass(member, Exception)):
        signature = str(inspect.signature(member))
        assert "Ellipsis" not in signature and "..." not in signature, f"{name}{signature}"


def test_the_text_of_a_drive_names_its_columns() -> None:
    assert all(column in ll.Drive.__doc__ for column in ("time_s", "lead_speed_mps", "speed_mps", "spacing_m"))


def test_every_setting_and_option_is_explained() -> None:
    options = [name for name in ll._drives.Reading.__annotations__ if name != "follower"]
    assert all(f"`{name}`" in ll.read.__doc__ for name in options)
    assert set(ll._native.READING) | {"follower", "name"} == set(ll._drives.Reading.__annotations__)
    assert all(f"``{name}``" in ll.calibrate.__doc__ for name in ll._api.SETTINGS)
