# SPDX-License-Identifier: MIT
"""Direct estimates of single parameters, without a simulation."""
