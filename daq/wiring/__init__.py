"""Does the stand measure what it moves? Signals held against each other, against the command and the plan.

Every guard elsewhere believes its signal. Here signals are doubted: sign, scale, zero and delay of force,
draw wires and piston are seen in the first slow motion, before any great force; later a wire that slips, a
force that leaves its specimen's curve, a thermometer that does not show the heat. Each judge is a file of
its own; what it holds against what, and by how much that may differ, is stated there.
"""

from bufferstand.daq.wiring.doubt import SignalDoubt, doubt_trip
from bufferstand.daq.wiring.facts import Compared, ForceCurve, WiringGuard
from bufferstand.daq.wiring.watch import WiringWatch

__all__ = ["Compared", "ForceCurve", "SignalDoubt", "WiringGuard", "WiringWatch", "doubt_trip"]
