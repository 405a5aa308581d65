"""From recordings to a verdict in Python: `python docs/first_steps.py [CAMPAIGN.yaml] [FOLDER for pictures]`."""

import sys
from pathlib import Path

import linid

stand = Path(__file__).resolve().parents[1] / "data" / "stand" / "campaign.yaml"
campaign = linid.read(sys.argv[1] if len(sys.argv) > 1 else stand)  # SI units, pushes cut
folder = Path(sys.argv[2] if len(sys.argv) > 2 else ".")
print(campaign.to_frame())

friction = linid.fit(campaign, "friction", jobs=2)
motor = linid.fit(campaign, "sine", start=friction, jobs=2)
print(motor.summary())
print("moving mass in kg, 95 %:", motor["mass"].interval)

gaps = linid.validate(motor, campaign.held_out, jobs=2)
print(gaps.summary())
linid.plot.friction_curve(motor).figure.savefig(folder / "friction_curve.png")
linid.plot.free_run(gaps.traces[0]).figure.savefig(folder / "free_run.png")

found = linid.diagnose(campaign, "sine", jobs=2)
print(found.verdict.sentence)
found.report(folder / "diagnosis.html")
