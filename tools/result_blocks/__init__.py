# SPDX-License-Identifier: MIT
"""Generated sections of pages, from the raw results of one benchmark each."""
