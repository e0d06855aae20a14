// Spots of the surface, of what marches have met.

// Normals of a spot: only the first one, and that of pixels with points, may have several.
INLINE int facet_count(int bounce) { return POINTS > 1 && bounce == 0 ? NORMAL_COUNT : 1; }

INLINE facet facet_of(stage s, const spot *here, int i) {
    facet f = {here->normal, R(1.0)};
    if (facet_count(s.bounce) > 1) STATE_RECALL(s, f, STATE_FACET(i));
    return f;
}

// Whether any normal of the spot faces that way. (With the mean normal only, a rough spot's other normals would have no shadow.)
INLINE mask faces(stage s, const spot *here, vec direction) {
    mask any_normal = less(R(1.0), R(0.0));
    for (int i = 0; i < TURNS(facet_count(s.bounce)); ++i) {
        const facet f = facet_of(s, here, i);
        any_normal |= less(R(0.0), f.weight) & less(R(0.0), vec_dot(f.normal, direction));
    }
    return any_normal;
}

// The colour of a surface: the set's, or that of the object with this number.
INLINE color object_color(vec normal, real quantity, real object, world w) {
    color found = surface_color(normal, quantity, w.material, w.palette);
#if HAS_OBJECTS
    for (int i = 0; i < w.settings->object_count; ++i) {
        const mask here = equal(object, (real)((scalar)(i + 1)));
        if (w.objects[i].colored && any_lane(here)) found = color_pick(here, color_splat(w.objects[i].color), found);
    }
#endif
    return found;
}

// The colour of a spot: where two solids flow together, a blend of theirs.
INLINE color spot_color(vec normal, real quantity, real object, real other, real share, world w) {
    const color own = object_color(normal, quantity, object, w);
#if JOINS_SMOOTHLY
    if (any_lane(less(R(0.0), share))) return color_mix(own, object_color(normal, quantity, other, w), share);
#endif
    return own;
}

// What a ray for a spot has met: the set, or the object with this number.
INLINE encounter surface_met(stage s, int turn, ray r, real *object, world w) {
    encounter met = queue_met(s.q, turn, s.slot);
    *object = R(0.0);
#if HAS_OBJECTS
    *object = queue_object(s.q, turn, s.slot, met);
    const mask here = less(R(0.0), *object);
    if (any_lane(here)) {
        const vec point = vec_along(r.origin, met.t, r.direction);
        const vec normal = objects_normal(&point, &r.direction, *object, w.objects, w.settings->object_count);
        met.normal = vec_pick(here, normal, met.normal);
        met.touch = pick(here, met.t, met.touch);
        met.smooth = pick(here, R(0.0), met.smooth);
        met.more_steps = pick(here, R(0.0), met.more_steps);
        met.more_count = pick(here, R(0.0), met.more_count);
#if JOINS_SMOOTHLY
        met.share = pick(here, R(0.0), met.share);
#endif
    }
#if SOLIDS > 1
    *object = pick(mask_of(met.hit) & ~here, met.solid, *object);
#endif
#endif
    return met;
}

// How far over a spot rays leave it: far enough from the set not to meet the very bump that they start from. An object has none.
INLINE real lift_of(const spot *here, world w) {
    const real over_set = here->cone * (real)(w.settings->shadow_lift);
#if HAS_OBJECTS
    const real far_out = fmax(fmax(fabs(here->point.x), fabs(here->point.y)), fabs(here->point.z));
    const real over_object = R(0.05) * here->cone + R(64.0) * (real)(REAL_EPSILON) * far_out;
    return pick(of_the_set(here->object, w), over_set, over_object);
#else
    return over_set;
#endif
}

// The spot where one ray has met the surface.
INLINE spot spot_of_ray(ray r, encounter met, real object, world w) {
    spot here;
    here.found = met.hit;
    here.point = vec_along(r.origin, met.touch, r.direction);
    here.seen = vec_along(r.origin, met.t, r.direction);
    here.normal = met.normal;
    here.cone = r.footprint + r.spread * met.t;
    here.smooth = met.smooth;
    here.residual = R(0.0);
    here.quantity = R(0.0);
    here.tint = spot_color(met.normal, met.smooth, object, OTHER_OF(met), SHARE_OF(met), w);
#if HAS_OBJECTS || HAS_MATTES
    here.object = object;
#endif
#if JOINS_SMOOTHLY
    here.other = met.other;
    here.share = met.share;
#endif
    return here;
}

#if HAS_GLASS_SET
// What a path has met: its ray within the set is its second one, and was sent in place of the first.
INLINE encounter met_within(stage s, ray r, encounter met, real *object, world w) {
    const ray second = queue_ray(s.q, 1, s.slot);
    const mask within = less(second.near, second.far);
    real other_object;
    const encounter other = surface_met(s, 1, r, &other_object, w);
    for (int i = 0; i < NUMBERS_OF(encounter); ++i) ((real *)&met)[i] = pick(within, ((const real *)&other)[i], ((real *)&met)[i]);
    *object = pick(within, other_object, *object);
    return met;
}
#endif

// What a march has cost, and where `of_surface` what finding its normal has.
INLINE void tally_met(tally *cost, encounter met, int of_surface) {
    cost->steps += met.steps;
    cost->count += met.count;
    if (!of_surface) return;
    const mask hit = mask_of(met.hit);
    cost->steps += pick(hit, met.more_steps, R(0.0));
    cost->count += pick(hit, met.more_count, R(0.0));
    cost->bad += met.bad;
}

