# SPDX-License-Identifier: MIT
"""Files of an identification: `result.json`, and the records shared with the twin file."""
