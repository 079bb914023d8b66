# SPDX-License-Identifier: MIT
"""A stated upshift with independent solutions: problem of the speed comparison and of tests."""
