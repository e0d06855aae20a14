// Orbits that are under way for distances: a packet's lanes are applied together, each with a count of its own.
//
// A packet is applied until its longest orbit ends. Where marches are long, most of that is waiting: a few lanes near the solid take
// many applications, and the others one or two. So a march may leave its packet's last few orbits as they are, and go on with them in
// its next step, when the other lanes have begun theirs (CARRIES). No lane's numbers depend on that.
#include "formulas/orbit.h"

// What an orbit under way knows of its lanes, whichever derivative it carries.
typedef struct {
    real square;               // of the last |z|
    mask count, alive, inside; // applications so far; lanes that go on; lanes within the bailout at the limit
    int look;                  // applications until the limits may be reached, at the earliest
    int waits;                 // lanes whose orbits had ended, in applications of the others, since the first one began
} orbit_lanes;

// Whether marches leave orbits under way (Facts.carries_orbits): not where turns of several formulas are one count for all lanes.
#define CARRIES (!JOINED && CARRIES_ORBITS && LANES >= 8)
#define CARRIED (CARRIES ? LANES / 8 : 0)  // lanes of a march's packet that may be left

// Whether orbits of `n` applications may go on. They end by their limits; with a bound that compilers see they keep the z of a single
// lane once (of duals on AMD's GPUs: 49 registers in the place of 61).
#define IS_WITHIN_LONGEST(n, orbit) (LANES > 1 || (n) <= (orbit)->longest)

INLINE void orbit_lanes_begin(orbit_lanes *o, real square, int first, mask late, mask active, orbit_record orbit) {
    const mask fresh = active & ~late;
    o->square = pick(late, o->square, square);
    o->count = (o->count & late) | (~late & (mask)(first));
    o->alive = (o->alive & late) | (fresh & less_equal(square, (real)(orbit->distance_square)));
    o->inside &= late;
    const int look = max(min(first + ORBIT_LOOK, orbit->iterations) - first, 0);
    o->look = any_lane(late) ? min(o->look, look) : look;
}

INLINE void lanes_applied(orbit_lanes *o, real square, orbit_record orbit) {
    const mask alive = going_on(o->alive);
    o->square = pick(alive, square, o->square);
    o->count -= alive;  // true is -1
    o->alive = alive & less_equal(o->square, (real)(orbit->distance_square));
}

// Looks at the limits, and says when to look again. An orbit that is within the bailout at `iterations` is inside; others go on for a
// little longer.
INLINE void lanes_look(orbit_lanes *o, orbit_record orbit) {
    const mask limit = (mask)(orbit->iterations), longest = (mask)(orbit->longest);
    o->inside |= o->alive & equal_ints(o->count, limit) & in_set(o->square, orbit);
    o->alive &= ~(o->inside | equal_ints(o->count, longest));
    if (orbit_cancelled(orbit)) o->alive &= ~o->alive;
#if LANES == 1
    const int next = o->count < limit ? limit : longest;
    o->look = min(next - o->count, ORBIT_LOOK);
#else
    const mask to_limit = limit - o->count;
    // Where the limit is behind, until the longest one. The least of all is the largest with the other sign.
    const mask left = to_limit + ((to_limit <= 0) & (longest - limit));
    const INTEGER soonest = -lanes_most((o->alive & -left) | (~o->alive & (mask)(-ORBIT_LOOK)));
    o->look = min((int)soonest, ORBIT_LOOK);
#endif
}

// Whether a packet is applied once more. It need not be where at most `carries` lanes are left, and others have ended since `begun` ones
// began.
INLINE int lanes_go_on(orbit_lanes *o, uint begun, int carries, orbit_record orbit) {
    if (o->look-- == 0) {
        lanes_look(o, orbit);
        --o->look;
    }
    if (!carries) return any_lane(o->alive);
    const uint alive = lanes_bits(o->alive);
    const int left = bits_count(alive), goes_on = left > carries || (alive == begun && left != 0);
    if (goes_on) o->waits += bits_count(begun) - left;
    return goes_on;
}
