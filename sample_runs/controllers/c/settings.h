/* What this machine is: change these numbers to yours, then hal.c, and nothing else to begin with.
 *
 * Units as everywhere: kN, mm, s; compression is positive.
 */
#ifndef SETTINGS_H
#define SETTINGS_H

#define RATE_HZ 1000.0 /* cycles, and so samples, a second */
#define RING_SAMPLES 65536 /* kept for a reader that is late: a minute */

/* What the machine can. Orders beyond are refused, and limits beyond cannot be set. */
#define RATED_FORCE_KN 630.0
#define RATED_STROKE_MM 250.0
#define RATED_SPEED_MM_PER_S 800.0
#define RATED_FREQUENCY_HZ 2.55
#define RETRACTED_MM (-50.0) /* how far the piston may be sent clear of the specimen */

/* Beyond a limit that was set it gives up: so far beyond, since a motion may turn at the limit itself. */
#define TRIP_RATIO 1.02
#define TRIP_KN 1.0
#define TRIP_MM 1.0

#define SETTLED_MM 0.05 /* nearer than this to its command the piston has arrived */
#define NO_FORCE_KN 0.2 /* less than this is no force */
#define AT_MEAN_MM 0.5 /* a sine starts this near to its mean, static cycles start within 1 mm of zero */
#define AT_ZERO_MM 1.0
#define RELEASE_BEYOND_MM 15.0 /* a release goes so far behind zero to lose the force */
#define RELEASE_SLOWLY_MM_PER_S 1.0 /* … at this speed */
#define FALL_BACK_MM_PER_S 20.0 /* a release of its own, after a fault */
#define WRITER_FORGOTTEN_S 10.0

/* Counts of the samples. The stand file's calibrations say the same: [0.0, 1e-4], [-40.0, 0.005], [0.0, 0.01]. */
#define FORCE_KN_PER_COUNT 1e-4
#define STROKE_MM_PER_COUNT 0.005
#define STROKE_MM_AT_0 (-40.0)
#define POSITION_MM_PER_COUNT 0.01

#endif
