// The other search for the surface (Englund 2010, sec. 3.2.3): fixed steps and the inside test alone, then a binary search
// between the last point outside and the first one inside. Needs no distance; misses what is thinner than a step.
//
//   GOAL_SURFACE  steps until inside, then the binary search down to the number type's precision
//   GOAL_SHADOW   steps until inside
//   GOAL_TOUCH    the same: where the pixel's points begin their own search
//   GOAL_POINT    from r.known: steps back while inside, forwards while outside, then the binary search. The thesis gives a
//                 point one step either way; at a rim or on a steep slope its surface is farther off, or another one
//
// A shadow ray's steps grow from the size of a pixel to the full step: what is in the way often begins close by, and a full
// step at once would leap over it and let dots of light into every crease.
#define SHADOW_FIRST R(2.0)   // step, in the ray's footprints
#define SHADOW_GROWTH R(1.5)

// Steps are too cheap, and those of neighbours too alike, for a pause before all lanes are done.
#define REFILL LANES
#define ABREAST 1
#define ORBITS_WAITED(m) 0

typedef struct {
    ray r;
    mask active;
    crossing found;
    real t, pace;
    real low, high;   // the last points seen outside and inside
    mask seen_outside, seen_inside;
    mask waits;       // of each lane, see orbit_waits: of all its rays
} march;

// Lanes `fresh` begin a march along new rays; the others go on with theirs.
INLINE void march_begin(march *m, ray r, mask fresh, int goal, march_record settings) {
    const real step = (real)(settings->step);
    const real start = goal == GOAL_POINT ? bounded(r.known, r.near, r.far) : r.near;
    MARCH_TAKES(m, r, fresh);
    m->t = pick(fresh, start, m->t);
    m->pace = pick(fresh, goal == GOAL_SHADOW ? least(SHADOW_FIRST * r.footprint, step) : step, m->pace);
    m->low = pick(fresh, start, m->low);
    m->high = pick(fresh, start, m->high);
    m->seen_outside &= ~fresh;
    m->seen_inside &= ~fresh;
}

// One step of the active lanes; those that arrive, or leave their ray's part, are active no longer.
INLINE void march_step(march *m, int goal, march_record settings, orbit_record orbit, constants k) {
    const real step = (real)(settings->step);
    const int narrows = goal == GOAL_SURFACE || goal == GOAL_POINT;
    MARCH_TESTS(m, point, here);
    const mask inside = m->active & here.inside;
    const mask outside = m->active & ~here.inside;
    m->seen_inside |= inside;
    m->seen_outside |= outside;
    m->low = pick(outside, m->t, m->low);
    m->high = pick(inside, m->t, m->high);

    // What is inside from the beginning of the ray on is hit there.
    const mask bracketed = m->seen_inside & m->seen_outside;
    const real finest = R(2.0) * (real)(REAL_EPSILON) * most(fabs(m->t), step);
    const mask cut = inside & ~m->seen_outside & less_equal(m->t, m->r.near);
    const mask done = m->active & (narrows ? (bracketed & less_equal(m->high - m->low, finest)) | cut : inside);
    m->found.hit |= done;
    m->found.t = pick(done, pick(bracketed, m->low, m->t), m->found.t);
    m->found.last = pick(done, m->found.t, m->found.last);
    m->active &= ~done;

    // Far off a step may be less than numbers tell apart, and a footprint may be 0: a ray gets on all the same.
    const real way = most(m->pace, finest);
    const real onward = pick(inside, most(m->t - way, m->r.near), m->t + way);
    m->t = pick(bracketed, R(0.5) * (m->low + m->high), onward);
    m->pace = least(SHADOW_GROWTH * way, step);
    m->active &= less_equal(m->t, m->r.far);
}
