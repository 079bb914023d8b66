# SPDX-License-Identifier: MIT
"""What the report says, in reading order; each module turns results into blocks of one kind."""
