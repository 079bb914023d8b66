# SPDX-License-Identifier: MIT
# %% [markdown]
# # Compare two logs
#
# Two recordings of one vehicle: do the parameters agree, and does the model of one log explain the
# other?

# %%

import drivetwin
from drivetwin.cli import main
from drivetwin.report.comparison import (
    Candidate,
    build_comparison_page,
    compare_estimates,
    simulate_trials,
)
from drivetwin.report.html import save_page

results, twins, logs = {}, {}, {}
for name, seed in (("monday", "1"), ("tuesday", "2")):
    main(["synth", "-o", f"{name}.csv", "--seed", seed])
    card = drivetwin.load_card(f"{name}.card.toml")
    logs[name] = drivetwin.read_log(f"{name}.csv", card)
    found = drivetwin.detect_shifts(logs[name], card)
    results[name] = drivetwin.identify(logs[name], card, found)
    twins[name] = drivetwin.build_twin(results[name], card)

# %% Every parameter, and by how many standard deviations the two are apart.
candidates = [Candidate.from_twin(name, twin) for name, twin in twins.items()]
for one in compare_estimates([one.estimates for one in candidates]):
    if one.apart is not None:
        print(f"{one.id:12} {one.apart:4.1f} σ  {'agree' if one.agrees else 'differ'}")

# %% The model of Monday on the log of Tuesday: a test on data it was not made from.
shift = drivetwin.detect_shifts(logs["tuesday"], card).shifts[0]
crossed = drivetwin.simulate_shift(twins["monday"], logs["tuesday"], shift)
print(crossed.summary())
crossed.plot()

# %% All of it on one page.
trials = simulate_trials(twins, logs["tuesday"], [shift], "tuesday")
save_page("comparison.html", build_comparison_page(candidates, trials))
assert crossed.fit["output_torque"]["all"].fit_percent > 85.0
