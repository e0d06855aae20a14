// Facets of slightly rough boundaries, over which chains lead: their slopes against the boundary's normal are drawn once for a chain, from the
// distribution by which paths are scattered there, and are the same wherever it crosses while it is searched (Hanika, Droske, Fascione 2015;
// Zeltner, Georgiev, Jakob 2020). So how likely they are cancels, and what is left is what paths lose at such a boundary.

// A number of a stream of random ones in (0, 1).
INLINE real next_random(bits *stream) {
    *stream = hash_bits(*stream + 0x9e3779b9u);
    return unit_of_bits(*stream);
}

// Facets of the first boundary and the last one: slopes of them along two axes that `axis` gives each normal.
typedef struct {
    vec axis;
    real along[2], across[2];
    scalar wide;              // how steep they are (GGX's alpha); 0: boundaries are smooth
} facets;

// A facet at a boundary, away from the body, and its axes there.
typedef struct {
    vec normal, side, up;
    real turn;                // how fast the axes turn about the normal where that turns
} tilted;

INLINE scalar facets_wide(object_record o, world w) {
    const scalar rough = w.materials[o->material].specular_roughness;
    return rough > S(0.0) ? fmax(rough * rough, S(1.0) / (scalar)SMOOTHEST_PARTS) : S(0.0);
}

INLINE facets no_facets(vec axis, scalar wide) {
    const real none = R(0.0);
    facets f;
    f.axis = axis;
    f.along[0] = f.along[1] = f.across[0] = f.across[1] = none;
    f.wide = wide;
    return f;
}

// Slopes of GGX's facets, each lane's by its own stream.
INLINE void facets_drawn(facets *f, bits seed) {
    bits stream = hash_bits(seed + 0x51ed270bu);
    for (int i = 0; i < 2; ++i) {
        real sine, cosine;
        const real share = next_random(&stream), steep = (real)(f->wide) * sqrt(share / (R(1.0) - share));
        wave_turn(R(6.283185307179586) * next_random(&stream), &sine, &cosine);
        f->along[i] = steep * cosine;
        f->across[i] = steep * sine;
    }
}

INLINE tilted tilted_on(const facets *f, int i, vec normal) {
    tilted t;
    const real over = vec_dot(f->axis, normal);
    const vec side = vec_along(f->axis, -over, normal);
    const real share = R(1.0) / fmax(sqrt(vec_dot(side, side)), R(1e-6));
    t.side = vec_scale(side, share);
    t.up = vec_cross(normal, t.side);
    t.turn = over * share;
    const vec leans = vec_along(vec_scale(t.side, f->along[i]), f->across[i], t.up);
    t.normal = vec_scale(vec_add(normal, leans), R(1.0) / sqrt(R(1.0) + vec_dot(leans, leans)));
    return t;
}

// How it changes where the boundary's normal does, from that one on.
INLINE vec tilted_turns(const facets *f, int i, const tilted *t, vec normal, vec turned) {
    const real side = vec_dot(t->side, turned), up = vec_dot(t->up, turned), about = -t->turn * up;
    const real x = f->along[i], y = f->across[i];
    const vec sinks = vec_along(turned, -(x * side + y * up), normal);
    return vec_scale(vec_along(vec_along(sinks, -y * about, t->side), x * about, t->up), R(1.0) / sqrt(R(1.0) + x * x + y * y));
}

// The facet that bends one direction into another, by the index before the boundary over that beyond, as it was met.
INLINE void facet_met(facets *f, int i, vec normal, vec before, vec beyond, real index) {
    const vec h = vec_along(beyond, -index, before);
    const tilted t = tilted_on(f, i, normal);
    const real level = vec_dot(h, normal), share = R(1.0) / pick(less(fabs(level), R(1e-6)), R(1e-6), level);
    f->along[i] = vec_dot(h, t.side) * share;
    f->across[i] = vec_dot(h, t.up) * share;
}

// One over how much light facets let past which is level by a cosine (Smith).
INLINE real facets_hide(const facets *f, real cosine) {
    const real square = cosine * cosine;
    return R(0.5) + R(0.5) * sqrt(R(1.0) + (real)(f->wide * f->wide) * (R(1.0) - square) / square);
}
