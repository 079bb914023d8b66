# SPDX-License-Identifier: MIT
# %% [markdown]
# # Identify a shift
#
# From a log to a driveline model, with what each number is worth. The cells (`# %%`) run as a
# notebook in Jupyter or an editor, or all at once: `python identify_a_shift.py`.

# %%
import drivetwin
from drivetwin.cli import main

# A log with known truth; take your own log and card instead.
main(["synth", "-o", "shift.csv"])

# %% Read the log with the vehicle card, and look at it: the last line of a cell is shown.
card = drivetwin.load_card("shift.card.toml")
log = drivetwin.read_log("shift.csv", card)
print(log.summary())
log.plot()

# %% Find the shift, identify, simulate the model over the measurement.
found = drivetwin.detect_shifts(log, card)
result = drivetwin.identify(log, card, found)
twin = drivetwin.build_twin(result, card)
result = drivetwin.attach_validation(result, twin, log)
print(result.summary())
result.plot()

# %% The same shift, with what is known of the truck: one value exactly, one with its standard
# deviation, one between two bounds.
known = drivetwin.identify(
    log,
    card,
    found,
    fixed={"eta": 0.85},
    priors={"J_out": (0.9, 0.1)},
    bounds={"J_vehicle": (5000.0, 7000.0)},
)
print(known.summary())

# %% Friction over slip with its 95 % band.
twin.plot()

# %% The same as files: for people, for machines, and the model to simulate.
drivetwin.save_report("report.html", result, log)
drivetwin.save_result("result.json", result)
drivetwin.save_twin("twin.toml", twin)

# %% The truth of the synthetic log lies within the interval.
low, high = result.estimates["J_vehicle"].ci95_total or (0.0, 0.0)
print(f"J3 between {low:.0f} and {high:.0f} kg·m²; the log was made with 6056")
assert low < 6056.0 < high
