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

// The spot where one ray has met the surface.
INLINE spot spot_of_ray(ray r, encounter met, world w) {
    spot here;
    here.found = met.hit;
    here.point = vec_along(r.origin, met.touch, r.direction);
    here.seen = vec_along(r.origin, met.t, r.direction);
    here.normal = met.normal;
    here.cone = r.footprint + r.spread * met.t;
    here.smooth = met.smooth;
    here.residual = R(0.0);
    here.quantity = R(0.0);
    here.tint = surface_color(met.normal, met.smooth, w.material, w.palette);
    return here;
}

#if HAS_GLASS
// What a path has met: its ray within the set is its second one, and was sent in place of the first.
INLINE encounter met_within(queue q, int slot, encounter met) {
    const ray second = queue_ray(q, 1, slot);
    const mask within = less(second.near, second.far);
    const encounter other = queue_met(q, 1, slot);
    for (int i = 0; i < NUMBERS_OF(encounter); ++i) ((real *)&met)[i] = pick(within, ((const real *)&other)[i], ((real *)&met)[i]);
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

