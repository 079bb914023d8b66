# SPDX-License-Identifier: MIT
"""Vehicle cards: what is known from design. `card` loads one; `spec` is what it becomes, in SI."""
