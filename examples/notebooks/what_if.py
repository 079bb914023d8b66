# SPDX-License-Identifier: MIT
# %% [markdown]
# # What if?
#
# A twin is a model to ask: what does the shift feel like with a softer shaft, or with worn
# linings? Here the identified shift is repeated with one parameter changed at a time.

# %%
import numpy as np
import plotly.graph_objects as go

import drivetwin
from drivetwin.cli import main

main(["synth", "-o", "shift.csv"])
card = drivetwin.load_card("shift.card.toml")
log = drivetwin.read_log("shift.csv", card)
found = drivetwin.detect_shifts(log, card)
result = drivetwin.identify(log, card, found)
twin = drivetwin.build_twin(result, card)
shift = found.shifts[0]
twin

# %% The same measured engine torque and pressures, other drivelines.
stiffness = twin.get_value("k_o", default=0.0)
variants = {
    "as identified": {},
    "shaft half as stiff": {"k_o": 0.5 * stiffness},
    "fill ends 0.2 bar later": {"P0.B3": twin.get_value("P0.B3", default=8e4) + 2e4},
}
runs = {
    name: drivetwin.simulate_shift(
        twin, log, shift, twin.build_dual_clutch(shift, overrides=changed)
    )
    for name, changed in variants.items()
}

# %% Output torque of each.
figure = go.Figure(
    layout={"xaxis": {"title": "time [s]"}, "yaxis": {"title": "output torque [Nm]"}}
)
for name, run in runs.items():
    figure.add_scatter(x=run.trajectory.time, y=run.trajectory.shaft_torque, name=name)
figure

# %% Peak of the lock-up oscillation, the figure that a driver feels.
peaks = {name: float(np.max(run.trajectory.shaft_torque)) for name, run in runs.items()}
for name, peak in peaks.items():
    print(f"{name:24} {peak:6.0f} Nm")
assert runs["shaft half as stiff"].status == "completed"
assert peaks["as identified"] != peaks["shaft half as stiff"]
