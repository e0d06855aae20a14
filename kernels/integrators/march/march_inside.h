// The search for the place where a ray that begins at the surface leaves the set again. Distances are of no use inside: fixed steps
// and the inside test alone, then a binary search. What is thinner than a step may be missed.
//
// A ray begins where another has met the surface, which may be some footprints before the set: until it is inside its steps grow from
// a part of a footprint. One that does not find the set there has met a sheet without an inside, and leaves at once. Where media scatter
// light this is a part of walks (random_walk.h), whose first place to test is the very beginning.
//
// A ray is in one body of the set, which its `known` tells, and leaves it where another one begins: also one that displaces it, and opaque
// parts. To these the distance is known: rays go no farther than it says, and meet walls that no step would find.
#define ENTRANCE_REACH R(16.0)      // footprints before the set, at the most ...
#define ENTRANCE_START R(0.0625)    // ... and the first place to test beyond its beginning
#define ENTRANCE_GROWTH R(0.5)      // of the way so far
#define EXIT_TOLERANCE R(0.01)      // of the footprint
#define EXIT_NEARER R(0.25)         // part of the height over the exit at which the place beyond is looked for next
#define EXIT_TRIES R(3.5)
#define WALL_MET R(0.03)            // of the cone: an opaque part so near is met ...
#define WALL_CREEP R(0.25)          // ... and the least step towards one

#define REFILL 1
#define ABREAST 1
#define ORBITS_WAITED(m) 0

typedef struct {
    ray r;
    mask active;
    crossing found;
    real t, low, high;       // the present place; the last place inside, and the first one outside after it
    mask entered, left, narrow;
    mask waits;              // of each lane, see orbit_waits: of all its rays
    real height, tries;      // over the exit, where light is computed
    real beyond;             // the body after the last place inside
} march;

// Lanes `fresh` begin a march along new rays; the others go on with theirs.
INLINE void march_begin(march *m, ray r, mask fresh, int goal, march_record settings) {
    const real ahead = goal == GOAL_WALK ? R(0.0) : ENTRANCE_START * (real)(settings->detail) * r.footprint;
    const real start = r.near + ahead;
    MARCH_TAKES(m, r, fresh);
    m->t = pick(fresh, start, m->t);
    m->low = pick(fresh, r.near, m->low);
    m->high = pick(fresh, r.near, m->high);
    m->entered &= ~fresh;
    m->left &= ~fresh;
    m->narrow &= ~fresh;
    m->height = pick(fresh, R(0.0), m->height);
    m->tries = pick(fresh, R(0.0), m->tries);
    m->beyond = pick(fresh, R(0.0), m->beyond);
}

// The body at the present places of a march, and which lanes are inside their own.
#define MARCH_TESTS_BODY(m, point, here, body, inside)                                                    \
    const vec point = vec_along((m)->r.origin, (m)->t, (m)->r.direction);                                 \
    real body;                                                                                            \
    const orbit_end here = orbit_bodies(point, (m)->active, (m)->r.known, &body, orbit, k);               \
    MARCH_COUNTS(m, here);                                                                                \
    const mask inside = (m)->active & equal(body, (m)->r.known)

// How far opaque parts let the lanes `asked` go, and in `met` which of them have come to one.
INLINE real march_to_walls(march *m, vec point, mask asked, real cone, mask *met, march_record settings, orbit_record orbit, constants k) {
    const int walls = list_of_body(BODY_OPAQUE, orbit);
    *met = asked & ~asked;
    if (walls == 0 || !any_lane(asked)) return (real)(REAL_LARGEST);
    surface_point ignored;
    const clearance there = solids_distance(&point, asked, HAS_DERIVATIVE ? ASK_STEP : ASK_GRADIENT, orbit + walls, k, &ignored);
    m->found.count += pick(asked, there.end.count, R(0.0));
    // (In a hollow of theirs no distance is known, but how far it is at most.)
    const mask known = ~is_blind(there);
    const real near = there.scale * pick(less(there.step, there.near), there.near, there.step);
    const mask beside = asked & known & less(near, near_of(there, settings) * cone);
    const mask first = less_equal((real)(REAL_LARGEST), m->found.touch);
    m->found.touch = pick(asked, pick(beside, pick(first, m->t, m->found.touch), (real)(REAL_LARGEST)), m->found.touch);
    *met = beside & less(near, WALL_MET * cone);
    m->found.t = pick(*met, m->t, m->found.t);
    m->found.last = pick(*met, m->t, m->found.last);
    return fmax(there.scale * pick(known, there.step, there.most), WALL_CREEP * cone);
}

// Lanes that have found where an opaque part begins; light is computed before it.
INLINE mask march_at_walls(march *m) {
    const mask behind = m->active & m->narrow & equal(m->beyond, (real)((scalar)BODY_OPAQUE));
    m->found.t = pick(behind, m->low, m->found.t);
    m->found.last = pick(behind, m->high, m->found.last);
    m->found.touch = pick(behind, fmin(m->found.touch, m->low), m->found.touch);
    return behind;
}

// Lanes that have not found the set within reach: they have met a sheet without an inside, which they leave at once.
INLINE mask march_misses(march *m, mask outside, real cone) {
    const mask sheet = outside & ~m->entered & less(m->r.near + ENTRANCE_REACH * cone, m->t);
    m->found.t = pick(sheet, m->r.near, m->found.t);
    m->found.last = pick(sheet, m->t, m->found.last);
    m->found.touch = pick(sheet, m->t, m->found.touch);
    return sheet;
}

// Over the exit: the place at which light is computed, nearer where something else begins there; the result says which lanes have it.
INLINE mask march_places(march *m, mask inside, mask outside) {
    const mask over = m->active & m->narrow;
    m->tries += pick(over, R(1.0), R(0.0));
    m->height = pick(over & inside, EXIT_NEARER * m->height, m->height);
    const mask placed = over & (outside | less(EXIT_TRIES, m->tries));
    m->found.t = pick(placed, m->low, m->found.t);
    m->found.last = pick(placed, m->high, m->found.last);
    m->found.touch = pick(placed, m->high + m->height, m->found.touch);
    return placed;
}

// Narrows the exit of lanes that search for it down to `finest`; then light is to be computed `height` over it.
INLINE void march_narrows(march *m, mask inside, mask outside, mask searching, real body, real finest, real height) {
    // An opaque part may begin where the ray does.
    m->entered |= outside & searching & equal(body, (real)((scalar)BODY_OPAQUE));
    m->left |= outside & searching & m->entered;
    m->entered |= inside & searching;
    m->low = pick(inside & searching, m->t, m->low);
    m->high = pick(outside & searching & m->entered, m->t, m->high);
    m->beyond = pick(outside & searching, body, m->beyond);
    const mask narrow = searching & m->left & less_equal(m->high - m->low, finest);
    m->narrow |= narrow;
    m->height = pick(narrow, height, m->height);
}

// Where the next test is: `onward`, unless the exit is being narrowed or placed.
INLINE real march_goes_to(const march *m, real onward) {
    return pick(m->narrow, m->high + m->height, pick(m->left, R(0.5) * (m->low + m->high), onward));
}

// One step of the active lanes; those that arrive, or leave their ray's part, are active no longer.
INLINE void march_step(march *m, int goal, march_record settings, orbit_record orbit, constants k) {
    const real step = (real)(settings->step), cone = (real)(settings->detail) * (m->r.footprint + m->r.spread * m->t);
    MARCH_TESTS_BODY(m, point, here, body, inside);
    const mask outside = m->active & ~inside;
    mask met;
    const real free = march_to_walls(m, point, inside & ~m->narrow, cone, &met, settings, orbit, k);
    mask done = met | march_misses(m, outside, cone) | march_places(m, inside, outside);
    const real size = most(most(fabs(point.x), fabs(point.y)), most(fabs(point.z), m->t));
    const real finest = most(EXIT_TOLERANCE * cone, R(2.0) * (real)(REAL_EPSILON) * size);
    march_narrows(m, inside, outside, m->active & ~m->narrow, body, finest, (real)(settings->near) * cone);
    done |= march_at_walls(m);
    m->found.hit |= done;
    m->active &= ~done;
    const real entrance = most(ENTRANCE_START * cone, ENTRANCE_GROWTH * (m->t - m->r.near));
    const real longest = least(step, free);
    m->t = march_goes_to(m, m->t + pick(m->entered, longest, least(entrance, longest)));
    // The set may end where its bounds do.
    m->active &= less_equal(m->t, m->r.far + step);
}
