// The glass around a path. A body of glass is an object, with its number from 1, or one of the set's, with the numbers after them all: these
// never overlap, as the march knows which of them is at a place. Where several
// stand in each other the one with the highest number displaces the others (as nested dielectrics by priority: Schmidt and Budge 2002):
// boundaries of those are not seen there. A path knows MOST_BODIES at a place; of more it forgets the lowest. Where a path goes over
// the boundary of an object the places of all objects tell which it is in then: so of bodies that touch, whose boundaries are at one
// place but for rounding, either boundary is the one between both.

// Below a boundary (subsurface) a body has a medium of its own, whose number is greater by a half.
#define SKIN R(0.5)
INLINE real body_of(real medium) { return floor(medium); }
INLINE mask is_skin(real medium) { return less(floor(medium), medium); }

// Whether a path is in a body of the set, where rays of another kind follow it.
INLINE mask is_within_set(const path_state *with, world w) {
    return is_set_body(body_of(with->medium), w) & (HAS(w, GLASS_SET) ? ~0 : 0);
}

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
        medium_of_material(w.objects[i].material, equal(body_of(body), (real)((scalar)w.objects[i].body)), body, &found, w);
    }
    if (HAS(w, GLASS_SET)) medium_of_material(w.settings->set_material, equal(body_of(body), (real)((scalar)w.settings->set_body)), body, &found, w);
    return found;
}

// The bodies that a path is in, the highest first; 0 for none. Those under the first are one number: twice each, since skins have halves.
#define MOST_BODIES 4
#define BODY_DIGIT R(256.0)

typedef struct {
    real each[MOST_BODIES];
} bodies;

INLINE bodies bodies_of(const path_state *with) {
    bodies found;
    found.each[0] = with->medium;
    real rest = with->under;
    for (int i = 1; i < MOST_BODIES; ++i) {
        const real next = floor(rest / BODY_DIGIT);
        found.each[i] = R(0.5) * (rest - BODY_DIGIT * next);
        rest = next;
    }
    return found;
}

INLINE void bodies_keep(path_state *with, bodies in) {
    with->medium = in.each[0];
    with->under = R(0.0);
    for (int i = MOST_BODIES - 1; i > 0; --i) with->under = BODY_DIGIT * with->under + R(2.0) * in.each[i];
}

INLINE mask bodies_have(const bodies *in, real body) {
    mask found = equal(body, body_of(in->each[0]));
    for (int i = 1; i < MOST_BODIES; ++i) found |= equal(body, body_of(in->each[i]));
    return found;
}

// Goes into a body, or leaves it.
INLINE void bodies_enter(bodies *in, real body, mask here) {
    real more = pick(here & ~bodies_have(in, body_of(body)), body, R(0.0));
    for (int i = 0; i < MOST_BODIES; ++i) {
        const real before = in->each[i];
        in->each[i] = fmax(before, more);
        more = fmin(before, more);
    }
}

INLINE void bodies_leave(bodies *in, real body, mask here) {
    mask gone = here & ~here;
    for (int i = 0; i < MOST_BODIES; ++i) {
        gone |= here & equal(body, body_of(in->each[i]));
        in->each[i] = pick(gone, i + 1 < MOST_BODIES ? in->each[i + 1] : R(0.0), in->each[i]);
    }
}

INLINE void media_leave(path_state *with, real body, mask here) {
    if (!any_lane(here)) return;
    bodies in = bodies_of(with);
    bodies_leave(&in, body, here);
    bodies_keep(with, in);
}

INLINE void media_enter(path_state *with, real body, mask here) {
    if (!any_lane(here)) return;
    bodies in = bodies_of(with);
    bodies_enter(&in, body, here);
    bodies_keep(with, in);
}

// The objects around a place, as far as light goes through them; of others that a path is in it is in those no longer that do not hold it.
INLINE void bodies_around(bodies *in, vec place, mask here, world w) {
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (!w.objects[i].glass) continue;
        const real body = (real)((scalar)(i + 1));
        const mask held = object_left(i, place, w.objects, w.planes);
        if (w.objects[i].glass == THROUGH) bodies_enter(in, body, here & held);
        bodies_leave(in, body, here & ~held);
    }
}

// The way through a medium to what a path has met. The set ends where its bounds do, though its exit may not be found.
INLINE real way_within(const path_state *with, real way, world w) {
    const real most = R(2.0) * (real)(w.settings->bounds_radius);
    return pick(is_set_body(body_of(with->medium), w), fmin(way, most), way);
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
    bodies in = {{R(0.0)}};
    bodies_around(&in, eye, less(R(0.0), R(1.0)), w);
    bodies_enter(&in, (real)((scalar)w.settings->eye_body), less(R(0.0), R(1.0)));
    bodies_keep(with, in);
    with->wave = R(-1.0);
    media_found(with, medium_of(with->medium, w), less(R(0.0), R(1.0)));
}

// A boundary at which a path arrives.
typedef struct {
    real body;
    mask leaving;    // whether the path comes from inside the body
    mask glass;      // whether it can go over the boundary
    mask hidden;     // whether there is none here, as the body is displaced, or the same matter is beyond: the path goes straight on
    real around;     // the glass that the body stands in, or 0
    real inner;      // the glass on its inner side: the body's, but where one that touches it displaces it
    bodies beyond;   // those that the path is in if it goes over the boundary
} border;

// What a body's glass is made of: the number of its material; of none and of skins -1.
INLINE real matter_of(real body, world w) {
    real found = pick(equal(body, (real)((scalar)w.settings->set_body)), (real)((scalar)w.settings->set_material), R(-1.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        found = pick(equal(body, (real)((scalar)w.objects[i].body)), (real)((scalar)w.objects[i].material), found);
    }
    return found;
}

// Where a path leaves a body of the set the one of its bodies that is beyond; of what light only goes below, and in the open, 0.
INLINE real body_beyond(const interaction *here, world w) {
    return pick(less(here->other, (real)((scalar)w.settings->first_skin)), here->other, R(0.0));
}

#define TOUCHES R(8.0)   // by how many of a place's lifts bodies are apart that touch

INLINE border border_at(const path_state *with, const interaction *here, mask lands, world w) {
    border found;
    const real object = thing_cut(here->object), before = body_of(with->medium);
    const mask of_set = of_the_set(object, w), beside = less(R(0.0), object) & ~of_set;
    found.body = body_of_thing(object, w);
    found.beyond = bodies_of(with);
    found.glass = lands & of_set & is_set_body(found.body, w);
    found.leaving = of_set & bodies_have(&found.beyond, found.body);
    for (int i = 0; i < w.settings->object_count; ++i) {
        const mask this_one = beside & equal(object, (real)((scalar)(i + 1)));
        if (!w.objects[i].glass || !any_lane(this_one)) continue;
        found.glass |= this_one & lands;
        // The interaction's normal is towards the viewer.
        const vec outward = thing_normal(here->object, w.objects + i, here->seen, w.planes, w.tables);
        found.leaving |= this_one & less(vec_dot(outward, here->normal), R(0.0));
    }
    const mask enters = found.glass & ~found.leaving, leaves = found.glass & found.leaving;
    if (any_lane(found.glass & beside)) {
        const vec beyond = vec_along(here->point, -TOUCHES * lift_of(here, w), here->normal);
        bodies_around(&found.beyond, beyond, found.glass & beside, w);
    }
    bodies_leave(&found.beyond, before, enters & of_set & is_set_body(before, w));
    bodies_enter(&found.beyond, found.body, enters);
    bodies_leave(&found.beyond, found.body, leaves);
    bodies_enter(&found.beyond, body_beyond(here, w), leaves & of_set);
    const real from = pick(leaves, fmax(with->medium, found.body), with->medium), to = found.beyond.each[0];
    found.around = pick(found.leaving, to, from);
    found.inner = pick(found.leaving, from, to);
    const real matter = matter_of(from, w), plane = plane_of_face(here->object);
    found.hidden = found.glass & (equal(from, to) | (less_equal(R(0.0), matter) & equal(matter, matter_of(to, w))));
    // A face with a material of its own covers the glass there.
    for (int i = 0; i < w.planes.count; ++i) {
        if (w.planes.planes[i].material >= 0) found.hidden &= ~equal(plane, (real)((scalar)i));
    }
    return found;
}

// Whether a path comes from below the boundary of an interaction, which it then leaves as if it were seen from outside, straight on.
INLINE mask path_emerges(int bounce, const path_state *with, const interaction *here, world w) {
    return is_skin(with->medium) & equal(body_of(with->medium), body_of_thing(thing_cut(here->object), w)) & (bounce > 0 ? ~0 : 0);
}
