// Light that paths meet by themselves: lamps, what is past everything, and what shines. Of what they could also have asked for they keep a
// share.

// Adds what a path sees at its end: a lamp, or where it leaves the set what is past it.
INLINE void path_ends(path *so_far, const carried *with, const lamp *before, mask leaves, real picture_y, world w) {
    color past = light_past(so_far->direction, picture_y, so_far->origin, with->density, with->total, w);
    const mask alone = less(with->density, R(0.0));
    const real share = pick(alone, R(1.0), power_share(with->density, before->weight / with->total * before->density));
    past = color_pick(before->met, color_scale(before->shows, share), past);
    const color more = limited(color_mul(past, so_far->through), w.settings);
    so_far->seen = color_pick(leaves | before->met, color_add(so_far->seen, more), so_far->seen);
}

// Adds what a spot shines with by itself.
INLINE void spot_shines(stage s, path *so_far, const carried *with, const spot *here, color light, mask shows, world w) {
    color more = color_mul(light, so_far->through);
#if HAS_EMITTERS
    const real distance = vec_dot(vec_sub(here->seen, so_far->origin), so_far->direction);
    if (s.bounce > 0) {
        more = color_scale(more, emitter_share(so_far->origin, so_far->direction, distance, here->object, with->density, with->total, w));
    }
#endif
    if (s.bounce > 0) more = limited(more, w.settings);
    so_far->seen = color_pick(shows, color_add(so_far->seen, more), so_far->seen);
}

#if HAS_EMITTERS
// Adds the light of an object that the last ray of a path has met, as far as the path could also have asked for it.
INLINE void path_ends_at_emitter(stage s, path *so_far, const carried *with, encounter last, mask here, world w) {
    const real number = queue_object(s.q, 0, s.slot, last);
    const color light = emitter_light(number, w);
    here &= less(R(0.0), brightest(light));
    if (!any_lane(here)) return;
    const real share = emitter_share(so_far->origin, so_far->direction, last.t, number, with->density, with->total, w);
    const color more = limited(color_mul(color_scale(light, share), so_far->through), w.settings);
    so_far->seen = color_pick(here, color_add(so_far->seen, more), so_far->seen);
}
#endif
