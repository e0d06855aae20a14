// A packet of rays on the march, and what it knows of them.

#define SLOPE_AT_FIRST R(-0.5)   // of the distance along a ray, before it is known

// The march of a packet towards one goal, the same for all lanes:
//   GOAL_SURFACE  the surface: hits are proved, and lie where the solid begins
//   GOAL_SHADOW   whether anything is in the way: a step that ended inside is a hit
//   GOAL_CONE     how far the cone of a whole block of pixels is free: never a hit
//   GOAL_TOUCH    how far a whole pixel's cone is free: the first proved touch, at a point still outside
typedef struct {
    ray r;
    mask active;
    crossing found;
    real t;
    real low;         // the last point known to be outside
    real high;        // a point known to be inside
    real limit;       // one that a step saw which was too long: what is before it is looked at first, and no step passes it
    real slope;       // of the distance along the ray, over the last steps
    real radius_before, step_before;
    mask waits;       // of each lane, see orbit_waits: of all its rays
    mask landing;     // the last step led to where the solid is expected
    march_orbit under_way;
    mask late;        // lanes whose orbits are under way still (CARRIES)
    // Of formulas without a scalar rule, whose hits are proved, and which may have sheets (see passed.h and proof.h):
    real facing;      // the cosine between the gradient at the last point before a surface and the ray
    real behind;      // a point at which the gradient follows the ray: the distance is least between `low` and this one
    mask proving;
    vec probe, probe_downhill;
    real probe_radius, probes, factor, proved_t;
    real retry_t, retry_radius;   // the next proof is due from this t on, or below this distance
} march;

// What an evaluation tells: at a place on the ray, or where a hit is being proved.
typedef struct {
    vec point, on_ray;
    clearance here;
    real radius, near, cone;   // how far is free; how near the surface may be, see `clearance`
    mask restless;             // the distance has just grown, near the solid: it may be too large
    mask blind;                // in a hollow nobody knows how far the solid is ...
    real sure;                 // ... but for what is free at least; else the radius
    real to_ball, around;      // see march_to_ball
    surface_point surface;     // without a scalar rule
} sight;

// Rays of a pixel's points: of these something is known.
INLINE mask is_point(const march *m) { return less(m->r.known, RAY_NOTHING_KNOWN); }

// Lanes whose orbits are under way.
INLINE mask march_late(const march *m) { return CARRIES ? m->late : m->active & ~m->active; }

// What is cut out leaves hollows.
#define HOLLOWS (JOINED && settings->hollows)

// Where a ray may go so far only because of the ball around a formula: there it is not near a surface, however narrow the step.
INLINE mask at_ball(const sight *s) { return JOINED ? less(s->radius, s->near) : less(R(1.0), R(0.0)); }

// Lanes `fresh` begin a march along new rays; the others go on with theirs.
INLINE void march_begin(march *m, ray r, mask fresh, int goal, march_record settings) {
    MARCH_TAKES(m, r, fresh);
    m->t = pick(fresh, r.near, m->t);
    m->low = pick(fresh, r.near, m->low);
    m->high = pick(fresh, (real)(REAL_LARGEST), m->high);
    m->limit = pick(fresh, (real)(REAL_LARGEST), m->limit);
    m->slope = pick(fresh, SLOPE_AT_FIRST, m->slope);
    m->radius_before = pick(fresh, (real)(REAL_LARGEST), m->radius_before);
    m->step_before = pick(fresh, R(0.0), m->step_before);
    m->landing &= ~fresh;
    m->late &= ~fresh;
    if (HAS_DERIVATIVE) return;
    m->facing = pick(fresh, R(0.0), m->facing);
    m->behind = pick(fresh, (real)(REAL_LARGEST), m->behind);
    m->proving &= ~fresh;
    m->probe = vec_pick(fresh, r.origin, m->probe);
    m->probe_downhill = vec_pick(fresh, r.direction, m->probe_downhill);
    m->probe_radius = pick(fresh, R(0.0), m->probe_radius);
    m->probes = pick(fresh, R(0.0), m->probes);
    m->factor = pick(fresh, R(1.0), m->factor);
    m->proved_t = pick(fresh, R(0.0), m->proved_t);
    m->retry_t = pick(fresh, R(0.0), m->retry_t);
    m->retry_radius = pick(fresh, R(0.0), m->retry_radius);
}
