# SPDX-License-Identifier: MIT
"""Effects that the model leaves out: their columns, the joint step, evidence, withdrawal."""
