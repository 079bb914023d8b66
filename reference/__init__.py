# SPDX-License-Identifier: MIT
"""Reference problems: each folder states one, `README.md` beside this file says how."""
