// The samples of one run, as recorded.
import { TONES, drawLoops } from "./drawings.js";

const place = document.getElementById("curve"), curve = JSON.parse(place.dataset.curve);
if (curve.t.length) drawLoops(place, [{ s: curve.s, f: curve.f, tone: TONES[0] }]);
else place.textContent = "No curve is drawn of this run: it has none, or is too long.";
