# SPDX-License-Identifier: MIT
"""Plants from the logs of gearbox controls: commanded pressures, speeds and bus engine torque."""
