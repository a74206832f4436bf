"""Check of a solution by the momentum and angular momentum of the whole mechanism, with finite differences in time."""

from fem_check.balance.balance import MomentumBalance, balance
