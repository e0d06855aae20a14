// Sheets without thickness, which no step ends in: where a map folds space, sets have such sheets, and over them lie layers in which
// distances are too large. A ray that looks for its own pixel's surface goes there by shorter steps, and looks back: where the gradient
// has faced the ray and now follows it, the distance is least in between, and this place is looked for before the ray goes on. Formulas
// with a scalar rule are nearly conformal, and have none.
#define PASSED_NEAR R(2.0)       // of the cone: so near the solid rays look back
#define PASSED_NARROW R(0.06)    // of the cone: so narrow a part of a ray has been looked through
#define FACING_SLOPE R(0.5)      // of a scaled distance along its gradient: where a surface is smooth it is half of the true one

// Points of a pixel stand for each other, and begin near the solid.
INLINE mask seeks_sheets(const march *m, int goal) {
    return !HAS_DERIVATIVE && goal == GOAL_SURFACE ? ~is_point(m) : m->active & ~m->active;
}

// Lanes that look between `low` and `behind`.
INLINE mask passed_between(const march *m) { return HAS_DERIVATIVE ? m->active & ~m->active : less(m->behind, (real)(REAL_LARGEST)); }
INLINE real ray_facing(const march *m, const sight *s) { return vec_dot(vec_normalize(s->surface.gradient), m->r.direction); }

// The lanes that are behind such a place now.
INLINE mask march_passed(march *m, const sight *s, mask outside, mask inside, int goal) {
    if (HAS_DERIVATIVE) return outside & ~outside;
    const real facing = ray_facing(m, s);
    const mask along = less(R(0.0), facing), free = less_equal((real)(REAL_LARGEST), m->high);
    const mask turned = free & less(m->facing, R(0.0)) & less(s->near, PASSED_NEAR * s->cone);
    const mask passed = outside & seeks_sheets(m, goal) & along & (passed_between(m) | turned);
    m->behind = pick(passed, m->t, pick(inside, (real)(REAL_LARGEST), m->behind));
    m->facing = pick(outside & ~passed, facing, m->facing);
    return passed;
}

// Halves the part of the ray that was passed; one that is narrow, and has nothing, is left behind.
INLINE void march_between(march *m, const sight *s, mask marching) {
    if (HAS_DERIVATIVE) return;
    const mask between = marching & passed_between(m);
    const mask left = between & less(m->behind - m->low, PASSED_NARROW * s->cone);
    m->t = pick(between, pick(left, m->behind, R(0.5) * (m->low + m->behind)), m->t);
    m->facing = pick(left, R(1.0), m->facing);
    m->behind = pick(left, (real)(REAL_LARGEST), m->behind);
    m->landing |= between;
    m->step_before = pick(between, m->t - m->low, m->step_before);
}

// The slope of the distance ahead: no higher than its gradient says here.
INLINE real march_slope(const march *m, const sight *s, int goal, march_record settings) {
    if (HAS_DERIVATIVE) return m->slope;
    const real facing = ray_facing(m, s), here = FACING_SLOPE * step_scale_of(s->here, settings->step_scale) * facing;
    return pick(seeks_sheets(m, goal) & less(facing, R(0.0)), least(m->slope, here), m->slope);
}

// The slope where none has been measured yet.
INLINE real march_first_slope(const march *m, const sight *s, march_record settings) {
    if (HAS_DERIVATIVE) return m->slope;
    return (real)(settings->first_slope) * step_scale_of(s->here, settings->step_scale) * ray_facing(m, s);
}
