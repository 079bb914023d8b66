# SPDX-License-Identifier: MIT
"""New vehicle cards: questions, answers, values estimated from a log, and the text of the file."""
