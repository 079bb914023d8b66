# SPDX-License-Identifier: MIT
"""Values of an identification: estimates, verdicts, multi-log and validation records."""
