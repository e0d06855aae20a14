// Lights that stand on the set or beside it, beside those that are listed: objects that shine, and balls on the set.

INLINE real with_lights_beside(real sum, vec point, real own, world w) {
    if (w.settings->set_count > 0) sum += set_weight(&point, w);
    if (HAS(w, EMITTERS)) sum += emitters_weight(&point, own, w);
    return sum;
}

// One of the balls, where no other light is chosen.
CALLED void sample_set_light(choosing *c, const real *numbers, world w) {
    const real weight = set_weight(&c->from, w);
    const mask here = c->open & less(R(0.0), weight);
    if (!any_lane(here)) return;
    const set_choice choice = set_choose(c->point, c->normal, numbers[3], numbers[4], w);
    const set_ball ball = set_ball_of(choice.number, w);
    const mask shines = less(R(0.0), choice.weight);
    light_ray r;
    real density;
    r.toward = set_direction(&ball, c->point, numbers[0], numbers[1], &r.distance, &density);
    r.light = color_pick(shines, ball.light, color_of(R(0.0), R(0.0), R(0.0)));
    r.density = density / pick(shines, choice.weight, R(1.0));
    takes(c, here, r, weight);
    c->number = pick(here, LIGHT_OF_SET, c->number);
    c->found.sought = pick(here, NEVER_BENT, c->found.sought);
    c->found.reckoned = pick(here & shines, choice.weight, c->found.reckoned);
    c->found.both |= here;
    c->found.unblocked |= here & ~ball.shadow;
    c->begin = vec_pick(here, c->point, c->begin);
}

INLINE void sample_lights_beside(choosing *c, const real *numbers, world w) {
    if (HAS(w, EMITTERS)) sample_emitter(c, numbers, w);
    if (w.settings->set_count > 0) sample_set_light(c, numbers, w);
}
