// Proofs of hits. A distance can be far too small where the map stretches space unevenly, and a cone that touches it is no proof
// of a surface. With the gradient at hand a hit is proved: the touching point descends towards the solid, and counts if it
// arrives within the pixel. Formulas with a scalar rule of their own are nearly conformal and need no proof.
//
// How near counts as arrived depends on the potential G: a low one means that the solid can only be near, though it may be
// as thin as a sheet that no descent finds; where it is high a small estimate is suspect (a valley of G whose steep sides
// pretend to a solid at its bottom), and the descent has to get much nearer.
#define PROOF_STEPS R(12.0)
#define PROOF_FACTOR R(2.0)      // first step down, in estimated distances: conformal maps have their solid at one to four
#define PROOF_ARRIVED R(0.0625)  // of the pixel's cone: this near to the solid counts as being there ...
#define PROOF_LANDED R(0.002)    // ... and this near where the potential is high
#define PROOF_LOW R(0.1)         // a low potential: below this part of the cone over the set's radius
#define PROOF_REACH R(0.75)      // of the pixel's cone: how far from the ray the descent may lead: a little more than half a diagonal
#define PROOF_AHEAD R(1.0)       // of the pixel's cone: how far along the ray a hit may lie from where its proof has arrived
#define PROOF_APART R(1.0)       // of the pixel's cone: how far apart two proofs are, unless ...
#define PROOF_CLOSER R(0.7)      // ... the solid is that much nearer than at the failed one
#define PROOF_ONWARD R(0.5)      // of the pixel's cone: the step after a failed proof
// The march that a pixel's points share gives up sooner and goes on farther: they look more closely.
#define TOUCH_STEPS R(8.0)
#define TOUCH_ONWARD R(1.0)

INLINE mask proof_under_way(const march *m) { return HAS_DERIVATIVE ? m->active & ~m->active : m->proving; }

// The whole cone of a pixel is looked through for its points.
INLINE real proof_reach(int goal) { return goal == GOAL_TOUCH ? R(1.0) : PROOF_REACH; }
INLINE real proof_onward(int goal) { return goal == GOAL_TOUCH ? TOUCH_ONWARD : PROOF_ONWARD; }
INLINE real proof_most(int goal) { return goal == GOAL_TOUCH ? TOUCH_STEPS : PROOF_STEPS; }

// Whether a probe so far from its place on the ray is beside the pixel. No look at it is needed to know that.
INLINE mask proof_astray(const march *m, const sight *s, vec offset, int goal) {
    const real along = vec_dot(offset, m->r.direction), reach = proof_reach(goal) * s->cone;
    return less(reach * reach, vec_dot(offset, offset) - along * along);
}

// Lanes that prove a hit: those that have arrived. The lanes that march are the result.
INLINE mask proof_step(march *m, const sight *s, march_record settings, orbit_record orbit) {
    const mask proving = m->proving & m->active;
    if (HAS_DERIVATIVE || !any_lane(proving)) return m->active;
    const real cone = s->cone;
    const mask close = less(potential(s->here.end, s->surface, orbit) * (real)(settings->set_radius), PROOF_LOW * cone);
    const mask arrived = proving & (s->here.end.inside | less(s->near, pick(close, PROOF_ARRIVED, PROOF_LANDED) * cone));
    m->found.hit |= arrived;
    m->found.last = pick(arrived, m->low, m->found.last);
    const real solid_t = m->t + vec_dot(vec_sub(s->point, s->on_ray), m->r.direction), apart = PROOF_AHEAD * cone;
    m->found.t = pick(arrived, clamp(m->proved_t, solid_t - apart, solid_t + apart), m->found.t);
    m->active &= ~arrived;
    const mask marching = m->active & ~m->proving;
    m->proving &= ~arrived;
    return marching;
}

// Lanes whose proof has failed go on along their rays.
INLINE void proof_fail(march *m, const sight *s, mask failed, int goal) {
    const real cone = s->cone;
    m->retry_t = pick(failed, m->t + PROOF_APART * cone, m->retry_t);
    m->retry_radius = pick(failed, PROOF_CLOSER * m->radius_before, m->retry_radius);
    const mask onward = failed & ~passed_between(m);
    m->t = pick(onward, least(m->t + proof_onward(goal) * cone, m->limit), m->t);
    m->step_before = pick(onward, proof_onward(goal) * cone, m->step_before);
    m->slope = pick(onward, R(-1.0), m->slope);
    m->landing |= failed;
    march_between(m, s, failed);
    m->proving &= ~failed;
}

// Lanes that touched the solid begin a proof, and those under way go further down; which have `failed` is put down: their way has led
// too far, or leads beside the pixel now. The result are hits that need no proof: a bracketed lane has seen the inside already, and
// what a neighbouring point of the pixel has proved need not be proved again.
INLINE mask proof_begin(march *m, const sight *s, mask touched, mask bracketed, real hit_t, int goal, march_record settings,
                        mask *failed) {
    *failed = touched & ~touched;
    if (HAS_DERIVATIVE) return touched;
    const mask done = touched & (bracketed | (is_point(m) & less(fabs(m->t - m->r.known), (real)(settings->known_reach) * s->cone)));
    const mask due = touched & ~done & (less_equal(m->retry_t, m->t) | less(s->radius, m->retry_radius));
    const mask proving = m->proving & m->active;
    if (!any_lane(proving | due)) return done;
    const vec downhill = vec_scale(vec_normalize(s->surface.gradient), R(-1.0));
    // Bolder while the slope keeps its direction and the distance does not shrink, timid once it has turned.
    const mask turned = less(vec_dot(downhill, m->probe_downhill), R(0.0));
    const mask slow = less(R(0.5) * m->probe_radius, s->radius);
    m->factor = pick(due, PROOF_FACTOR, pick(proving, m->factor * pick(turned, R(0.5), pick(slow, R(2.0), R(1.0))), m->factor));
    m->probes = pick(due, R(0.0), pick(proving, m->probes + R(1.0), m->probes));
    m->proved_t = pick(due, hit_t, m->proved_t);
    m->proving |= due;
    real down = m->factor * most(PROOF_LANDED * s->cone, s->radius);
    // A pixel's march must miss nothing within its cone: a step that is too bold would overshoot and count as astray.
    if (goal == GOAL_TOUCH) down = least(down, R(0.99) * proof_reach(goal) * s->cone);
    const mask goes_down = proving | due;
    m->probe = vec_pick(goes_down, vec_along(s->point, down, downhill), m->probe);
    m->probe_downhill = vec_pick(goes_down, downhill, m->probe_downhill);
    m->probe_radius = pick(goes_down, s->radius, m->probe_radius);
    *failed = (proving & less(proof_most(goal), m->probes)) | (goes_down & proof_astray(m, s, vec_sub(m->probe, s->on_ray), goal));
    proof_fail(m, s, *failed, goal);
    return done;
}
