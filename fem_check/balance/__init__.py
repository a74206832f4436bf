"""Check of Newton's and Euler's laws for the whole mechanism by finite differences."""

from fem_check.balance.balance import MomentumBalance, balance
