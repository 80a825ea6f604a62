"""Numbers that were read from files."""

from ..statistics.numbers import is_number


def test_numbers_that_are_none():
    assert not any(map(is_number, (10**400, float("nan"), float("inf"), True, "1", None, [])))
    assert is_number(10**300)
