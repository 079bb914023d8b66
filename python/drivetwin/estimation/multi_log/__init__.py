# SPDX-License-Identifier: MIT
"""Several logs of one vehicle in one likelihood, and what they predict of one held out."""
