# SPDX-License-Identifier: MIT
"""Monte-Carlo comparison of the estimators with the Cramér-Rao bound; writes docs/accuracy.md."""
