// The rows of the last moments as they come, and those of the last half minute thinned out. Of a message that
// brings more (a page that was asleep, or opens) only these are taken: an array keeps the room that it once took.
export const FINE_S = 3, WINDOW_S = 30, THIN = 5;
const empty = () => ({ t: [], s: [], f: [] });
export const fine = empty(), coarse = empty();
let count = 0, last = null;

export function take(packets) {
  const end = packets[packets.length - 1], newest = (end.t0_us + 100 * end.t[end.t.length - 1]) / 1e6;
  trim(fine, newest - FINE_S);
  trim(coarse, newest - WINDOW_S);
  for (const p of packets) {
    const t0 = p.t0_us / 1e6;
    if (last !== null && (t0 < last || t0 - last > 60)) clear();
    else if (last !== null && t0 - last > 1) for (const one of [fine, coarse]) push(one, t0 - 1e-4, null, null);
    for (let i = 0; i < p.t.length; i++) {
      const t = t0 + p.t[i] / 1e4;
      last = t;
      if (t >= newest - FINE_S) push(fine, t, p.s[i] / 1000, p.f[i] / 1000);
      if (count++ % THIN === 0 && t >= newest - WINDOW_S) push(coarse, t, p.s[i] / 1000, p.f[i] / 1000);
    }
  }
}
function push(buffer, t, s, f) { buffer.t.push(t); buffer.s.push(s); buffer.f.push(f); }
function trim(buffer, from) {
  let n = 0;
  while (n < buffer.t.length && buffer.t[n] < from) n++;
  if (n > 200 || n === buffer.t.length) for (const key of ["t", "s", "f"]) buffer[key].splice(0, n);
}
export function clear() {
  for (const one of [fine, coarse]) Object.assign(one, empty());
  last = null;
}
