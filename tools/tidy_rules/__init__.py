# SPDX-License-Identifier: MIT
"""The rules of `tools.tidy`, one file per subject: sizes, layers, texts, layout."""
