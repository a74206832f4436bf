"""Newton's and Euler's laws for the whole mechanism, by differences in time of where its masses are."""

from fem_check.balance.balance import Balance, balance

__all__ = ["Balance", "balance"]
