# SPDX-License-Identifier: MIT
# %% [markdown]
# # Fit a driveline
#
# The torque of an electric drive changes its sign, and the drive passes through its play. A log of
# the manoeuvre is enough to identify inertias, shaft and play.

# %%
import json
from pathlib import Path

import plotly.graph_objects as go

from drivetwin.cli import main
from drivetwin.fit.fit import fit_network, predict
from drivetwin.fit.model_file import read_model
from drivetwin.fit.read import read_recording
from drivetwin.report.fit import build_fit_page
from drivetwin.report.html import save_page

for seed, name in enumerate(("tip_in", "other")):
    main(["synth", "--model", "tip_in", "--seed", str(seed), "-o", f"{name}.csv"])
model, channels = read_model("tip_in.model.toml")
recording, findings = read_recording(Path("tip_in.csv"), model, channels)
found = fit_network(model, [recording])

# %% Estimates beside the truth.
truth = json.loads(Path("tip_in.truth.json").read_text(encoding="utf-8"))["truth"]
for one in found.estimates.values():
    print(f"{one.id:16} {one.value:10.4g} {one.verdict:12} truth {truth[one.id]:g}")
assert found.status == "valid"

# %% Motor speed, measured and simulated.
(run,) = found.simulate()
measured = recording.outputs["motor speed"]
figure = go.Figure(layout={"xaxis": {"title": "time [s]"}, "yaxis": {"title": "speed [rad/s]"}})
figure.add_scatter(x=measured.time, y=measured.values, name="measured")
figure.add_scatter(x=run.time, y=run.columns["speed", "motor"], name="simulated")
figure

# %% A recording that took no part in the fit.
other, _ = read_recording(Path("other.csv"), model, channels)
(held_out,) = predict(found, [other])
for name, fit in held_out.agreement.items():
    print(f"{name:12} {fit.fit_percent:.1f} %")
page = build_fit_page(found, ["tip_in.csv"], {"other.csv": held_out}, findings)
save_page("report.html", page)
