// What is found out about orbits, whichever formula they are of. With JOINED, of the generated text, several solids are asked as one
// (solids.h); else a formula by itself, of which nothing is known that is told of the nearest of several.
#include "formulas/numbers/quick.h"

// Does something for each number of a state.
#if STATE_SIZE == 4
#define STATE_EACH(DO) DO(s0) DO(s1) DO(s2) DO(s3)
#else
#define STATE_EACH(DO) DO(s0) DO(s1) DO(s2)
#endif

// How an orbit ended.
typedef struct {
    real count;   // applications until |z| left the radius that counts, or all
    mask inside;  // it has not
} orbit_end;

// How an orbit of whole counts ended. Masks are whole numbers: a real could not count beyond 2^24 in float32.
typedef struct {
    mask count;   // applications until |z| left the bailout, or all
    mask inside;  // it has not
} orbit_counted;

// How far a point is from the solid.
typedef struct {
    real step;  // distance that is safe to go, in scene units; 0 inside
    orbit_end end;
    real near;  // how near the surface may be: the same, or more where only the ball around a formula is known
    // Of several solids:
    real scale; // the step scale of the nearest one
    real most;  // where a formula was cut out the distance is not known: it is `step` at least, and this at most
} clearance;

// Where a distance is not known.
INLINE mask is_blind(clearance here) { return JOINED ? less(here.step, here.most) : less(R(1.0), R(0.0)); }

// What the orbit of a point on a surface tells.
typedef struct {
    real square;         // the last |z|^2 ...
    real square_before;  // ... and the one before it
    // Of several solids:
    real count;          // the count of the nearest one ...
    real of;             // ... its number ...
    real solid;          // ... and that of what the surface belongs to: the same, or what has cut it
} orbit_result;

// What is known of a point on the surface, from one orbit over dual numbers.
typedef struct {
    vec gradient;        // of the distance or the surface, not normalised: points away from the solid
    orbit_result own;
    // Of several solids, where two of them flow together: the other one's part of the colour, and what is known of that one.
    real share;
    orbit_result other;
} surface_point;
#define SURFACE_ALONE (3 + NUMBERS_OF(orbit_result))  // numbers of it where nothing flows

// Whose gradient is asked for: the distance's, of the last z; or that of the surface which is shown.
#define OF_DISTANCE 0
#define OF_SURFACE 1

// Whether the work was cancelled. Long orbits test this now and then, or a launch could take arbitrarily long. The host writes
// the record while kernels run; they see it if both share their memory. The results of a cancelled launch are discarded.
#define ORBIT_LOOK 4096
INLINE int orbit_cancelled(orbit_record orbit) { return *(volatile __constant const int *)&orbit->cancelled; }
