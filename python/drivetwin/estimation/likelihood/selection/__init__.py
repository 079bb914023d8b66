# SPDX-License-Identifier: MIT
"""Selection among model variants by the likelihood."""
