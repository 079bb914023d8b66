# SPDX-License-Identifier: MIT
"""Vehicle cards: design data of a vehicle. `card` loads a file; `spec` has the data in SI."""
