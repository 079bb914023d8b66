# SPDX-License-Identifier: MIT
"""Many logs: a store that resumes, workers that may die, joint estimates over the units."""
