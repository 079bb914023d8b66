# SPDX-License-Identifier: MIT
"""Fleet runs: a resumable store, fault-tolerant workers, joint estimates over the units."""
