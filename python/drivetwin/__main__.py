# SPDX-License-Identifier: MIT
"""`python -m drivetwin`."""

from __future__ import annotations

import sys

from drivetwin.cli import main

sys.exit(main())
