# SPDX-License-Identifier: MIT
"""Output error and maximum likelihood: the simulated driveline against the whole measurement."""
