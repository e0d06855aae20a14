// The glass around a path. A body of glass is an object, with its number from 1, or the set, with the number after them all. Where several
// stand in each other the one with the highest number displaces the others (as nested dielectrics by priority: Schmidt and Budge 2002):
// boundaries of those are not seen there. A path knows two at a place.

#define THROUGH 1   // of an object's `glass`, where light goes through it: it may go below the boundary, too

// Below a boundary (subsurface) a body has a medium of its own, whose number is greater by a half.
#define SKIN R(0.5)
INLINE real body_of(real medium) { return floor(medium); }
INLINE mask is_skin(real medium) { return less(floor(medium), medium); }

INLINE real set_body(world w) { return (real)((scalar)(w.settings->object_count + 1)); }

// What a material's own numbers say of a medium: its index, and what it takes away for each unit of the way, in natural logarithms.
typedef struct {
    real index;
    color extinction;
    color scatters;    // part of the extinction
    real anisotropy;
} medium;

INLINE color absorption_of(color left, real depth) {
    const real each = R(-1.0) / fmax(depth, R(1e-6));
    const mask deep = less(R(0.0), depth);
#define ABSORBED(c) pick(deep, each * log(fmax(left.c, R(1e-6))), R(0.0))
    return color_of(ABSORBED(r), ABSORBED(g), ABSORBED(b));
#undef ABSORBED
}

// Lets a medium that takes so much away scatter a part (OpenPBR 1.1, Translucent base): what it absorbs is the rest, raised by the same
// for all colours where it would be below nothing.
INLINE void medium_scatters(medium *found, color scatter, real depth, real anisotropy) {
    const real each = pick(less(R(0.0), depth), R(1.0) / fmax(depth, R(1e-6)), R(0.0));
    const color scattered = color_scale(scatter, each), taken = found->extinction;
    const real least_absorbed = fmin(fmin(taken.r - scattered.r, taken.g - scattered.g), taken.b - scattered.b);
    const real raised = fmax(-least_absorbed, R(0.0));
#define RAISED(c)                                                                           \
    found->extinction.c = taken.c + raised;                                                 \
    found->scatters.c = scattered.c / fmax(found->extinction.c, R(1e-20));
    RAISED(r)
    RAISED(g)
    RAISED(b)
#undef RAISED
    found->anisotropy = anisotropy;
}

// The medium below a boundary, from what a thick body sends back of light from all sides (OpenPBR 1.1, Subsurface): van de Hulst's
// reflectance A = (1 - s)(1 - 0.139 s) / (1 + 1.17 s), where s^2 = (1 - albedo) / (1 - g albedo), solved for s (Kulla and Conty 2017).
// Bodies below a boundary bend no light: what the boundary reflects is told by its albedos, as for diffuse ones.
INLINE medium medium_of_skin(color back, real radius, color scale, real g) {
    medium found;
    found.index = R(1.0);
    found.anisotropy = g;
#define OF_SKIN(c)                                                                                                              \
    {                                                                                                                           \
        const real s = clamp(R(4.09712) + R(4.20863) * back.c - sqrt(R(9.59217) + (R(41.6808) + R(17.7126) * back.c) * back.c), \
                             R(0.0), R(1.0));                                                                                   \
        found.extinction.c = R(1.0) / fmax(radius * scale.c, R(1e-6));                                                          \
        found.scatters.c = (R(1.0) - s * s) / (R(1.0) - g * s * s);                                                             \
    }
    OF_SKIN(r)
    OF_SKIN(g)
    OF_SKIN(b)
#undef OF_SKIN
    return found;
}

// Of lanes `here` one medium, of the others another.
INLINE medium medium_pick(mask here, medium yes, medium no) {
    for (int i = 0; i < NUMBERS_OF(medium); ++i) ((real *)&no)[i] = pick(here, ((const real *)&yes)[i], ((real *)&no)[i]);
    return no;
}

INLINE void medium_of_material(int number, mask here, real body, medium *found, world w) {
    if (!any_lane(here)) return;
    __constant const struct Pbr *material = w.materials + number;
    // A blend is a medium like its first part.
    while (material->blend[0] >= 0) material = w.materials + material->blend[0];
    const real depth = (real)(material->transmission_depth);
    medium own;
    own.index = (real)(material->specular_ior);
    own.extinction = absorption_of(color_splat(material->transmission_color), depth);
    const color scatter = color_splat(material->transmission_scatter);
    medium_scatters(&own, scatter, depth, (real)(material->transmission_scatter_anisotropy));
    if (any_lane(here & is_skin(body))) {
        const medium below = medium_of_skin(color_splat(material->subsurface_color), (real)(material->subsurface_radius),
                                            color_splat(material->subsurface_radius_scale), (real)(material->subsurface_scatter_anisotropy));
        own = medium_pick(is_skin(body), below, own);
    }
    *found = medium_pick(here, own, *found);
}

// The medium of a body, or the open.
CALLED medium medium_of(real body, world w) {
    const color none = color_of(R(0.0), R(0.0), R(0.0));
    medium found = {R(1.0), none, none, R(0.0)};
    if (!any_lane(less(R(0.0), body))) return found;
    for (int i = 0; i < w.settings->object_count; ++i) {
        medium_of_material(w.objects[i].material, equal(body_of(body), (real)((scalar)(i + 1))), body, &found, w);
    }
    if (HAS(w, GLASS_SET)) medium_of_material(w.settings->set_material, equal(body_of(body), set_body(w)), body, &found, w);
    return found;
}

// Goes into a body, or leaves it.
INLINE void media_enter(path_state *with, real body, mask here) {
    here &= ~equal(body_of(body), body_of(with->medium)) & ~equal(body_of(body), body_of(with->under));
    const mask over = less(with->medium, body);
    with->under = pick(here, pick(over, with->medium, fmax(with->under, body)), with->under);
    with->medium = pick(here & over, body, with->medium);
}

INLINE void media_leave(path_state *with, real body, mask here) {
    const mask first = here & equal(body, body_of(with->medium)), second = here & equal(body, body_of(with->under));
    with->medium = pick(first, with->under, with->medium);
    with->under = pick(first | second, R(0.0), with->under);
}

// The way through a medium to what a path has met. The set ends where its bounds do, though its exit may not be found.
INLINE real way_within(const path_state *with, real way, world w) {
    const real most = R(2.0) * (real)(w.settings->bounds_radius);
    return pick(equal(body_of(with->medium), set_body(w)), fmin(way, most), way);
}

// Lets a clear medium absorb light on a path's way to what it has met.
INLINE void path_absorbs(path *so_far, const path_state *with, real far, mask here, world w) {
    here &= less(R(0.0), with->medium) & ~is_participating(with);
    so_far->through = color_pick(here, absorbed(so_far->through, with->extinction, way_within(with, far, w)), so_far->through);
}

// Notes what the medium does that a path is in now.
INLINE void media_found(path_state *with, medium found, mask here) {
    with->extinction = color_pick(here, found.extinction, with->extinction);
    with->scatters = color_pick(here, found.scatters, with->scatters);
    with->anisotropy = pick(here, found.anisotropy, with->anisotropy);
}

// The open around the eye, or the glass that it is in.
INLINE void media_begin(path_state *with, vec eye, world w) {
    with->medium = with->under = R(0.0);
    with->wave = R(-1.0);
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].glass == THROUGH) media_enter(with, (real)((scalar)(i + 1)), object_holds(w.objects + i, eye));
    }
    media_found(with, medium_of(with->medium, w), less(R(0.0), R(1.0)));
}

// A boundary at which a path arrives.
typedef struct {
    real body;
    mask leaving;    // whether the path comes from inside the body
    mask hidden;     // whether the body is displaced here: the path goes straight on
    real around;     // the glass that the body stands in, or 0
} border;

INLINE border border_at(const path_state *with, const interaction *here, mask lands, world w) {
    border found;
    mask glass = lands & (HAS(w, GLASS_SET) ? ~0 : 0);
    found.body = set_body(w);
    found.leaving = equal(body_of(with->medium), found.body) | equal(body_of(with->under), found.body);
    // What is joined to the set is one body with it.
    const mask beside = less(R(0.0), here->object) & ~of_the_set(here->object, w);
    found.body = pick(beside, here->object, found.body);
    glass &= ~beside;
    found.leaving &= ~beside;
    for (int i = 0; i < w.settings->object_count; ++i) {
        const mask this_one = beside & equal(here->object, (real)((scalar)(i + 1)));
        if (!w.objects[i].glass || !any_lane(this_one)) continue;
        glass |= this_one & lands;
        // The interaction's normal is towards the viewer.
        found.leaving |= this_one & less(vec_dot(object_normal(w.objects + i, here->seen, w.tables), here->normal), R(0.0));
    }
    found.around = pick(equal(body_of(with->medium), found.body), with->under, with->medium);
    found.hidden = glass & less(found.body, found.around);
    return found;
}

// Whether a path comes from below the boundary of an interaction, which it then leaves as if it were seen from outside, straight on.
INLINE mask path_emerges(int bounce, const path_state *with, const interaction *here, world w) {
    real body = set_body(w);
    body = pick(of_the_set(here->object, w), body, here->object);
    return is_skin(with->medium) & equal(body_of(with->medium), body) & (bounce > 0 ? ~0 : 0);
}
