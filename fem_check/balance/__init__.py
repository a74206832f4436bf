"""Check of the balance of momentum and angular momentum of the whole mechanism by finite differences."""

from fem_check.balance.balance import MomentumBalance, balance
