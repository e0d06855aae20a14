// Light in air beside that of single lamps: the sky's sun, and one for all others: lamps of the tree, things that shine, balls on the set.
// One of these is chosen for a ray by how strong it is and how near the ray goes by; where a tree has them, from its root down.

// What a turn brings to the eye if nothing is in the way, and the ray for that.
typedef struct {
    real t;
    vec toward;
    real distance;
    color light;
    real seeks;   // where light is sought: 1 + the number of the thing that the ray has to meet; `light` is of a light of 1 then
} air_light;

INLINE air_light air_light_of(const air_way *way, real t, light_ray found, real weight, material_record m) {
    const real part = weight * phase_of(vec_dot(found.toward, way->r.direction), (real)(m->fog_anisotropy));
    return (air_light){t, found.toward, found.distance, color_scale(found.light, part / found.density)};
}

// The sun of a sky, by a place of its disc.
CALLED air_light sun_in_air(const air_way *way, real u, real v, real other, world w) {
    __global const float *sun = sun_numbers(w.material, w.environment);
    const real t = place_by_depth(way, u, w.material);
    const vec toward = cone_direction(sun_toward(w.material, sun), sun_spread(sun), v, other);
    const color light = color_scale(sun_light(toward, w.material, sun), (real)(w.material->environment_intensity));
    const light_ray found = {toward, (real)(REAL_LARGEST), light, R(1.0) / (R(6.283185307179586) * sun_spread(sun))};
    return air_light_of(way, t, found, way->all, w.material);
}

// About what a light brings that stands at a place, is so bright from a distance of 1, and fills a ball.
INLINE real air_weight(const air_way *way, vec place, real radius, real power, material_record m) {
    const air_about a = air_about_place(way, place, radius, air_core(way), m);
    return power * (a.near + a.by_depth);
}

INLINE real air_node_weight(const air_way *way, __global const float *tree, ints node, material_record m) {
    const vec middle = tree_vec(tree, node, TREE_MIDDLE);
    const real near = air_weight(way, middle, gather_floats(tree, node + TREE_RADIUS), gather_floats(tree, node + TREE_POWER), m);
    return near + gather_floats(tree, node + TREE_STEADY) * way->all;
}

// Goes down a tree by `place` in [0, 1), of which what is left is in [0, 1) again: the number of a lamp, and the probability of the choice.
CALLED real air_descent(const air_way *way, real *place, mask active, __global const float *tree, material_record m, real *share) {
    ints node = to_ints(R(0.0));
    *share = R(1.0);
    for (;;) {
        const mask inner = active & less(to_reals(node) + (real)(TREE_NODE), gather_floats(tree, node + TREE_END) * (real)(TREE_NODE));
        if (!any_lane(inner)) break;
        const ints first = pick_ints(inner, node + TREE_NODE, 0);
        const ints second = pick_ints(inner, TREE_NODE * to_ints(gather_floats(tree, first + TREE_END)), 0);
        const real a = air_node_weight(way, tree, first, m), b = air_node_weight(way, tree, second, m);
        const real left = tree_part(a, b), right = tree_part(b, a);
        const mask goes_right = less_equal(left, *place);
        const real part = pick(goes_right, right, left);
        *share = pick(inner, *share * part, *share);
        const real rest = pick(goes_right, *place - left, *place) / most(part, (real)(REAL_SMALLEST));
        *place = pick(inner, bounded(rest, R(0.0), R(1.0) - (real)(REAL_EPSILON)), *place);
        node = pick_ints(inner, pick_ints(goes_right, second, first), node);
    }
    return gather_floats(tree, node + TREE_LAMP);
}

// What is left to choose from: a row in which each has its weight, and a place on it.
typedef struct {
    real place, before, total;
    mask open;
} air_choice;

// Whether the one with that weight is chosen, and which part of it `place` has gone through then.
INLINE mask air_chosen(air_choice *c, real weight, real *place) {
    const mask here = c->open & less(c->place, c->before + weight) & less(R(0.0), weight);
    *place = bounded((c->place - c->before) / most(weight, (real)(REAL_SMALLEST)), R(0.0), R(1.0) - (real)(REAL_EPSILON));
    c->before += weight;
    c->open &= ~here;
    return here;
}

INLINE void air_takes(air_light *found, mask here, air_light one, real probability) {
    found->t = pick(here, one.t, found->t);
    found->toward = vec_pick(here, one.toward, found->toward);
    found->distance = pick(here, one.distance, found->distance);
    found->light = color_pick(here, color_scale(one.light, R(1.0) / most(probability, (real)(REAL_SMALLEST))), found->light);
    found->seeks = pick(here, one.seeks, found->seeks);
}

INLINE real lamps_in_air(const air_way *way, __global const float *tree, int nodes, world w) {
    return nodes > 0 ? air_node_weight(way, tree, to_ints(R(0.0)), w.material) : R(0.0);
}

// Whether a thing has no end: it shines alike into the air near by and far away.
#define IS_ENDLESS(o) ((o)->kind == SHAPE_PLANE)

// The square of the radius of a ball around it.
INLINE real emitter_square(object_record o) {
    const scalar x = o->sides[0], y = o->sides[1], z = o->sides[2];
    return (real)(x * x + y * y + z * z);
}

// (A ball of the same area as an object's three sides has about its strength from afar.)
INLINE real emitter_in_air(const air_way *way, object_record o, world w) {
    if (IS_ENDLESS(o)) return (real)(LIGHT_PI * o->luminance) * way->all;
    const scalar x = o->sides[0], y = o->sides[1], z = o->sides[2];
    const real radius = sqrt(emitter_square(o));
    return air_weight(way, vec_splat(o->middle), radius, (real)(o->luminance * (x * y + y * z + z * x)), w.material);
}

// One of the tree's lamps: lanes that have chosen the same one ask it together.
CALLED void air_of_lamps(air_light *found, const air_way *way, real place, mask here, real probability, real u, real v, real other, world w) {
    real share;
    scalar number[LANES];
    lanes_store(air_descent(way, &place, here, LIGHT_TREE(w), w.material, &share), number);
    while (any_lane(here)) {
        const int i = (int)number[highest_bit(lanes_bits(here))];
        const mask same = here & equal(lanes_load(number), (real)((scalar)i));
        light_record light = w.lights + i;
        const scattering one = scattered_of(way, light, u, v, other, w);
        const real distance = light->shadow ? one.in.distance : R(-1.0);
        air_takes(found, same, (air_light){one.t, one.in.toward, distance, color_scale(color_splat(light->color), one.share)}, probability * share);
        here &= ~same;
    }
}

// A direction that the phase function chooses, for what fills much of what a place sees; towards a thing without an end by a mirror in it, so
// that none is lost. Light from there, of 1, and the density of both.
INLINE light_ray emitter_by_phase(object_record o, const air_way *way, vec point, real u, real v, world w) {
    const real g = (real)(w.material->fog_anisotropy);
    light_ray r = {phase_direction(way->r.direction, u, v, g), (real)(REAL_LARGEST), color_of(R(1.0), R(1.0), R(1.0)), R(1.0)};
    r.density = phase_of(vec_dot(r.toward, way->r.direction), g);
    if (!IS_ENDLESS(o)) return r;
    const vec turned = emitter_turned(o, r.toward);
    const real high = emitter_turned(o, vec_sub(point, vec_splat(o->middle))).z;
    const vec mirrored = emitter_in_space(o, vec_of(turned.x, turned.y, -turned.z));
    r.density += phase_of(vec_dot(mirrored, way->r.direction), g);
    r.toward = vec_pick(less(R(0.0), turned.z * high), mirrored, r.toward);
    const real distance = fabs(high) / most(fabs(turned.z), R(1e-6));
    r.distance = distance - emitter_lift(o, point, distance);
    r.light = color_splat(o->radiance);
    return r;
}

// One of the things that shine. From inside of it, or of the ball in which it is sought, nobody samples it: there it is sought by chance, if
// the scene `seeks`.
CALLED void air_of_emitter(air_light *found, const air_way *way, real place, mask here, real probability, object_record o, real u, real v,
                           real other, int seeks, world w) {
    real weight = way->all, t = place_by_depth(way, u, w.material);
    if (!IS_ENDLESS(o)) {
        const real core = fmax(air_core(way) - emitter_square(o), R(0.0));
        const air_about about = air_about_place(way, vec_splat(o->middle), R(0.0), core, w.material);
        t = place_about(way, &about, u, w.material, &weight);
    }
    const vec point = vec_along(way->r.origin, t, way->r.direction);
    const mask inside = IS_ENDLESS(o) ? less(R(1.0), R(0.0)) : ~less(R(0.0), emitter_weight(o, &point));
    light_ray r = IS_ENDLESS(o) ? emitter_by_phase(o, way, point, v, other, w) : emitter_ray(o, point, place, v, other);
    if (any_lane(inside)) {
        const light_ray within = emitter_by_phase(o, way, point, v, other, w);
        r.toward = vec_pick(inside, within.toward, r.toward);
        r.distance = pick(inside, within.distance, r.distance);
        r.light = color_pick(inside, within.light, r.light);
        r.density = pick(inside, within.density, r.density);
    }
    if (!seeks) weight = pick(inside, R(0.0), weight);
    air_light one = air_light_of(way, t, r, weight, w.material);
    const mask sought = inside | (o->sought ? ~0 : 0);
    one.seeks = pick(sought, R(1.0) + emitter_thing(o), R(0.0));
    air_takes(found, here, one, probability);
}

// One of the tree's things likewise.
CALLED void air_of_emitters(air_light *found, const air_way *way, real place, mask here, real probability, real u, real v, real other,
                            int seeks, world w) {
    real share;
    scalar number[LANES];
    lanes_store(air_descent(way, &place, here, EMITTER_TREE(w), w.material, &share), number);
    while (any_lane(here)) {
        const int i = (int)number[highest_bit(lanes_bits(here))];
        const mask same = here & equal(lanes_load(number), (real)((scalar)i));
        air_of_emitter(found, way, place, same, probability * share, emitter_record(i, w), u, v, other, seeks, w);
        here &= ~same;
    }
}

CALLED void air_of_balls(air_light *found, const air_way *way, real place, mask here, real probability, real u, real v, real other, world w) {
    real share, weight;
    const set_ball ball = set_ball_of(air_descent(way, &place, here, w.tables + w.settings->ball_tree, w.material, &share), w);
    const air_about about = air_about_place(way, ball.center, R(0.0), air_core(way), w.material);
    const real t = place_about(way, &about, u, w.material, &weight);
    const vec point = vec_along(way->r.origin, t, way->r.direction);
    light_ray one = {ball.center, R(0.0), ball.light, R(1.0)};
    one.toward = set_direction(&ball, point, v, other, &one.distance, &one.density);
    weight = pick(less(set_spread(&ball, point), R(2.0)), weight, R(0.0));
    one.distance = pick(ball.shadow, one.distance, R(-1.0));
    air_takes(found, here, air_light_of(way, t, one, weight, w.material), probability * share);
}

// One of all others; below 0 is the distance where nothing can be in the way.
INLINE air_light others_in_air(const air_way *way, real choice, real u, real v, real other, int seeks, world w) {
    const mask all = less(R(0.0), R(1.0));
    const real lamps = lamps_in_air(way, LIGHT_TREE(w), w.settings->tree_nodes, w);
    const real balls = lamps_in_air(way, w.tables + w.settings->ball_tree, w.settings->ball_nodes, w);
    const int emitters = HAS(w, EMITTERS) ? w.settings->single_emitters : 0;
    const real of_tree = lamps_in_air(way, EMITTER_TREE(w), w.settings->emitter_nodes, w);
    air_choice c = {R(0.0), R(0.0), lamps + balls + of_tree, all};
    for (int i = 0; i < emitters; ++i) c.total += emitter_in_air(way, emitter_record(i, w), w);
    c.place = choice * c.total;
    air_light found = {R(0.0), vec_of(R(0.0), R(0.0), R(1.0)), R(0.0), color_of(R(0.0), R(0.0), R(0.0)), R(0.0)};
    const real whole = R(1.0) / most(c.total, (real)(REAL_SMALLEST));
    real place;
    mask here = air_chosen(&c, lamps, &place);
    if (any_lane(here)) air_of_lamps(&found, way, place, here, lamps * whole, u, v, other, w);
    here = air_chosen(&c, balls, &place);
    if (any_lane(here)) air_of_balls(&found, way, place, here, balls * whole, u, v, other, w);
    here = air_chosen(&c, of_tree, &place);
    if (any_lane(here)) air_of_emitters(&found, way, place, here, of_tree * whole, u, v, other, seeks, w);
    for (int i = 0; i < emitters; ++i) {
        const real weight = emitter_in_air(way, emitter_record(i, w), w);
        here = air_chosen(&c, weight, &place);
        if (any_lane(here)) air_of_emitter(&found, way, place, here, weight * whole, emitter_record(i, w), u, v, other, seeks, w);
    }
    return found;
}
