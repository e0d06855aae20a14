// What is seen along a ray so far: light, and the part of what comes next that gets through; and the place where half of the
// light is stopped, with the value there (on a plane the count), which is what the data channels tell.
typedef struct {
    color light;
    real through, t, value;
    vec normal;
    mask found, on_plane, middle_way;   // the last: where it was met by what came last
} sight;

// A place with the given `opacity` becomes visible; returns the part of its own light that reaches the eye.
INLINE real sight_pass(sight *s, real opacity, real t, real value, mask adds) {
    const real weight = pick(adds, s->through * opacity, R(0.0));
    s->through = pick(adds, s->through * (R(1.0) - opacity), s->through);
    const mask middle_way = adds & ~s->found & less_equal(s->through, R(0.5));
    s->t = pick(middle_way, t, s->t);
    s->value = pick(middle_way, value, s->value);
    s->found |= middle_way;
    s->middle_way = middle_way;
    return weight;
}

// The same, with the place's light and normal.
INLINE void sight_add(sight *s, color light, real opacity, real t, real value, vec normal, mask of_plane, mask adds) {
    const real weight = sight_pass(s, opacity, t, value, adds);
    s->light = color_pick(adds, color_add(s->light, color_scale(light, weight)), s->light);
    s->normal = vec_pick(s->middle_way, normal, s->normal);
    s->on_plane |= s->middle_way & of_plane;
}
