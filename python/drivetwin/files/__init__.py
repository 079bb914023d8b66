# SPDX-License-Identifier: MIT
"""The files an identification leaves behind: `result.json`, and the records a twin shares."""
